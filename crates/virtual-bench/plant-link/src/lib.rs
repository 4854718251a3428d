//! One control tick between the emulated board and the plant behind it, in bytes.
//!
//! The board sends the compare values of its PWM timer and receives what its converters read during
//! that tick: only what crosses the pins of a real board, so that conversion, quantisation and noise
//! are exercised by the firmware's own code.
#![no_std]

use core::ffi::CStr;

/// FIFO, in the emulator's working directory, on which the board sends [`Pins`].
pub const TO_PLANT: &CStr = c"to-plant";
/// FIFO, in the emulator's working directory, on which the plant answers with [`Converters`].
pub const FROM_PLANT: &CStr = c"from-plant";

/// File, in the emulator's working directory, that is the board's flash for the fault log and calibrations.
pub const FLASH: &CStr = c"flash";
/// Its length.
pub const FLASH_BYTES: usize = 48 * 1024;
/// A file, in the emulator's working directory, whose presence says that the flash is worn out: it takes nothing more.
pub const FLASH_IS_WORN: &CStr = c"flash-is-worn";
/// What erased flash reads as.
pub const FLASH_ERASED: u8 = 0xff;

/// What a position sensor that has no reading stands at.
pub const NO_READING: i32 = i32::MIN;

/// What the board drives during one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pins {
    /// The tick, counted by the board.
    pub tick: u32,
    /// PWM compare values.
    pub compare: [u16; 4],
    /// Whether the timer drives its outputs at all; where not, they are held low.
    pub outputs_enabled: bool,
    /// Whether the load switch gives the output stages their supply.
    pub stages_supplied: bool,
    /// What the trigger pins tell: bit 0 a frame that begins, bit 1 a line.
    pub trigger: u8,
    /// Whether the board drives nothing, wants nothing and is asked for nothing: it may be left alone for a while.
    pub is_idle: bool,
}

/// What the board's converters read during that tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Converters {
    /// The tick of the [`Pins`] that they answer: what answers others is not meant for who asks.
    pub tick: u32,
    /// Ticks before this one that did not take place.
    pub missed_ticks: u16,
    /// Ticks before this one in which an idle board was left alone: they took place, and read what the last one read.
    pub quiet_ticks: u16,
    /// Current-sense codes.
    pub current: [u16; 4],
    /// Position sensor on the sensor input, in nanometres; [`NO_READING`] where it read nothing.
    pub sensor_z_nm: i32,
    /// Code of the output stages' supply.
    pub supply: u16,
    /// Whether the comparators have disabled the outputs since the board enabled them last.
    pub is_over_voltage: bool,
    /// What happens to the processor itself in this tick ([`upset`]).
    pub upset: u8,
}

/// What a disturbance can do to a processor, for tests of what the board does then.
pub mod upset {
    /// Nothing.
    pub const NONE: u8 = 0;
    /// The firmware finds a defect in itself.
    pub const PANIC: u8 = 1;
    /// It jumps where nothing is.
    pub const HARD_FAULT: u8 = 2;
    /// It stays where it is.
    pub const HANG: u8 = 3;
    /// It is reset.
    pub const RESET: u8 = 4;
}

impl Pins {
    /// Length on the link.
    pub const BYTES: usize = 16;

    /// As bytes, little-endian.
    pub fn to_bytes(self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        bytes[..4].copy_from_slice(&self.tick.to_le_bytes());
        put_quad(&mut bytes[4..12], self.compare);
        bytes[12] = self.outputs_enabled.into();
        bytes[13] = self.is_idle.into();
        bytes[14] = self.stages_supplied.into();
        bytes[15] = self.trigger;
        bytes
    }

    /// From bytes.
    pub fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        Self {
            tick: word(&bytes[..4]),
            compare: quad(&bytes[4..]),
            outputs_enabled: bytes[12] != 0,
            is_idle: bytes[13] != 0,
            stages_supplied: bytes[14] != 0,
            trigger: bytes[15],
        }
    }
}

impl Converters {
    /// Length on the link.
    pub const BYTES: usize = 24;

    /// As bytes, little-endian.
    pub fn to_bytes(self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        bytes[..4].copy_from_slice(&self.tick.to_le_bytes());
        bytes[4..8].copy_from_slice(&self.sensor_z_nm.to_le_bytes());
        put_quad(&mut bytes[8..16], self.current);
        bytes[16..18].copy_from_slice(&self.supply.to_le_bytes());
        bytes[18] = self.upset;
        bytes[19..21].copy_from_slice(&self.missed_ticks.to_le_bytes());
        bytes[21..23].copy_from_slice(&self.quiet_ticks.to_le_bytes());
        bytes[23] = self.is_over_voltage.into();
        bytes
    }

    /// What the position sensor read (um), if it did.
    pub fn sensor_z(&self) -> Option<f32> {
        (self.sensor_z_nm != NO_READING).then_some(self.sensor_z_nm as f32 * 1e-3)
    }

    /// From bytes.
    pub fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        Self {
            tick: word(&bytes[..4]),
            sensor_z_nm: word(&bytes[4..8]) as i32,
            current: quad(&bytes[8..]),
            supply: u16::from_le_bytes([bytes[16], bytes[17]]),
            upset: bytes[18],
            missed_ticks: u16::from_le_bytes([bytes[19], bytes[20]]),
            quiet_ticks: u16::from_le_bytes([bytes[21], bytes[22]]),
            is_over_voltage: bytes[23] != 0,
        }
    }
}

fn word(bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .rev()
        .fold(0, |word, byte| word << 8 | u32::from(*byte))
}

fn quad(bytes: &[u8]) -> [u16; 4] {
    core::array::from_fn(|i| u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]))
}

fn put_quad(bytes: &mut [u8], quad: [u16; 4]) {
    for (slot, value) in bytes.chunks_exact_mut(2).zip(quad) {
        slot.copy_from_slice(&value.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_tick_comes_back_whole(outputs_enabled: bool, stages_supplied: bool, is_over_voltage: bool, is_idle: bool, quiet_ticks: u16, tick: u32, quad: [u16; 4], sensor_z_nm: i32, supply: u16, upset: u8, missed_ticks: u16) {
            let pins = Pins { tick, compare: quad, outputs_enabled, stages_supplied, trigger: upset, is_idle };
            prop_assert_eq!(Pins::from_bytes(&pins.to_bytes()), pins);
            let converters = Converters { tick, current: quad, sensor_z_nm, supply, is_over_voltage, upset, missed_ticks, quiet_ticks };
            prop_assert_eq!(Converters::from_bytes(&converters.to_bytes()), converters);
        }
    }
}
