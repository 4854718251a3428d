//! Data processing: shifts, additions, bit fields.

use super::instruction::{Bits, Extension, Flags, Operation, Saturating, Shift};
use super::{Cpu, PC};

/// AddWithCarry of the manual (section A2.2.1): sum, carry, overflow.
#[inline]
pub(crate) fn add_with_carry(x: u32, y: u32, carry: bool) -> (u32, bool, bool) {
    let wide = u64::from(x) + u64::from(y) + u64::from(carry);
    let sum = wide as u32;
    let overflow = (x ^ sum) & (y ^ sum) & 1 << 31 != 0;
    (sum, wide >> 32 != 0, overflow)
}

/// Shift_C of the manual, for any amount (section A2.2.1); the result and the carry.
#[inline]
pub(crate) fn shift_c(value: u32, shift: Shift, amount: u32, carry: bool) -> (u32, bool) {
    if amount == 0 {
        return (value, carry);
    }
    match shift {
        Shift::Lsl => match amount {
            1..=31 => (value << amount, value >> (32 - amount) & 1 != 0),
            32 => (0, value & 1 != 0),
            _ => (0, false),
        },
        Shift::Lsr => match amount {
            1..=31 => (value >> amount, value >> (amount - 1) & 1 != 0),
            32 => (0, value >> 31 != 0),
            _ => (0, false),
        },
        Shift::Asr => match amount {
            1..=31 => (
                (value as i32 >> amount) as u32,
                value >> (amount - 1) & 1 != 0,
            ),
            _ => ((value as i32 >> 31) as u32, value >> 31 != 0),
        },
        Shift::Ror => {
            let result = value.rotate_right(amount & 31);
            (result, result >> 31 != 0)
        }
        Shift::Rrx => (u32::from(carry) << 31 | value >> 1, value & 1 != 0),
    }
}

/// SignedSatQ and UnsignedSatQ of the manual: the value, and whether it was out of range.
fn saturate(value: i64, lowest: i64, highest: i64) -> (u32, bool) {
    let clamped = value.clamp(lowest, highest);
    (clamped as u32, clamped != value)
}

impl Cpu {
    #[inline]
    pub(super) fn sets(&self, flags: Flags) -> bool {
        match flags {
            Flags::Keep => false,
            Flags::Set => true,
            Flags::SetOutsideIt => self.it == 0,
        }
    }

    #[inline]
    pub(super) fn set_nz(&mut self, result: u32) {
        self.n = result >> 31 != 0;
        self.z = result == 0;
    }

    /// One operation; `y` and its carry come from a constant or the shifter. The result, where there is one.
    #[inline]
    pub(super) fn operate(
        &mut self,
        op: Operation,
        flags: Flags,
        x: u32,
        y: u32,
        carry: bool,
    ) -> Option<u32> {
        let sets = self.sets(flags);
        let logical = |value| (value, carry, self.v);
        let (result, carry, overflow) = match op {
            Operation::And | Operation::Tst => logical(x & y),
            Operation::Bic => logical(x & !y),
            Operation::Orr => logical(x | y),
            Operation::Orn => logical(x | !y),
            Operation::Eor | Operation::Teq => logical(x ^ y),
            Operation::Mov => logical(y),
            Operation::Mvn => logical(!y),
            Operation::Add | Operation::Cmn => add_with_carry(x, y, false),
            Operation::Adc => add_with_carry(x, y, self.c),
            Operation::Sub | Operation::Cmp => add_with_carry(x, !y, true),
            Operation::Sbc => add_with_carry(x, !y, self.c),
            Operation::Rsb => add_with_carry(!x, y, true),
        };
        if sets {
            self.set_nz(result);
            self.c = carry;
            self.v = overflow;
        }
        let only_flags = matches!(
            op,
            Operation::Tst | Operation::Teq | Operation::Cmp | Operation::Cmn
        );
        (!only_flags).then_some(result)
    }

    pub(super) fn shift_by(&mut self, shift: Shift, flags: Flags, rd: u8, rn: u8, rm: u8) {
        let amount = self.r[usize::from(rm)] & 0xff;
        let (result, carry) = shift_c(self.r[usize::from(rn)], shift, amount, self.c);
        if self.sets(flags) {
            self.set_nz(result);
            self.c = carry;
        }
        self.r[usize::from(rd)] = result;
    }

    pub(super) fn extend(&mut self, extension: Extension, rd: u8, rn: u8, rm: u8, rotation: u8) {
        let rotated = self.r[usize::from(rm)].rotate_right(rotation.into());
        let base = match usize::from(rn) {
            PC => 0,
            rn => self.r[rn],
        };
        let halves = |low: u32, high: u32| {
            let low = (base as u16).wrapping_add(low as u16);
            let high = ((base >> 16) as u16).wrapping_add(high as u16);
            u32::from(high) << 16 | u32::from(low)
        };
        self.r[usize::from(rd)] = match extension {
            Extension::Sxth => base.wrapping_add(rotated as i16 as u32),
            Extension::Uxth => base.wrapping_add(rotated & 0xffff),
            Extension::Sxtb => base.wrapping_add(rotated as i8 as u32),
            Extension::Uxtb => base.wrapping_add(rotated & 0xff),
            Extension::Sxtb16 => halves(rotated as i8 as u32, (rotated >> 16) as i8 as u32),
            Extension::Uxtb16 => halves(rotated & 0xff, rotated >> 16 & 0xff),
        };
    }

    pub(super) fn bits(&mut self, op: Bits, rd: u8, rm: u8) {
        let value = self.r[usize::from(rm)];
        self.r[usize::from(rd)] = match op {
            Bits::Rev => value.swap_bytes(),
            Bits::Rev16 => value.swap_bytes().rotate_right(16),
            Bits::Rbit => value.reverse_bits(),
            Bits::Revsh => (value as u16).swap_bytes() as i16 as u32,
            Bits::Clz => value.leading_zeros(),
        };
    }

    pub(super) fn insert(&mut self, rd: u8, rn: u8, lsb: u8, width: u8) {
        let mask = (u32::MAX >> (32 - width)) << lsb;
        let bits = match usize::from(rn) {
            PC => 0,
            rn => self.r[rn] << lsb,
        };
        let slot = &mut self.r[usize::from(rd)];
        *slot = *slot & !mask | bits & mask;
    }

    pub(super) fn extract(&mut self, signed: bool, rd: u8, rn: u8, lsb: u8, width: u8) {
        let left = self.r[usize::from(rn)] << (32 - width - lsb);
        self.r[usize::from(rd)] = match signed {
            true => (left as i32 >> (32 - width)) as u32,
            false => left >> (32 - width),
        };
    }

    /// SSAT and USAT: to so many bits.
    pub(super) fn saturate_to(&mut self, signed: bool, rd: u8, value: u32, bits: u8) {
        let value = i64::from(value as i32);
        let (result, is_out) = match signed {
            true => saturate(value, -(1 << (bits - 1)), (1 << (bits - 1)) - 1),
            false => saturate(value, 0, (1 << bits) - 1),
        };
        self.q |= is_out;
        self.r[usize::from(rd)] = result;
    }

    pub(super) fn add_saturating(&mut self, op: Saturating, rd: u8, rn: u8, rm: u8) {
        let of = |register: u8| i64::from(self.r[usize::from(register)] as i32);
        let (n, m) = (of(rn), of(rm));
        let clamp = |value| saturate(value, i32::MIN.into(), i32::MAX.into());
        let (doubled, doubled_is_out) = clamp(2 * n);
        let doubled = i64::from(doubled as i32);
        let (value, before) = match op {
            Saturating::Qadd => (m + n, false),
            Saturating::Qsub => (m - n, false),
            Saturating::Qdadd => (m + doubled, doubled_is_out),
            Saturating::Qdsub => (m - doubled, doubled_is_out),
        };
        let (result, is_out) = clamp(value);
        self.q |= is_out || before;
        self.r[usize::from(rd)] = result;
    }
}
