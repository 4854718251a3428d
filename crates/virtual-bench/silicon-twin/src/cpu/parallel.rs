//! Arithmetic in the lanes of a register (ARMv7-M manual, section A7.7).

use super::Cpu;
use super::instruction::{LaneResult, Lanes};

/// One lane of `bits` bits.
fn lane(value: u32, index: u32, bits: u32, signed: bool) -> i32 {
    let left = value << (32 - bits - bits * index);
    match signed {
        true => left as i32 >> (32 - bits),
        false => (left >> (32 - bits)) as i32,
    }
}

/// The range of a lane.
fn range(bits: u32, signed: bool) -> (i32, i32) {
    match signed {
        true => (-(1 << (bits - 1)), (1 << (bits - 1)) - 1),
        false => (0, (1 << bits) - 1),
    }
}

impl Cpu {
    pub(super) fn parallel(
        &mut self,
        lanes: Lanes,
        result: LaneResult,
        signed: bool,
        [rd, rn, rm]: [u8; 3],
    ) {
        let (n, mut m) = (self.r[usize::from(rn)], self.r[usize::from(rm)]);
        let bits = match lanes {
            Lanes::Add8 | Lanes::Sub8 => 8,
            _ => 16,
        };
        if matches!(lanes, Lanes::Asx | Lanes::Sax) {
            m = m.rotate_right(16);
        }
        let (lowest, highest) = range(bits, signed);
        let mut word = 0;
        let mut ge = 0;
        for index in 0..32 / bits {
            let subtracts = match lanes {
                Lanes::Add8 | Lanes::Add16 => false,
                Lanes::Sub8 | Lanes::Sub16 => true,
                Lanes::Asx => index == 0,
                Lanes::Sax => index == 1,
            };
            let (x, y) = (lane(n, index, bits, signed), lane(m, index, bits, signed));
            let exact = if subtracts { x - y } else { x + y };
            // A signed result, or an unsigned difference, that is not negative; an unsigned sum that carries.
            let is_ge = match signed || subtracts {
                true => exact >= 0,
                false => exact > highest,
            };
            let bytes = bits / 8;
            let marks = (1 << bytes) - 1;
            ge |= (u8::from(is_ge) * marks) << (bytes * index);
            let value = match result {
                LaneResult::Wrap => exact,
                LaneResult::Saturate => exact.clamp(lowest, highest),
                LaneResult::Halve => exact >> 1,
            };
            let mask = u32::MAX >> (32 - bits);
            word |= (value as u32 & mask) << (bits * index);
        }
        self.r[usize::from(rd)] = word;
        if result == LaneResult::Wrap {
            self.ge = ge;
        }
    }

    pub(super) fn select(&mut self, rd: u8, rn: u8, rm: u8) {
        let mask = (0..4).fold(0, |mask, byte| {
            mask | (u32::from(self.ge >> byte & 1) * 0xff) << (8 * byte)
        });
        let (n, m) = (self.r[usize::from(rn)], self.r[usize::from(rm)]);
        self.r[usize::from(rd)] = n & mask | m & !mask;
    }
}
