//! The 32-bit encodings whose operands are all registers (ARMv7-M manual, sections A5.3.12 to A5.3.17).

use super::super::instruction::{
    Bits, Extension, Flags, Instruction, LaneResult, Lanes, LongProduct, Product, Saturating, Shift,
};
use super::fields::{PC, UNKNOWN, bit, field, register};

pub(super) fn data_register(first: u32, second: u32) -> Instruction {
    let (rn, rd, rm) = (register(first, 0), register(second, 8), register(second, 0));
    let (op1, op2) = (field(first, 4, 4), field(second, 4, 4));
    match (op1, op2) {
        (0..=7, 0) => Instruction::ShiftBy {
            shift: [Shift::Lsl, Shift::Lsr, Shift::Asr, Shift::Ror][op1 as usize >> 1],
            flags: if bit(first, 4) {
                Flags::Set
            } else {
                Flags::Keep
            },
            rd,
            rn,
            rm,
        },
        (0..=5, 8..) => Instruction::Extend {
            extension: [
                Extension::Sxth,
                Extension::Uxth,
                Extension::Sxtb16,
                Extension::Uxtb16,
                Extension::Sxtb,
                Extension::Uxtb,
            ][op1 as usize],
            rd,
            rn,
            rm,
            rotation: 8 * field(second, 4, 2) as u8,
        },
        (8, 8..=11) => Instruction::AddSaturating {
            op: [
                Saturating::Qadd,
                Saturating::Qdadd,
                Saturating::Qsub,
                Saturating::Qdsub,
            ][op2 as usize - 8],
            rd,
            rn,
            rm,
        },
        (9, 8..=11) => Instruction::Bits {
            op: [Bits::Rev, Bits::Rev16, Bits::Rbit, Bits::Revsh][op2 as usize - 8],
            rd,
            rm,
        },
        (10, 8) => Instruction::Select { rd, rn, rm },
        (8.., 0..=7) => parallel(op1, op2, [rd, rn, rm]),
        (11, 8) => Instruction::Bits {
            op: Bits::Clz,
            rd,
            rm,
        },
        _ => UNKNOWN,
    }
}

fn parallel(op1: u32, op2: u32, [rd, rn, rm]: [u8; 3]) -> Instruction {
    let lanes = match op1 & 7 {
        0 => Lanes::Add8,
        1 => Lanes::Add16,
        2 => Lanes::Asx,
        4 => Lanes::Sub8,
        5 => Lanes::Sub16,
        6 => Lanes::Sax,
        _ => return UNKNOWN,
    };
    let result = match op2 & 3 {
        0 => LaneResult::Wrap,
        1 => LaneResult::Saturate,
        2 => LaneResult::Halve,
        _ => return UNKNOWN,
    };
    Instruction::Parallel {
        lanes,
        result,
        signed: op2 & 4 == 0,
        rd,
        rn,
        rm,
    }
}

pub(super) fn multiply(first: u32, second: u32) -> Instruction {
    let ra = register(second, 12);
    let adds = ra != PC;
    let (high, low) = (bit(second, 5), bit(second, 4));
    let product = match (field(first, 4, 3), field(second, 4, 2)) {
        (0, 0) if adds => Product::Mla,
        (0, 0) => Product::Mul,
        (0, 1) => Product::Mls,
        (1, _) if adds => Product::Smla {
            n_top: high,
            m_top: low,
        },
        (1, _) => Product::Smul {
            n_top: high,
            m_top: low,
        },
        (3, 0 | 1) if adds => Product::Smlaw { m_top: low },
        (3, 0 | 1) => Product::Smulw { m_top: low },
        (5, 0 | 1) if adds => Product::Smmla { round: low },
        (5, 0 | 1) => Product::Smmul { round: low },
        (6, 0 | 1) => Product::Smmls { round: low },
        _ => return UNKNOWN,
    };
    Instruction::Multiply {
        product,
        flags: Flags::Keep,
        rd: register(second, 8),
        rn: register(first, 0),
        rm: register(second, 0),
        ra,
    }
}

pub(super) fn multiply_long(first: u32, second: u32) -> Instruction {
    let (rn, rm) = (register(first, 0), register(second, 0));
    let (lo, hi) = (register(second, 12), register(second, 8));
    let divide = |signed| Instruction::Divide {
        signed,
        rd: hi,
        rn,
        rm,
    };
    let product = match (field(first, 4, 3), field(second, 4, 4)) {
        (0, 0) => LongProduct::Smull,
        (1, 15) => return divide(true),
        (2, 0) => LongProduct::Umull,
        (3, 15) => return divide(false),
        (4, 0) => LongProduct::Smlal,
        (6, 0) => LongProduct::Umlal,
        (6, 6) => LongProduct::Umaal,
        _ => return UNKNOWN,
    };
    Instruction::MultiplyLong {
        product,
        lo,
        hi,
        rn,
        rm,
    }
}
