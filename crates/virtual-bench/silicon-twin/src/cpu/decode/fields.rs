//! The fields of an encoding.

use super::super::instruction::{Instruction, Shift};

/// The program counter, among the registers.
pub(super) const PC: u8 = 15;

/// Bits `low` to `low + count - 1`.
pub(super) fn field(word: u32, low: u32, count: u32) -> u32 {
    word >> low & ((1 << count) - 1)
}

/// A register's number in four bits.
pub(super) fn register(word: u32, low: u32) -> u8 {
    field(word, low, 4) as u8
}

pub(super) fn bit(word: u32, at: u32) -> bool {
    word >> at & 1 != 0
}

/// A number of so many bits in two's complement.
pub(super) fn signed(value: u32, bits: u32) -> i32 {
    let unused = 32 - bits;
    (value << unused) as i32 >> unused
}

/// DecodeImmShift of the manual (section A7.4.2).
pub(super) fn immediate_shift(kind: u32, amount: u32) -> (Shift, u8) {
    let or_32 = if amount == 0 { 32 } else { amount as u8 };
    match kind {
        0 => (Shift::Lsl, amount as u8),
        1 => (Shift::Lsr, or_32),
        2 => (Shift::Asr, or_32),
        _ if amount == 0 => (Shift::Rrx, 1),
        _ => (Shift::Ror, amount as u8),
    }
}

/// An offset that is added or subtracted.
pub(super) fn offset(up: bool, magnitude: u32) -> i32 {
    let magnitude = magnitude as i32;
    if up { magnitude } else { -magnitude }
}

/// What is no instruction here.
pub(super) const UNKNOWN: Instruction = Instruction::Unknown;
