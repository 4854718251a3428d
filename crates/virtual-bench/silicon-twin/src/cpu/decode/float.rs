//! The floating-point encodings (ARMv7-M manual, sections A6.4 to A6.7).

use super::super::instruction::{Conversion, FloatOperation, FloatUnary, Instruction};
use super::fields::{UNKNOWN, bit, field, offset, register};

/// Coprocessors 10 and 11 stand for the floating-point unit.
const UNIT: u32 = 0b101;

pub(super) fn decode(first: u32, second: u32) -> Instruction {
    if field(second, 9, 3) != UNIT || bit(first, 12) {
        return UNKNOWN;
    }
    match (field(first, 8, 2), bit(second, 4)) {
        (0b10, false) => data_processing(first, second),
        (0b10, true) => transfer(first, second),
        (0b11, _) => UNKNOWN,
        (0b00, _) if matches!(field(first, 4, 4), 4 | 5) => transfer_pair(first, second),
        _ => memory(first, second),
    }
}

/// A single-precision register: four bits and, below them, one that stands apart.
fn single(four: u32, one: u32) -> u8 {
    (four << 1 | one) as u8
}

/// A double-precision register, by the first of the two it consists of.
fn double(four: u32, one: u32) -> u8 {
    ((one << 4 | four) << 1) as u8
}

fn destination(first: u32, second: u32) -> u8 {
    single(field(second, 12, 4), field(first, 6, 1))
}

fn data_processing(first: u32, second: u32) -> Instruction {
    let is_double = bit(second, 8);
    if is_double {
        return UNKNOWN;
    }
    let d = destination(first, second);
    let n = single(field(first, 0, 4), field(second, 7, 1));
    let m = single(field(second, 0, 4), field(second, 5, 1));
    let op = match (field(first, 4, 4) & 0b1011, bit(second, 6)) {
        (0b0000, false) => FloatOperation::Mla,
        (0b0000, true) => FloatOperation::Mls,
        (0b0001, false) => FloatOperation::Nmls,
        (0b0001, true) => FloatOperation::Nmla,
        (0b0010, false) => FloatOperation::Mul,
        (0b0010, true) => FloatOperation::Nmul,
        (0b0011, false) => FloatOperation::Add,
        (0b0011, true) => FloatOperation::Sub,
        (0b1000, false) => FloatOperation::Div,
        (0b1001, false) => FloatOperation::Fnms,
        (0b1001, true) => FloatOperation::Fnma,
        (0b1010, false) => FloatOperation::Fma,
        (0b1010, true) => FloatOperation::Fms,
        (0b1011, false) => {
            return Instruction::FloatImmediate {
                d,
                bits: expand(field(first, 0, 4) << 4 | field(second, 0, 4)),
            };
        }
        (0b1011, true) => return other(first, second, d, m),
        _ => return UNKNOWN,
    };
    Instruction::Float { op, d, n, m }
}

/// VFPExpandImm of the manual: sign, three bits of exponent, four of fraction.
fn expand(imm8: u32) -> u32 {
    let exponent = if bit(imm8, 6) { 0x1f << 25 } else { 1 << 30 };
    field(imm8, 7, 1) << 31 | exponent | field(imm8, 0, 6) << 19
}

fn other(first: u32, second: u32, d: u8, m: u8) -> Instruction {
    let high = bit(second, 7);
    let convert = |conversion| Instruction::FloatConvert { conversion, d, m };
    let unary = |op| Instruction::FloatUnary { op, d, m };
    let kind = field(first, 0, 4);
    match kind {
        0b0000 => unary(if high {
            FloatUnary::Abs
        } else {
            FloatUnary::Mov
        }),
        0b0001 => unary(if high {
            FloatUnary::Sqrt
        } else {
            FloatUnary::Neg
        }),
        0b0100 => Instruction::FloatCompare { d, m: Some(m) },
        0b0101 => Instruction::FloatCompare { d, m: None },
        0b1000 => convert(Conversion::FromInteger { signed: high }),
        0b1100 | 0b1101 => convert(Conversion::ToInteger {
            signed: kind == 0b1101,
            to_zero: high,
        }),
        0b1010 | 0b1011 | 0b1110 | 0b1111 => {
            let bits = if high { 32 } else { 16 };
            let whole = (field(second, 0, 4) << 1 | field(second, 5, 1)) as u8;
            let Some(fraction) = u8::checked_sub(bits, whole) else {
                return UNKNOWN;
            };
            let signed = !bit(first, 0);
            Instruction::FloatConvert {
                conversion: match kind & 0b0100 {
                    0 => Conversion::FromFixed {
                        signed,
                        bits,
                        fraction,
                    },
                    _ => Conversion::ToFixed {
                        signed,
                        bits,
                        fraction,
                    },
                },
                d,
                m: d,
            }
        }
        _ => UNKNOWN,
    }
}

fn transfer(first: u32, second: u32) -> Instruction {
    let (to_core, rt) = (bit(first, 4), register(second, 12));
    let is_scalar = bit(second, 8);
    match (field(first, 5, 3), is_scalar) {
        (0b000, false) => Instruction::FloatMove {
            to_core,
            rt,
            n: single(field(first, 0, 4), field(second, 7, 1)),
        },
        (0b000 | 0b001, true) if field(second, 5, 2) == 0 => Instruction::FloatMove {
            to_core,
            rt,
            n: double(field(first, 0, 4), field(second, 7, 1)) | field(first, 5, 1) as u8,
        },
        (0b111, false) if field(first, 0, 4) == 1 => match to_core {
            true => Instruction::FloatStatusRead { rt },
            false => Instruction::FloatStatusWrite { rt },
        },
        _ => UNKNOWN,
    }
}

fn transfer_pair(first: u32, second: u32) -> Instruction {
    let m = match bit(second, 8) {
        true => double(field(second, 0, 4), field(second, 5, 1)),
        false => single(field(second, 0, 4), field(second, 5, 1)),
    };
    if m > 30 {
        return UNKNOWN;
    }
    Instruction::FloatMovePair {
        to_core: bit(first, 4),
        rt: register(second, 12),
        rt2: register(first, 0),
        m,
    }
}

fn memory(first: u32, second: u32) -> Instruction {
    let is_double = bit(second, 8);
    let d = match is_double {
        true => double(field(second, 12, 4), field(first, 6, 1)),
        false => destination(first, second),
    };
    let (load, rn) = (bit(first, 4), register(first, 0));
    let (up, imm8) = (bit(first, 7), field(second, 0, 8));
    let (before, writeback) = (bit(first, 8), bit(first, 5));
    let words = if is_double { 2 } else { 1 };
    if before && !writeback {
        return match d + words <= 32 {
            true => Instruction::FloatMemory {
                load,
                words,
                d,
                rn,
                offset: offset(up, 4 * imm8) as i16,
            },
            false => UNKNOWN,
        };
    }
    let decrement = before;
    if decrement == up || u32::from(d) + imm8 > 32 || imm8 == 0 || imm8 % u32::from(words) != 0 {
        return UNKNOWN;
    }
    Instruction::FloatMultiple {
        load,
        decrement,
        writeback,
        words: imm8 as u8,
        d,
        rn,
    }
}
