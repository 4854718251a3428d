//! The 32-bit encodings (ARMv7-M manual, section A5.3).

use super::super::instruction::{Access, Flags, Index, Instruction, Operation, Shift};
use super::fields::{PC, UNKNOWN, bit, field, immediate_shift, offset, register, signed};
use super::float;
use super::narrow::hint;
use super::registers::{data_register, multiply, multiply_long};

pub(super) fn decode(first: u32, second: u32) -> Instruction {
    if bit(first, 10) && field(first, 11, 2) != 0b10 {
        return float::decode(first, second);
    }
    match field(first, 11, 2) {
        0b01 => match (bit(first, 9), bit(first, 6)) {
            (false, false) => multiple(first, second),
            (false, true) => dual_or_exclusive(first, second),
            (true, _) => shifted_register(first, second),
        },
        0b10 => match (bit(second, 15), bit(first, 9)) {
            (false, false) => modified_immediate(first, second),
            (false, true) => plain_immediate(first, second),
            (true, _) => branch_or_control(first, second),
        },
        _ => match field(first, 7, 3) {
            0b000..=0b011 => single(first, second),
            0b100 | 0b101 => data_register(first, second),
            0b110 => multiply(first, second),
            _ => multiply_long(first, second),
        },
    }
}

fn multiple(first: u32, second: u32) -> Instruction {
    let decrement = match field(first, 7, 2) {
        0b01 => false,
        0b10 => true,
        _ => return UNKNOWN,
    };
    Instruction::Multiple {
        load: bit(first, 4),
        decrement,
        writeback: bit(first, 5),
        rn: register(first, 0),
        registers: second as u16,
    }
}

fn dual_or_exclusive(first: u32, second: u32) -> Instruction {
    let rn = register(first, 0);
    let (rt, rd) = (register(second, 12), register(second, 8));
    let load = bit(first, 4);
    let (before, writeback) = (bit(first, 8), bit(first, 5));
    if before || writeback {
        let index = match (before, writeback) {
            (true, false) => Index::Offset,
            (true, true) => Index::Before,
            _ => Index::After,
        };
        return Instruction::Dual {
            load,
            index,
            rt,
            rt2: rd,
            rn,
            offset: offset(bit(first, 7), 4 * field(second, 0, 8)),
        };
    }
    if !bit(first, 7) {
        let offset = 4 * field(second, 0, 8) as u16;
        return exclusive(load, 4, rd, rt, rn, offset);
    }
    match (load, field(second, 4, 4)) {
        (true, half @ (0 | 1)) => Instruction::TableBranch {
            half: half == 1,
            rn,
            rm: register(second, 0),
        },
        (_, 4) => exclusive(load, 1, register(second, 0), rt, rn, 0),
        (_, 5) => exclusive(load, 2, register(second, 0), rt, rn, 0),
        _ => UNKNOWN,
    }
}

fn exclusive(load: bool, bytes: u8, rd: u8, rt: u8, rn: u8, offset: u16) -> Instruction {
    match load {
        true => Instruction::LoadExclusive {
            bytes,
            rt,
            rn,
            offset,
        },
        false => Instruction::StoreExclusive {
            bytes,
            rd,
            rt,
            rn,
            offset,
        },
    }
}

/// The operation of section A5.3.1 or A5.3.11, with those that only set flags or take one operand.
fn operation(first: u32, rd: u8) -> Option<(Operation, Flags)> {
    let sets = bit(first, 4);
    let only_flags = sets && rd == PC;
    let one_operand = register(first, 0) == PC;
    let op = match field(first, 5, 4) {
        0x0 if only_flags => Operation::Tst,
        0x0 => Operation::And,
        0x1 => Operation::Bic,
        0x2 if one_operand => Operation::Mov,
        0x2 => Operation::Orr,
        0x3 if one_operand => Operation::Mvn,
        0x3 => Operation::Orn,
        0x4 if only_flags => Operation::Teq,
        0x4 => Operation::Eor,
        0x8 if only_flags => Operation::Cmn,
        0x8 => Operation::Add,
        0xa => Operation::Adc,
        0xb => Operation::Sbc,
        0xd if only_flags => Operation::Cmp,
        0xd => Operation::Sub,
        0xe => Operation::Rsb,
        _ => return None,
    };
    Some((op, if sets { Flags::Set } else { Flags::Keep }))
}

fn shifted_register(first: u32, second: u32) -> Instruction {
    let (rd, rn, rm) = (register(second, 8), register(first, 0), register(second, 0));
    let amount = field(second, 12, 3) << 2 | field(second, 6, 2);
    if field(first, 5, 4) == 0x6 {
        let (_, amount) = immediate_shift(2 * field(second, 5, 1), amount);
        return Instruction::Pack {
            top: bit(second, 5),
            rd,
            rn,
            rm,
            amount,
        };
    }
    let Some((op, flags)) = operation(first, rd) else {
        return UNKNOWN;
    };
    let (shift, amount) = immediate_shift(field(second, 4, 2), amount);
    Instruction::Shifted {
        op,
        flags,
        rd,
        rn,
        rm,
        shift,
        amount,
    }
}

/// ThumbExpandImm_C of the manual: the constant, and the carry that its rotation leaves.
fn expand(imm12: u32) -> (u32, Option<bool>) {
    let byte = field(imm12, 0, 8);
    if field(imm12, 10, 2) != 0 {
        let rotated = (0x80 | field(imm12, 0, 7)).rotate_right(field(imm12, 7, 5));
        return (rotated, Some(rotated >> 31 != 0));
    }
    let pattern = match field(imm12, 8, 2) {
        0 => 0x0000_0001,
        1 => 0x0001_0001,
        2 => 0x0100_0100,
        _ => 0x0101_0101,
    };
    (byte * pattern, None)
}

fn imm12(first: u32, second: u32) -> u32 {
    field(first, 10, 1) << 11 | field(second, 12, 3) << 8 | field(second, 0, 8)
}

fn modified_immediate(first: u32, second: u32) -> Instruction {
    let rd = register(second, 8);
    let Some((op, flags)) = operation(first, rd) else {
        return UNKNOWN;
    };
    let (imm, carry) = expand(imm12(first, second));
    Instruction::Immediate {
        op,
        flags,
        rd,
        rn: register(first, 0),
        carry,
        imm,
    }
}

fn plain_immediate(first: u32, second: u32) -> Instruction {
    let (rd, rn) = (register(second, 8), register(first, 0));
    let imm = imm12(first, second);
    let imm16 = field(first, 0, 4) << 12 | imm;
    let lsb = (field(second, 12, 3) << 2 | field(second, 6, 2)) as u8;
    let low5 = field(second, 0, 5) as u8;
    let plain = |op, imm| Instruction::Immediate {
        op,
        flags: Flags::Keep,
        rd,
        rn,
        carry: None,
        imm,
    };
    let saturate = |signed, bits| Instruction::Saturate {
        signed,
        rd,
        rn,
        bits,
        shift: if bit(first, 5) {
            Shift::Asr
        } else {
            Shift::Lsl
        },
        amount: lsb,
    };
    let extract = |signed| Instruction::BitFieldExtract {
        signed,
        rd,
        rn,
        lsb,
        width: low5 + 1,
    };
    let is_halves = bit(first, 5) && lsb == 0;
    match field(first, 4, 5) {
        0b00000 if rn == PC => Instruction::Adr {
            rd,
            offset: imm as i32,
        },
        0b00000 => plain(Operation::Add, imm),
        0b00100 => plain(Operation::Mov, imm16),
        0b01010 if rn == PC => Instruction::Adr {
            rd,
            offset: -(imm as i32),
        },
        0b01010 => plain(Operation::Sub, imm),
        0b01100 => Instruction::MoveTop {
            rd,
            imm: imm16 as u16,
        },
        0b10000 | 0b10010 if !is_halves => saturate(true, low5 + 1),
        0b11000 | 0b11010 if !is_halves => saturate(false, low5),
        0b10100 => extract(true),
        0b10110 if low5 >= lsb => Instruction::BitFieldInsert {
            rd,
            rn,
            lsb,
            width: low5 + 1 - lsb,
        },
        0b11100 => extract(false),
        _ => UNKNOWN,
    }
}

fn branch_or_control(first: u32, second: u32) -> Instruction {
    let sign = field(first, 10, 1);
    let (j1, j2) = (field(second, 13, 1), field(second, 11, 1));
    let low = field(second, 0, 11) << 1;
    if bit(second, 12) {
        let high =
            sign << 24 | (j1 ^ sign ^ 1) << 23 | (j2 ^ sign ^ 1) << 22 | field(first, 0, 10) << 12;
        let offset = signed(high | low, 25);
        return match bit(second, 14) {
            true => Instruction::BranchLink { offset },
            false => Instruction::Branch { offset },
        };
    }
    let condition = field(first, 6, 4);
    if condition < 0xe {
        let high = sign << 20 | j2 << 19 | j1 << 18 | field(first, 0, 6) << 12;
        return Instruction::BranchIf {
            condition: condition as u8,
            offset: signed(high | low, 21),
        };
    }
    match field(first, 4, 7) {
        0b0111000 | 0b0111001 => Instruction::WriteSpecial {
            rn: register(first, 0),
            special: second as u8,
        },
        0b0111010 if second & 0xff < 5 => hint(field(second, 0, 8)),
        0b0111011 => match field(second, 4, 4) {
            2 => Instruction::ClearExclusive,
            4..=6 => Instruction::Barrier,
            _ => UNKNOWN,
        },
        0b0111110 | 0b0111111 => Instruction::ReadSpecial {
            rd: register(second, 8),
            special: second as u8,
        },
        0b1111111 => Instruction::Undefined,
        _ => UNKNOWN,
    }
}

fn single(first: u32, second: u32) -> Instruction {
    let (rn, rt) = (register(first, 0), register(second, 12));
    let (is_signed, load) = (bit(first, 8), bit(first, 4));
    let access = match (load, is_signed, field(first, 5, 2)) {
        (true, false, 0) => Access::LoadByte,
        (true, false, 1) => Access::LoadHalf,
        (true, false, 2) => Access::LoadWord,
        (true, true, 0) => Access::LoadSignedByte,
        (true, true, 1) => Access::LoadSignedHalf,
        (false, false, 0) => Access::StoreByte,
        (false, false, 1) => Access::StoreHalf,
        (false, false, 2) => Access::StoreWord,
        _ => return UNKNOWN,
    };
    if rt == PC && load && access != Access::LoadWord {
        // PLD and PLI.
        return hint(0);
    }
    let memory = |index, offset| Instruction::Memory {
        access,
        index,
        rt,
        rn,
        offset,
    };
    let up = bit(first, 7);
    if rn == PC {
        return memory(Index::Offset, offset(up, field(second, 0, 12)));
    }
    if up {
        return memory(Index::Offset, field(second, 0, 12) as i32);
    }
    if bit(second, 11) {
        let offset = offset(bit(second, 9), field(second, 0, 8));
        return match (bit(second, 10), bit(second, 8)) {
            (true, false) => memory(Index::Offset, offset),
            (true, true) => memory(Index::Before, offset),
            (false, true) => memory(Index::After, offset),
            (false, false) => UNKNOWN,
        };
    }
    match field(second, 6, 5) {
        0 => Instruction::MemoryRegister {
            access,
            rt,
            rn,
            rm: register(second, 0),
            amount: field(second, 4, 2) as u8,
        },
        _ => UNKNOWN,
    }
}
