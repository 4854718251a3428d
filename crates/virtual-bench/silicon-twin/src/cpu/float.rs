//! The floating-point unit: single precision, rounding to nearest, denormals kept (the state after reset, FPSCR 0).
//!
//! The cumulative exception flags of FPSCR are not kept: a program that reads them is told that the model lacks them.

use super::instruction::{Conversion, FloatOperation, FloatUnary};
use super::memory::aligned;
use super::{Bus, Cpu, Executed, Fault, Halt, Trap};

/// FPSCR's fields that change how is computed: AHP, DN, FZ, RMode (section A2.5.3).
const MODES: u32 = 0b11111 << 22;
/// The number that stands for an invalid result (section A2.5.4).
const DEFAULT_NAN: u32 = 0x7fc0_0000;
const QUIET: u32 = 1 << 22;

/// What an operation gives where a NaN is involved: FPProcessNaNs of the manual.
fn with_nans(operands: &[f32], result: f32) -> f32 {
    if !result.is_nan() {
        return result;
    }
    let nans = || {
        operands
            .iter()
            .map(|operand| operand.to_bits())
            .filter(|bits| is_nan(*bits))
    };
    let signalling = nans().find(|bits| bits & QUIET == 0);
    f32::from_bits(
        signalling
            .or(nans().next())
            .map_or(DEFAULT_NAN, |bits| bits | QUIET),
    )
}

fn is_nan(bits: u32) -> bool {
    bits << 1 > 0xff00_0000
}

fn multiply(x: f32, y: f32) -> f32 {
    with_nans(&[x, y], x * y)
}

fn add(x: f32, y: f32) -> f32 {
    with_nans(&[x, y], x + y)
}

/// FPMulAdd: one rounding; the addend's NaN goes before those of the factors, unless zero times infinity comes with it.
fn fused(addend: f32, x: f32, y: f32) -> f32 {
    let is_quiet = addend.is_nan() && addend.to_bits() & QUIET != 0;
    let is_invalid = (x == 0.0 && y.is_infinite()) || (x.is_infinite() && y == 0.0);
    if is_quiet && is_invalid {
        return f32::from_bits(DEFAULT_NAN);
    }
    with_nans(&[addend, x, y], x.mul_add(y, addend))
}

/// FPNeg: the sign of anything, a NaN too.
fn negative(x: f32) -> f32 {
    f32::from_bits(x.to_bits() ^ 1 << 31)
}

fn binary(op: FloatOperation, d: f32, n: f32, m: f32) -> f32 {
    match op {
        FloatOperation::Mul => multiply(n, m),
        FloatOperation::Nmul => negative(multiply(n, m)),
        FloatOperation::Add => add(n, m),
        FloatOperation::Sub => with_nans(&[n, m], n - m),
        FloatOperation::Div => with_nans(&[n, m], n / m),
        FloatOperation::Mla => add(d, multiply(n, m)),
        FloatOperation::Mls => add(d, negative(multiply(n, m))),
        FloatOperation::Nmla => add(negative(d), negative(multiply(n, m))),
        FloatOperation::Nmls => add(negative(d), multiply(n, m)),
        FloatOperation::Fma => fused(d, n, m),
        FloatOperation::Fms => fused(d, negative(n), m),
        FloatOperation::Fnma => fused(negative(d), negative(n), m),
        FloatOperation::Fnms => fused(negative(d), n, m),
    }
}

/// Cycles of Cortex-M4's floating-point instructions (DDI 0439B, table 7-1).
fn cycles(op: FloatOperation) -> u32 {
    match op {
        FloatOperation::Mul | FloatOperation::Nmul => 1,
        FloatOperation::Add | FloatOperation::Sub => 1,
        FloatOperation::Div => 14,
        _ => 3,
    }
}

/// RoundTowardsZero or to the nearest even, saturated; a NaN gives 0 (FPToFixed of the manual).
fn to_integer(value: f64, to_zero: bool, lowest: f64, highest: f64) -> i64 {
    let rounded = match to_zero {
        true => value.trunc(),
        false => value.round_ties_even(),
    };
    match rounded.is_nan() {
        true => 0,
        false => rounded.clamp(lowest, highest) as i64,
    }
}

fn limits(signed: bool, bits: u8) -> (f64, f64) {
    let top = f64::from(bits - u8::from(signed)).exp2();
    (if signed { -top } else { 0.0 }, top - 1.0)
}

fn convert(conversion: Conversion, bits: u32) -> u32 {
    let value = f64::from(f32::from_bits(bits));
    match conversion {
        Conversion::FromInteger { signed: true } => (bits as i32 as f32).to_bits(),
        Conversion::FromInteger { signed: false } => (bits as f32).to_bits(),
        Conversion::ToInteger { signed, to_zero } => {
            let (lowest, highest) = limits(signed, 32);
            to_integer(value, to_zero, lowest, highest) as u32
        }
        Conversion::FromFixed {
            signed,
            bits: size,
            fraction,
        } => {
            let whole = match (signed, size) {
                (true, 16) => f64::from(bits as i16),
                (true, _) => f64::from(bits as i32),
                (false, 16) => f64::from(bits as u16),
                (false, _) => f64::from(bits),
            };
            ((whole * (-f64::from(fraction)).exp2()) as f32).to_bits()
        }
        Conversion::ToFixed {
            signed,
            bits: size,
            fraction,
        } => {
            let (lowest, highest) = limits(signed, size);
            to_integer(value * f64::from(fraction).exp2(), true, lowest, highest) as u32
        }
    }
}

impl Cpu {
    /// ExecuteFPCheck of the manual (section B1.5.7): the unit is enabled, what a handler preempted is kept, and the
    /// context counts as one with floating point.
    #[inline]
    pub(super) fn float_check(&mut self, bus: &mut impl Bus) -> Executed<()> {
        match self.is_float_ready {
            true => Ok(()),
            false => self.make_float_ready(bus),
        }
    }

    #[cold]
    fn make_float_ready(&mut self, bus: &mut impl Bus) -> Executed<()> {
        if !self.system.is_float_enabled() {
            return Err(Trap::Fault(Fault::no_coprocessor()));
        }
        self.keep_preempted_floats(bus)?;
        if self.control & 4 == 0 {
            self.control |= 4;
            self.fpscr = self.system.default_float_status();
        }
        self.is_float_ready = true;
        Ok(())
    }

    /// The deferred part of stacking an extended frame (section B1.5.7).
    fn keep_preempted_floats(&mut self, bus: &mut impl Bus) -> Executed<()> {
        if !self.system.are_floats_pending() {
            return Ok(());
        }
        let frame = self.system.float_frame();
        for i in 0..16 {
            self.store::<4>(bus, frame + 4 * i, self.s[i as usize])?;
        }
        self.store::<4>(bus, frame + 64, self.fpscr)?;
        self.system.set_floats_pending(false);
        Ok(())
    }

    fn single(&self, register: u8) -> f32 {
        f32::from_bits(self.s[usize::from(register)])
    }

    pub(super) fn float(&mut self, op: FloatOperation, d: u8, n: u8, m: u8) -> u32 {
        let result = binary(op, self.single(d), self.single(n), self.single(m));
        self.s[usize::from(d)] = result.to_bits();
        cycles(op)
    }

    pub(super) fn float_unary(&mut self, op: FloatUnary, d: u8, m: u8) -> u32 {
        let bits = self.s[usize::from(m)];
        let value = f32::from_bits(bits);
        let (result, cycles) = match op {
            FloatUnary::Mov => (bits, 1),
            FloatUnary::Abs => (bits & !(1 << 31), 1),
            FloatUnary::Neg => (bits ^ 1 << 31, 1),
            FloatUnary::Sqrt => (with_nans(&[value], value.sqrt()).to_bits(), 14),
        };
        self.s[usize::from(d)] = result;
        cycles
    }

    /// FPCompare of the manual, into FPSCR's condition flags.
    pub(super) fn float_compare(&mut self, d: u8, m: Option<u8>) {
        let (x, y) = (self.single(d), m.map_or(0.0, |m| self.single(m)));
        let nzcv = match x.partial_cmp(&y) {
            Some(std::cmp::Ordering::Equal) => 0b0110,
            Some(std::cmp::Ordering::Less) => 0b1000,
            Some(std::cmp::Ordering::Greater) => 0b0010,
            None => 0b0011,
        };
        self.fpscr = self.fpscr & 0x0fff_ffff | nzcv << 28;
    }

    pub(super) fn float_convert(&mut self, conversion: Conversion, d: u8, m: u8) {
        self.s[usize::from(d)] = convert(conversion, self.s[usize::from(m)]);
    }

    pub(super) fn float_access(
        &mut self,
        bus: &mut impl Bus,
        load: bool,
        words: u8,
        d: u8,
        address: u32,
    ) -> Executed {
        aligned(address)?;
        for i in 0..u32::from(words) {
            let (at, register) = (address.wrapping_add(4 * i), usize::from(d) + i as usize);
            match load {
                true => self.s[register] = self.load::<4>(bus, at)?,
                false => self.store::<4>(bus, at, self.s[register])?,
            }
        }
        Ok(1 + u32::from(words))
    }

    pub(super) fn float_access_multiple(
        &mut self,
        bus: &mut impl Bus,
        [load, decrement, writeback]: [bool; 3],
        words: u8,
        d: u8,
        rn: u8,
    ) -> Executed {
        let base = self.r[usize::from(rn)];
        let bytes = 4 * u32::from(words);
        let lowest = match decrement {
            true => base.wrapping_sub(bytes),
            false => base,
        };
        let cycles = self.float_access(bus, load, words, d, lowest)?;
        if writeback {
            self.r[usize::from(rn)] = match decrement {
                true => lowest,
                false => base.wrapping_add(bytes),
            };
        }
        Ok(cycles)
    }

    pub(super) fn float_status_read(&mut self, rt: u8) -> Executed {
        if rt != 15 {
            return Err(lacks("the cumulative flags of FPSCR, which this reads"));
        }
        self.set_nzcv(self.fpscr >> 28);
        Ok(1)
    }

    fn set_nzcv(&mut self, nzcv: u32) {
        self.n = nzcv & 8 != 0;
        self.z = nzcv & 4 != 0;
        self.c = nzcv & 2 != 0;
        self.v = nzcv & 1 != 0;
    }

    pub(super) fn float_status_write(&mut self, value: u32) -> Executed {
        if value & MODES != 0 {
            return Err(lacks("rounding modes, flush to zero and default NaN"));
        }
        self.fpscr = value;
        Ok(1)
    }
}

fn lacks(what: &str) -> Trap {
    Trap::Halt(Halt::NotModelled(what.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nan_is_quiet_the_first_one_and_without_a_sign_where_it_is_new() {
        let signalling = f32::from_bits(0x7f80_0001);
        let quiet = f32::from_bits(0xffc0_0002);
        assert_eq!(add(quiet, signalling).to_bits(), 0x7fc0_0001);
        assert_eq!(add(quiet, 1.0).to_bits(), 0xffc0_0002);
        assert_eq!(multiply(0.0, f32::INFINITY).to_bits(), DEFAULT_NAN);
    }

    #[test]
    fn conversions_saturate_and_round_as_they_say() {
        let to = |signed, to_zero, value: f32| {
            convert(Conversion::ToInteger { signed, to_zero }, value.to_bits())
        };
        assert_eq!(to(true, true, -2.9) as i32, -2);
        assert_eq!(to(true, false, 2.5), 2);
        assert_eq!(to(false, true, -1.0), 0);
        assert_eq!(to(false, true, 1e20), u32::MAX);
        assert_eq!(to(true, true, f32::NAN), 0);
        let half = Conversion::FromFixed {
            signed: true,
            bits: 16,
            fraction: 1,
        };
        assert_eq!(f32::from_bits(convert(half, 0xffff)), -0.5);
    }

    #[test]
    fn a_fused_product_is_rounded_once() {
        let x = 1.0 + f32::EPSILON;
        assert_eq!(
            binary(FloatOperation::Fms, x * x, x, x),
            -(f32::EPSILON * f32::EPSILON)
        );
        assert_eq!(binary(FloatOperation::Mls, x * x, x, x), 0.0);
    }
}
