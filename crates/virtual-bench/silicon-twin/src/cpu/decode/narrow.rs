//! The 16-bit encodings (ARMv7-M manual, section A5.2).

use super::super::instruction::{
    Access, Bits, Extension, Flags, Hint, Index, Instruction, Operation, Product, Shift,
};
use super::fields::{PC, UNKNOWN, bit, field, immediate_shift, register, signed};

const SP: u8 = 13;

pub(super) fn decode(word: u32) -> Instruction {
    match field(word, 12, 4) {
        0 | 1 => shift_or_add(word),
        2 | 3 => with_byte(word),
        4 => match field(word, 10, 2) {
            0 => data_processing(word),
            1 => high_registers(word),
            _ => at(Access::LoadWord, low(word, 8), PC, 4 * field(word, 0, 8)),
        },
        5 => register_offset(word),
        6..=8 => small_offset(word),
        9 => {
            let access = [Access::StoreWord, Access::LoadWord][field(word, 11, 1) as usize];
            at(access, low(word, 8), SP, 4 * field(word, 0, 8))
        }
        0xa => address(word),
        0xb => miscellaneous(word),
        0xc => multiple(word),
        0xd => conditional(word),
        _ => Instruction::Branch {
            offset: signed(field(word, 0, 11) << 1, 12),
        },
    }
}

/// One of the lower eight registers.
fn low(word: u32, at: u32) -> u8 {
    field(word, at, 3) as u8
}

fn at(access: Access, rt: u8, rn: u8, offset: u32) -> Instruction {
    Instruction::Memory {
        access,
        index: Index::Offset,
        rt,
        rn,
        offset: offset as i32,
    }
}

fn shift_or_add(word: u32) -> Instruction {
    let (rd, rn) = (low(word, 0), low(word, 3));
    let flags = Flags::SetOutsideIt;
    let kind = field(word, 11, 2);
    if kind < 3 {
        let (shift, amount) = immediate_shift(kind, field(word, 6, 5));
        return Instruction::Shifted {
            op: Operation::Mov,
            flags,
            rd,
            rn: 0,
            rm: rn,
            shift,
            amount,
        };
    }
    let op = [Operation::Add, Operation::Sub][field(word, 9, 1) as usize];
    match bit(word, 10) {
        false => plain(op, flags, rd, rn, low(word, 6)),
        true => immediate(op, flags, rd, rn, field(word, 6, 3)),
    }
}

fn with_byte(word: u32) -> Instruction {
    let op = [
        Operation::Mov,
        Operation::Cmp,
        Operation::Add,
        Operation::Sub,
    ][field(word, 11, 2) as usize];
    let flags = match op {
        Operation::Cmp => Flags::Set,
        _ => Flags::SetOutsideIt,
    };
    let rd = low(word, 8);
    immediate(op, flags, rd, rd, field(word, 0, 8))
}

fn immediate(op: Operation, flags: Flags, rd: u8, rn: u8, imm: u32) -> Instruction {
    Instruction::Immediate {
        op,
        flags,
        rd,
        rn,
        carry: None,
        imm,
    }
}

fn plain(op: Operation, flags: Flags, rd: u8, rn: u8, rm: u8) -> Instruction {
    Instruction::Shifted {
        op,
        flags,
        rd,
        rn,
        rm,
        shift: Shift::Lsl,
        amount: 0,
    }
}

fn data_processing(word: u32) -> Instruction {
    let (rd, rm) = (low(word, 0), low(word, 3));
    let flags = Flags::SetOutsideIt;
    let by = |shift| Instruction::ShiftBy {
        shift,
        flags,
        rd,
        rn: rd,
        rm,
    };
    let op = match field(word, 6, 4) {
        0x0 => Operation::And,
        0x1 => Operation::Eor,
        0x2 => return by(Shift::Lsl),
        0x3 => return by(Shift::Lsr),
        0x4 => return by(Shift::Asr),
        0x5 => Operation::Adc,
        0x6 => Operation::Sbc,
        0x7 => return by(Shift::Ror),
        0x8 => return plain(Operation::Tst, Flags::Set, rd, rd, rm),
        0x9 => return immediate(Operation::Rsb, flags, rd, rm, 0),
        0xa => return plain(Operation::Cmp, Flags::Set, rd, rd, rm),
        0xb => return plain(Operation::Cmn, Flags::Set, rd, rd, rm),
        0xc => Operation::Orr,
        0xd => {
            return Instruction::Multiply {
                product: Product::Mul,
                flags,
                rd,
                rn: rm,
                rm: rd,
                ra: PC,
            };
        }
        0xe => Operation::Bic,
        _ => Operation::Mvn,
    };
    plain(op, flags, rd, rd, rm)
}

fn high_registers(word: u32) -> Instruction {
    let rm = register(word, 3);
    let rd = low(word, 0) | (field(word, 7, 1) as u8) << 3;
    match field(word, 8, 2) {
        0 => plain(Operation::Add, Flags::Keep, rd, rd, rm),
        1 => plain(Operation::Cmp, Flags::Set, rd, rd, rm),
        2 => plain(Operation::Mov, Flags::Keep, rd, 0, rm),
        _ => Instruction::BranchExchange {
            link: bit(word, 7),
            rm,
        },
    }
}

fn register_offset(word: u32) -> Instruction {
    let access = [
        Access::StoreWord,
        Access::StoreHalf,
        Access::StoreByte,
        Access::LoadSignedByte,
        Access::LoadWord,
        Access::LoadHalf,
        Access::LoadByte,
        Access::LoadSignedHalf,
    ][field(word, 9, 3) as usize];
    Instruction::MemoryRegister {
        access,
        rt: low(word, 0),
        rn: low(word, 3),
        rm: low(word, 6),
        amount: 0,
    }
}

fn small_offset(word: u32) -> Instruction {
    let offset = field(word, 6, 5);
    let (access, bytes) = match field(word, 11, 3) {
        0b100 => (Access::StoreWord, 4),
        0b101 => (Access::LoadWord, 4),
        0b110 => (Access::StoreByte, 1),
        0b111 => (Access::LoadByte, 1),
        0b000 => (Access::StoreHalf, 2),
        _ => (Access::LoadHalf, 2),
    };
    at(access, low(word, 0), low(word, 3), bytes * offset)
}

fn address(word: u32) -> Instruction {
    let (rd, offset) = (low(word, 8), 4 * field(word, 0, 8));
    match bit(word, 11) {
        false => Instruction::Adr {
            rd,
            offset: offset as i32,
        },
        true => immediate(Operation::Add, Flags::Keep, rd, SP, offset),
    }
}

fn miscellaneous(word: u32) -> Instruction {
    if word & 0x0500 == 0x0100 {
        return Instruction::CompareBranch {
            nonzero: bit(word, 11),
            rn: low(word, 0),
            offset: (field(word, 9, 1) << 6 | field(word, 3, 5) << 1) as u8,
        };
    }
    let (rd, rm) = (low(word, 0), low(word, 3));
    match field(word, 8, 4) {
        0x0 => {
            let op = [Operation::Add, Operation::Sub][field(word, 7, 1) as usize];
            immediate(op, Flags::Keep, SP, SP, 4 * field(word, 0, 7))
        }
        0x2 => Instruction::Extend {
            extension: [
                Extension::Sxth,
                Extension::Sxtb,
                Extension::Uxth,
                Extension::Uxtb,
            ][field(word, 6, 2) as usize],
            rd,
            rn: PC,
            rm,
            rotation: 0,
        },
        0x4 | 0x5 => stack(false, field(word, 0, 8) | field(word, 8, 1) << 14),
        0x6 if field(word, 5, 3) == 0b011 => Instruction::ChangeState {
            disable: bit(word, 4),
            primask: bit(word, 1),
            faultmask: bit(word, 0),
        },
        0xa => {
            let op = match field(word, 6, 2) {
                0 => Bits::Rev,
                1 => Bits::Rev16,
                3 => Bits::Revsh,
                _ => return UNKNOWN,
            };
            Instruction::Bits { op, rd, rm }
        }
        0xc | 0xd => stack(true, field(word, 0, 8) | field(word, 8, 1) << 15),
        0xe => Instruction::Breakpoint,
        0xf if field(word, 0, 4) != 0 => Instruction::IfThen { state: word as u8 },
        0xf => hint(field(word, 4, 4)),
        _ => UNKNOWN,
    }
}

fn stack(load: bool, registers: u32) -> Instruction {
    Instruction::Multiple {
        load,
        decrement: !load,
        writeback: true,
        rn: SP,
        registers: registers as u16,
    }
}

/// NOP, YIELD, WFE, WFI, SEV (section A5.2.5).
pub(super) fn hint(number: u32) -> Instruction {
    match number {
        2 => Instruction::Hint(Hint::Wfe),
        3 => Instruction::Hint(Hint::Wfi),
        4 => Instruction::Hint(Hint::Sev),
        _ => Instruction::Hint(Hint::Nop),
    }
}

fn multiple(word: u32) -> Instruction {
    let (load, rn) = (bit(word, 11), low(word, 8));
    let registers = field(word, 0, 8) as u16;
    Instruction::Multiple {
        load,
        decrement: false,
        writeback: !load || registers >> rn & 1 == 0,
        rn,
        registers,
    }
}

fn conditional(word: u32) -> Instruction {
    match field(word, 8, 4) {
        0xe => Instruction::Undefined,
        0xf => Instruction::SupervisorCall,
        condition => Instruction::BranchIf {
            condition: condition as u8,
            offset: signed(field(word, 0, 8) << 1, 9),
        },
    }
}
