//! Multiplication and division (ARMv7-M manual, section A4.4.3 and A4.4.6).

use super::instruction::{Flags, LongProduct, Product};
use super::{Cpu, Executed, Trap};
use crate::cpu::fault::Fault;

/// A half-word with its sign.
fn half(value: u32, top: bool) -> i64 {
    i64::from(match top {
        true => (value >> 16) as i16,
        false => value as i16,
    })
}

impl Cpu {
    pub(super) fn multiply(
        &mut self,
        product: Product,
        flags: Flags,
        rd: u8,
        [n, m, a]: [u32; 3],
    ) -> u32 {
        let (signed_n, signed_m) = (i64::from(n as i32), i64::from(m as i32));
        let signed_a = i64::from(a as i32);
        let top = |sum: i64, round: bool| (sum.wrapping_add(i64::from(round) << 31) >> 32) as u32;
        let result = match product {
            Product::Mul => n.wrapping_mul(m),
            Product::Mla => a.wrapping_add(n.wrapping_mul(m)),
            Product::Mls => a.wrapping_sub(n.wrapping_mul(m)),
            Product::Smul { n_top, m_top } => (half(n, n_top) * half(m, m_top)) as u32,
            Product::Smla { n_top, m_top } => {
                self.checked(half(n, n_top) * half(m, m_top) + signed_a)
            }
            Product::Smulw { m_top } => ((signed_n * half(m, m_top)) >> 16) as u32,
            Product::Smlaw { m_top } => {
                self.checked(((signed_n * half(m, m_top)) >> 16) + signed_a)
            }
            Product::Smmul { round } => top(signed_n * signed_m, round),
            Product::Smmla { round } => {
                top((signed_a << 32).wrapping_add(signed_n * signed_m), round)
            }
            Product::Smmls { round } => {
                top((signed_a << 32).wrapping_sub(signed_n * signed_m), round)
            }
        };
        if self.sets(flags) {
            self.set_nz(result);
        }
        self.r[usize::from(rd)] = result;
        1
    }

    /// The lower half of a sum; Q says that there was more.
    fn checked(&mut self, sum: i64) -> u32 {
        self.q |= i32::try_from(sum).is_err();
        sum as u32
    }

    pub(super) fn multiply_long(&mut self, product: LongProduct, lo: u8, hi: u8, n: u32, m: u32) {
        let (lo, hi) = (usize::from(lo), usize::from(hi));
        let before = u64::from(self.r[hi]) << 32 | u64::from(self.r[lo]);
        let unsigned = u64::from(n) * u64::from(m);
        let signed = (i64::from(n as i32) * i64::from(m as i32)) as u64;
        let result = match product {
            LongProduct::Smull => signed,
            LongProduct::Umull => unsigned,
            LongProduct::Smlal => before.wrapping_add(signed),
            LongProduct::Umlal => before.wrapping_add(unsigned),
            LongProduct::Umaal => unsigned + u64::from(self.r[lo]) + u64::from(self.r[hi]),
        };
        self.r[lo] = result as u32;
        self.r[hi] = (result >> 32) as u32;
    }

    /// Cycles: 2 to 12, by the length of the quotient; four bits a cycle is what the range comes from.
    pub(super) fn divide(&mut self, signed: bool, rd: u8, n: u32, m: u32) -> Executed {
        if m == 0 && self.system.traps_division_by_zero() {
            return Err(Trap::Fault(Fault::division_by_zero()));
        }
        let result = match (m, signed) {
            (0, _) => 0,
            (_, true) => (n as i32).wrapping_div(m as i32) as u32,
            (_, false) => n / m,
        };
        self.r[usize::from(rd)] = result;
        let magnitude = if signed {
            (result as i32).unsigned_abs()
        } else {
            result
        };
        Ok(2 + (32 - magnitude.leading_zeros()).div_ceil(4).min(10))
    }
}
