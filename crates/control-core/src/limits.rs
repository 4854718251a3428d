//! Limits: what kept an output from being what was asked. A limit is not a fault; the mirror stays
//! under control.

/// One limit that can act on a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Limit {
    /// The position asked for is below rest (0 um).
    PositionLow = 0,
    /// The position asked for is above the top of the calibrated range.
    PositionHigh = 1,
    /// The drive asked for is below 0 V.
    DriveLow = 2,
    /// The drive would be above the highest voltage allowed.
    DriveHigh = 3,
    /// The command was not a number; it is taken as rest.
    NotANumber = 4,
    /// The lease of the last command ended without renewal, so all channels ramped to zero.
    LeaseLapsed = 5,
    /// The position would be reached in time only with more power than is allowed.
    PowerHigh = 6,
    /// The position would be hotter than is allowed.
    TemperatureHigh = 7,
    /// The mirror cools no faster, and nothing but time does it.
    Cooling = 8,
    /// What a current tells of its heater's resistance is implausible; the calibration's is used.
    ResistanceUnknown = 9,
}

impl Limit {
    /// Every limit, in the order of its bit.
    pub const ALL: [Self; 10] = [
        Self::PositionLow,
        Self::PositionHigh,
        Self::DriveLow,
        Self::DriveHigh,
        Self::NotANumber,
        Self::LeaseLapsed,
        Self::PowerHigh,
        Self::TemperatureHigh,
        Self::Cooling,
        Self::ResistanceUnknown,
    ];

    /// The name that people see and scripts use.
    pub fn name(self) -> &'static str {
        match self {
            Self::PositionLow => "position-low",
            Self::PositionHigh => "position-high",
            Self::DriveLow => "drive-low",
            Self::DriveHigh => "drive-high",
            Self::NotANumber => "not-a-number",
            Self::LeaseLapsed => "lease-lapsed",
            Self::PowerHigh => "power-high",
            Self::TemperatureHigh => "temperature-high",
            Self::Cooling => "cooling",
            Self::ResistanceUnknown => "resistance-unknown",
        }
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
    fn bits_return_to_the_same_set() {
        for bits in 0..1024 {
            assert_eq!(Limits::from_bits(bits).bits(), bits);
        }
        assert_eq!(Limits::from_bits(0xffff).iter().count(), Limit::ALL.len());
    }
}
