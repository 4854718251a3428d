//! Limits: what kept an output from being what was asked. A limit is not a fault; the mirror stays
//! under control.

use crate::named;

named! {
    /// One limit that can act on a command.
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    pub enum Limit {
        /// The position asked for is below rest (0 um), or a tilt takes an actuator there.
        PositionLow = "position-low",
        /// The position asked for is above the top of the calibrated range, or a tilt takes an actuator there.
        PositionHigh = "position-high",
        /// The drive asked for is below 0 V.
        DriveLow = "drive-low",
        /// The drive would be above the highest voltage allowed.
        DriveHigh = "drive-high",
        /// The command was not a number; it is taken as rest.
        NotANumber = "not-a-number",
        /// The lease of the last command ended without renewal, so all channels ramped to zero.
        LeaseLapsed = "lease-lapsed",
        /// The position would be reached in time only with more power than is allowed.
        PowerHigh = "power-high",
        /// The position would be hotter than is allowed.
        TemperatureHigh = "temperature-high",
        /// The mirror cools no faster, and nothing but time does it.
        Cooling = "cooling",
        /// What a current tells of its heater's resistance is implausible; the calibration's is used.
        ResistanceUnknown = "resistance-unknown",
        /// A tilt was asked for under a calibration that does not know the plate's levers; there is none.
        TiltUnknown = "tilt-unknown",
        /// The surroundings alone bend the mirror further than the position asked for, and a heater cannot cool.
        RoomWarm = "room-warm",
        /// A heater tells otherwise than at calibration, and the others do not: it has aged, or the calibration is another's.
        CalibrationDrifted = "calibration-drifted",
    }
}

/// A set of limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits(u16);

impl Limits {
    /// No limit acted.
    pub const NONE: Self = Self(0);

    /// The set as bits, bit `n` for the n-th of [`Limit::ALL`].
    pub fn bits(self) -> u16 {
        self.0
    }

    /// The set from its bits; bits that name no limit are dropped.
    pub fn from_bits(bits: u16) -> Self {
        Self(bits & ((1 << Limit::ALL.len()) - 1))
    }

    /// Whether `limit` acted.
    pub fn contains(self, limit: Limit) -> bool {
        self.0 & (1 << limit as u16) != 0
    }

    /// The limits that acted.
    pub fn iter(self) -> impl Iterator<Item = Limit> {
        Limit::ALL
            .into_iter()
            .filter(move |limit| self.contains(*limit))
    }

    /// Whether any but those that only tell of the calibration acted: the mirror may not be where it was asked to be.
    pub fn hold_back(self) -> bool {
        let mut acting = self.iter();
        acting.any(|limit| limit != Limit::CalibrationDrifted)
    }

    /// The limits of both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Limits `value` to `low..=high` and notes which end acted. NaN becomes `low`.
    pub(crate) fn clamp(
        &mut self,
        value: f32,
        (low, below): (f32, Limit),
        (high, above): (f32, Limit),
    ) -> f32 {
        if value.is_nan() {
            self.insert(Limit::NotANumber);
            low
        } else if value < low {
            self.insert(below);
            low
        } else if value > high {
            self.insert(above);
            high
        } else {
            value
        }
    }

    /// Adds `limit` to those that acted.
    pub fn insert(&mut self, limit: Limit) {
        self.0 |= 1 << limit as u16;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn tells_which_end_acted() {
        let ends = ((0.0, Limit::DriveLow), (3.5, Limit::DriveHigh));
        for (value, limited, limit) in [
            (-0.1, 0.0, Some(Limit::DriveLow)),
            (1.0, 1.0, None),
            (9.0, 3.5, Some(Limit::DriveHigh)),
            (f32::NAN, 0.0, Some(Limit::NotANumber)),
        ] {
            let mut limits = Limits::NONE;
            assert_eq!(limits.clamp(value, ends.0, ends.1), limited);
            assert_eq!(
                limits.iter().collect::<Vec<_>>(),
                limit.into_iter().collect::<Vec<_>>()
            );
        }
    }

    #[test]
    fn a_heater_that_has_drifted_holds_nothing_back() {
        let mut limits = Limits::NONE;
        limits.insert(Limit::CalibrationDrifted);
        assert!(!limits.hold_back());
        limits.insert(Limit::Cooling);
        assert!(limits.hold_back());
    }

    #[test]
    fn bits_return_to_the_same_set() {
        for bits in 0..1 << Limit::ALL.len() {
            assert_eq!(Limits::from_bits(bits).bits(), bits);
        }
        assert_eq!(Limits::from_bits(0xffff).iter().count(), Limit::ALL.len());
    }
}
