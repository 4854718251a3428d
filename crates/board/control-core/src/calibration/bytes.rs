//! A calibration as bytes: what is uploaded and stored.
//!
//! Little endian, without padding: the letters `EMCA`, the format (u16), device and date (48 bytes
//! each), the model's hash (u64), the numbers (f32) in the order of [`numbers`], [`levers`], [`surroundings`],
//! [`residual`], [`shared`] and [`resonance`], the beams' lag, the growth of the time constants, by how much each actuator is slower,
//! the cross-talk that heaters see, and the CRC-32 (as in Ethernet) of all that. Formats 3 to 11 are read too: 11 has no such cross-talk, in 10 no actuator is slower either, 9 has no time constants that grow either, 8 no lag of beams either, 7 no resonance either, 6 no heat that the actuators share either, 5 does not say what it leaves unknown either, 4 knows nothing of surroundings
//! either, 3 has no levers either.

use super::layout::{
    BYTES, FORMAT, MAGIC, WITHOUT_CROSSTALK, WITHOUT_LAG, WITHOUT_LEVERS, WITHOUT_RESIDUAL,
    WITHOUT_RESONANCE, WITHOUT_SHARED, WITHOUT_SLOWER, WITHOUT_SURROUNDINGS, WITHOUT_TIME_GROWTH,
    WITHOUT_TRIED, record_bytes,
};
use super::{ActuatorCalibration, Bounds, Heat, Memory, Parts, Path, Plate};
use super::{Calibration, CalibrationError, Field, Label, Origin, Problem};
use super::{Residual, Resonance, SensedRises};
use crate::CHANNELS;
use crate::shape::{InverseTable, KNOTS};
use crate::units::{
    Kelvin, KelvinPerWatt, Micrometre, Ohm, PerKelvin, Second, SecondPerKelvin, Volt, Watt,
};

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

impl Calibration {
    /// As bytes.
    pub fn to_bytes(&self) -> [u8; BYTES] {
        let mut bytes = [0; BYTES];
        let mut rest = bytes.as_mut_slice();
        let mut put = |part: &[u8]| {
            // The parts add up to `BYTES` for any calibration, as the test of the layout shows.
            if let Some((place, after)) =
                core::mem::take(&mut rest).split_at_mut_checked(part.len())
            {
                place.copy_from_slice(part);
                rest = after;
            }
        };
        let origin = &self.parts.origin;
        put(&MAGIC);
        put(&FORMAT.to_le_bytes());
        put(&origin.device.to_bytes());
        put(&origin.date.to_bytes());
        put(&origin.model_hash.to_le_bytes());
        let mut parts = self.parts;
        let mut tables = parts
            .actuators
            .map(|actuator| (actuator.shape.top(), *actuator.shape.knots()));
        numbers(&mut parts, &mut tables, &mut |number| {
            put(&number.to_le_bytes())
        });
        levers(&mut parts.plate, &mut |number| put(&number.to_le_bytes()));
        surroundings(&mut parts, &mut |number| put(&number.to_le_bytes()));
        residual(
            &mut parts.residual,
            &mut |number| put(&number.to_le_bytes()),
        );
        shared(&mut parts.heat, &mut |number| put(&number.to_le_bytes()));
        resonance(&mut parts.path.resonance, &mut |number| {
            put(&number.to_le_bytes())
        });
        put(&parts.heat.beam_lag.0.to_le_bytes());
        put(&parts.heat.time_growth.0.to_le_bytes());
        for actuator in &parts.actuators {
            put(&actuator.slower_by.0.to_le_bytes());
        }
        put(&parts.sensed_crosstalk.to_le_bytes());
        put(&parts.residual.tried.0.to_le_bytes());
        let end = BYTES - 4;
        let checksum = CRC.checksum(&bytes[..end]);
        bytes[end..].copy_from_slice(&checksum.to_le_bytes());
        bytes
    }

    /// From bytes, checked as [`Calibration::new`] checks.
    ///
    /// # Errors
    /// Says what is wrong with the bytes, or with which number.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, CalibrationError> {
        let mut reader = Reader(bytes);
        if reader.take() != Some(MAGIC) {
            return Err(CalibrationError::NotACalibration);
        }
        let length = CalibrationError::Length { bytes: bytes.len() };
        let format = u16::from_le_bytes(reader.take().ok_or(length)?);
        if !(WITHOUT_LEVERS..=FORMAT).contains(&format) {
            return Err(CalibrationError::Format { format });
        }
        if bytes.len() != record_bytes(bytes) {
            return Err(length);
        }
        let (content, checksum) = bytes.split_at(bytes.len() - 4);
        if CRC.checksum(content).to_le_bytes() != checksum {
            return Err(CalibrationError::Checksum);
        }
        let mut label = |field| {
            let bytes = reader.take().ok_or(length)?;
            Label::from_bytes(bytes).ok_or(CalibrationError::number(field, 0, Problem::NotText))
        };
        let mut parts = BLANK;
        parts.origin.device = label(Field::Device)?;
        parts.origin.date = label(Field::Date)?;
        parts.origin.model_hash = u64::from_le_bytes(reader.take().ok_or(length)?);
        let mut tables = [(Micrometre(0.0), [0.0; KNOTS]); CHANNELS];
        numbers(&mut parts, &mut tables, &mut |number| {
            // The length is known to be right.
            *number = f32::from_le_bytes(reader.take().unwrap_or_default());
        });
        if format > WITHOUT_LEVERS {
            levers(&mut parts.plate, &mut |number| {
                *number = f32::from_le_bytes(reader.take().unwrap_or_default());
            });
        }
        if format > WITHOUT_SURROUNDINGS {
            surroundings(&mut parts, &mut |number| {
                *number = f32::from_le_bytes(reader.take().unwrap_or_default());
            });
        }
        if format > WITHOUT_RESIDUAL {
            residual(&mut parts.residual, &mut |number| {
                *number = f32::from_le_bytes(reader.take().unwrap_or_default());
            });
        }
        if format > WITHOUT_SHARED {
            shared(&mut parts.heat, &mut |number| {
                *number = f32::from_le_bytes(reader.take().unwrap_or_default());
            });
        }
        if format > WITHOUT_RESONANCE {
            resonance(&mut parts.path.resonance, &mut |number| {
                *number = f32::from_le_bytes(reader.take().unwrap_or_default());
            });
        }
        if format > WITHOUT_LAG {
            parts.heat.beam_lag = Second(f32::from_le_bytes(reader.take().unwrap_or_default()));
        }
        if format > WITHOUT_TIME_GROWTH {
            let growth = f32::from_le_bytes(reader.take().unwrap_or_default());
            parts.heat.time_growth = SecondPerKelvin(growth);
        }
        if format > WITHOUT_SLOWER {
            for actuator in &mut parts.actuators {
                actuator.slower_by = Second(f32::from_le_bytes(reader.take().unwrap_or_default()));
            }
        }
        if format > WITHOUT_CROSSTALK {
            parts.sensed_crosstalk = f32::from_le_bytes(reader.take().unwrap_or_default());
        }
        let (top, _) = tables[0];
        parts.residual.tried = match format > WITHOUT_TRIED {
            true => Micrometre(f32::from_le_bytes(reader.take().unwrap_or_default())),
            false => parts.residual.tried_wholly_or_not(top),
        };
        for (actuator, (top, knots)) in tables.into_iter().enumerate() {
            parts.actuators[actuator].shape = InverseTable::new(top, knots)
                .map_err(|error| CalibrationError::from(error).of_actuator(actuator))?;
        }
        Self::new(parts)
    }
}

/// A place for every number.
const BLANK: Parts = Parts {
    origin: Origin {
        device: Label::EMPTY,
        date: Label::EMPTY,
        model_hash: 0,
    },
    actuators: [ActuatorCalibration {
        cold_resistance: Ohm(0.0),
        tcr: PerKelvin(0.0),
        thermal_resistance: KelvinPerWatt(0.0),
        loss_growth: PerKelvin(0.0),
        slower_by: Second(0.0),
        shape: InverseTable::STRAIGHT,
        sensed_rises: SensedRises::UNKNOWN,
    }; CHANNELS],
    heat: Heat::INSTANT,
    memory: Memory::NONE,
    plate: Plate::UNKNOWN,
    path: Path {
        move_time: Second(0.0),
        resonance: Resonance::UNKNOWN,
    },
    bounds: Bounds {
        drive: Volt(0.0),
        power: Watt(0.0),
        rise: Kelvin(0.0),
    },
    ambient_ratio: 0.0,
    sensed_crosstalk: 0.0,
    residual: Residual::UNKNOWN,
};

/// Every number of a calibration, in the order of its bytes.
fn numbers(
    parts: &mut Parts,
    tables: &mut [(Micrometre, [f32; KNOTS]); CHANNELS],
    visit: &mut dyn FnMut(&mut f32),
) {
    for (actuator, (top, knots)) in parts.actuators.iter_mut().zip(tables) {
        visit(&mut actuator.cold_resistance.0);
        visit(&mut actuator.tcr.0);
        visit(&mut actuator.thermal_resistance.0);
        visit(&mut actuator.loss_growth.0);
        visit(&mut top.0);
        knots.iter_mut().for_each(&mut *visit);
    }
    let heat = parts.heat.fast.iter_mut().chain(&mut parts.heat.slow);
    for lag in heat.chain(&mut parts.memory.creep) {
        visit(&mut lag.weight);
        visit(&mut lag.time.0);
    }
    for play in &mut parts.memory.plays {
        visit(&mut play.weight);
        visit(&mut play.radius.0);
    }
    visit(&mut parts.memory.release.0);
    visit(&mut parts.path.move_time.0);
    visit(&mut parts.bounds.drive.0);
    visit(&mut parts.bounds.power.0);
    visit(&mut parts.bounds.rise.0);
}

/// Every number of the levers, in the order of its bytes.
fn levers(plate: &mut Plate, visit: &mut dyn FnMut(&mut f32)) {
    for lever in &mut plate.levers {
        visit(&mut lever.x.0);
        visit(&mut lever.y.0);
        visit(&mut lever.warp);
    }
}

/// What tells the surroundings, in the order of its bytes.
fn surroundings(parts: &mut Parts, visit: &mut dyn FnMut(&mut f32)) {
    for actuator in &mut parts.actuators {
        visit(&mut actuator.sensed_rises.top.0);
        actuator.sensed_rises.knots.iter_mut().for_each(&mut *visit);
    }
    visit(&mut parts.ambient_ratio);
}

/// What is left unknown, in the order of its bytes.
fn residual(residual: &mut Residual, visit: &mut dyn FnMut(&mut f32)) {
    visit(&mut residual.piston.0);
    visit(&mut residual.part);
    visit(&mut residual.apart);
    visit(&mut residual.ambient_ratio);
}

/// What the actuators share of their heat, in the order of its bytes.
fn shared(heat: &mut Heat, visit: &mut dyn FnMut(&mut f32)) {
    heat.shared.iter_mut().for_each(visit);
}

/// The resonance, in the order of its bytes.
fn resonance(resonance: &mut Resonance, visit: &mut dyn FnMut(&mut f32)) {
    visit(&mut resonance.frequency.0);
    visit(&mut resonance.quality);
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*taken)
    }
}

#[cfg(test)]
mod tests {
    use super::super::POLES;
    use super::super::layout::{
        BYTES_WITHOUT_CROSSTALK, BYTES_WITHOUT_LAG, BYTES_WITHOUT_LEVERS, BYTES_WITHOUT_RESIDUAL,
        BYTES_WITHOUT_RESONANCE, BYTES_WITHOUT_SHARED, BYTES_WITHOUT_SLOWER,
        BYTES_WITHOUT_SURROUNDINGS, BYTES_WITHOUT_TIME_GROWTH, BYTES_WITHOUT_TRIED, HEAD,
    };
    use super::super::tests::parts;
    use super::*;
    use proptest::prelude::*;

    fn bytes() -> [u8; BYTES] {
        Calibration::new(parts()).expect("plausible").to_bytes()
    }

    /// The checksum made right again.
    fn signed(mut bytes: [u8; BYTES]) -> [u8; BYTES] {
        let checksum = CRC.checksum(&bytes[..BYTES - 4]);
        bytes[BYTES - 4..].copy_from_slice(&checksum.to_le_bytes());
        bytes
    }

    #[test]
    fn come_back_as_the_same_calibration() {
        let calibration = Calibration::new(parts()).expect("plausible");
        assert_eq!(
            Calibration::from_bytes(&calibration.to_bytes()),
            Ok(calibration)
        );
    }

    #[test]
    fn the_numbers_fill_the_bytes() {
        // The last numbers before the checksum are the highest rise, the levers, what tells the surroundings, and what is unknown.
        let last_of = |length: usize| length - 8..length - 4;
        let last = parts().plate.levers[CHANNELS - 1];
        for (length, number) in [
            (BYTES_WITHOUT_LEVERS, parts().bounds.rise.0),
            (BYTES_WITHOUT_SURROUNDINGS, last.warp),
            (BYTES_WITHOUT_RESIDUAL, parts().ambient_ratio),
            (BYTES_WITHOUT_SHARED, parts().residual.ambient_ratio),
            (BYTES_WITHOUT_RESONANCE, parts().heat.shared[POLES - 1]),
            (BYTES_WITHOUT_LAG, parts().path.resonance.quality),
            (BYTES_WITHOUT_TIME_GROWTH, parts().heat.beam_lag.0),
            (BYTES_WITHOUT_SLOWER, parts().heat.time_growth.0),
            (
                BYTES_WITHOUT_CROSSTALK,
                parts().actuators[CHANNELS - 1].slower_by.0,
            ),
            (BYTES_WITHOUT_TRIED, parts().sensed_crosstalk),
            (BYTES, parts().residual.tried.0),
        ] {
            assert_eq!(bytes()[last_of(length)], number.to_le_bytes());
        }
    }

    #[test]
    fn a_calibration_of_a_format_before_lacks_what_came_later() {
        let without_tried = {
            let mut parts = parts();
            parts.residual.tried = Micrometre(0.0);
            parts
        };
        let without_crosstalk = Parts {
            sensed_crosstalk: 0.0,
            ..without_tried
        };
        let without_slower = {
            let mut parts = without_crosstalk;
            for actuator in &mut parts.actuators {
                actuator.slower_by = Second(0.0);
            }
            parts
        };
        let without_time_growth = {
            let mut parts = without_slower;
            parts.heat.time_growth = SecondPerKelvin(0.0);
            parts
        };
        let without_lag = {
            let mut parts = without_time_growth;
            parts.heat.beam_lag = Second(0.0);
            parts
        };
        let without_resonance = {
            let mut parts = without_lag;
            parts.path.resonance = Resonance::UNKNOWN;
            parts
        };
        let without_shared = {
            let mut parts = without_resonance;
            parts.heat.shared = Heat::INSTANT.shared;
            parts
        };
        let without_residual = Parts {
            residual: Residual::UNKNOWN,
            ..without_shared
        };
        let mut without_surroundings = without_residual;
        surroundings(&mut without_surroundings, &mut |number| *number = 0.0);
        let without_levers = Parts {
            plate: Plate::UNKNOWN,
            ..without_surroundings
        };
        for (format, length, expected) in [
            (WITHOUT_TRIED, BYTES_WITHOUT_TRIED, without_tried),
            (
                WITHOUT_CROSSTALK,
                BYTES_WITHOUT_CROSSTALK,
                without_crosstalk,
            ),
            (WITHOUT_SLOWER, BYTES_WITHOUT_SLOWER, without_slower),
            (
                WITHOUT_TIME_GROWTH,
                BYTES_WITHOUT_TIME_GROWTH,
                without_time_growth,
            ),
            (WITHOUT_LAG, BYTES_WITHOUT_LAG, without_lag),
            (
                WITHOUT_RESONANCE,
                BYTES_WITHOUT_RESONANCE,
                without_resonance,
            ),
            (WITHOUT_SHARED, BYTES_WITHOUT_SHARED, without_shared),
            (WITHOUT_RESIDUAL, BYTES_WITHOUT_RESIDUAL, without_residual),
            (
                WITHOUT_SURROUNDINGS,
                BYTES_WITHOUT_SURROUNDINGS,
                without_surroundings,
            ),
            (WITHOUT_LEVERS, BYTES_WITHOUT_LEVERS, without_levers),
        ] {
            let mut old = bytes()[..length].to_vec();
            old[4..6].copy_from_slice(&format.to_le_bytes());
            let end = old.len() - 4;
            let checksum = CRC.checksum(&old[..end]);
            old[end..].copy_from_slice(&checksum.to_le_bytes());
            assert_eq!(
                Calibration::from_bytes(&old).map(|calibration| *calibration.parts()),
                Ok(expected)
            );
            // A sense's calibration may lie behind it.
            old.extend([0; 40]);
            assert_eq!(record_bytes(&old), length);
        }
        assert_eq!(record_bytes(&bytes()), BYTES);
        assert_eq!(record_bytes(&[]), BYTES);
    }

    #[test]
    fn a_format_before_was_tried_wholly_where_it_leaves_no_part() {
        let mut tried = parts();
        tried.residual.part = 0.0;
        let bytes = Calibration::new(tried).expect("plausible").to_bytes();
        let mut old = bytes[..BYTES_WITHOUT_TRIED].to_vec();
        old[4..6].copy_from_slice(&WITHOUT_TRIED.to_le_bytes());
        let end = old.len() - 4;
        let checksum = CRC.checksum(&old[..end]);
        old[end..].copy_from_slice(&checksum.to_le_bytes());
        let read = Calibration::from_bytes(&old).expect("it is one");
        assert_eq!(read.parts().residual.tried, read.max_position());
    }

    #[test]
    fn another_format_is_named() {
        let mut other = bytes();
        other[4..6].copy_from_slice(&14_u16.to_le_bytes());
        let refused = Err(CalibrationError::Format { format: 14 });
        assert_eq!(Calibration::from_bytes(&signed(other)), refused);
    }

    #[test]
    fn a_table_that_does_not_rise_is_named() {
        let mut falling = bytes();
        let second_knot = HEAD + 4 * (5 + 2);
        falling[second_knot..second_knot + 4].copy_from_slice(&0.1_f32.to_le_bytes());
        let error = Calibration::from_bytes(&signed(falling)).expect_err("it falls");
        assert_eq!(
            std::format!("{error}"),
            "temperature_rise_k[2] of actuator 1 does not rise above the one before it"
        );
    }

    #[test]
    fn a_name_that_is_no_text_is_named() {
        let mut garbled = bytes();
        garbled[6] = 0xff;
        let refused = CalibrationError::number(Field::Device, 0, Problem::NotText);
        assert_eq!(Calibration::from_bytes(&signed(garbled)), Err(refused));
    }

    proptest! {
        #[test]
        fn damage_anywhere_is_found(place in 0..BYTES, flip in 1_u8..) {
            let mut damaged = bytes();
            damaged[place] ^= flip;
            prop_assert!(Calibration::from_bytes(&damaged).is_err());
        }

        #[test]
        fn a_part_is_not_the_whole(length in 0..BYTES) {
            prop_assert!(Calibration::from_bytes(&bytes()[..length]).is_err());
        }

        #[test]
        fn any_number_is_checked(place in 0..(BYTES - HEAD) / 4 - 1, bits: u32) {
            let mut other = bytes();
            let at = HEAD + 4 * place;
            other[at..at + 4].copy_from_slice(&bits.to_le_bytes());
            if let Ok(calibration) = Calibration::from_bytes(&signed(other)) {
                prop_assert!(Calibration::new(*calibration.parts()).is_ok());
            }
        }
    }
}
