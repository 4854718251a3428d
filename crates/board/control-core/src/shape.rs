//! The inverse of the shape stage as a table: position to temperature.
//!
//! Temperature and not voltage is tabulated because it starts linearly in z, where the voltage starts
//! as a square root and would need dense knots near rest.

use crate::units::{Kelvin, Micrometre};

/// Intervals of the table. 128 of them leave an interpolation error below 1 nm on the paper's mirror
/// (measured by the `calibration` crate's tests).
pub const SEGMENTS: usize = 128;

/// Knots of the table, both ends included.
pub const KNOTS: usize = SEGMENTS + 1;

/// Temperature rise at equally spaced positions from rest to the top of the range, in 524 bytes.
///
/// Linear between the knots, and therefore monotone and continuous wherever its knots are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseTable {
    top: Micrometre,
    segments_per_um: f32,
    knots: [f32; KNOTS],
}

/// Why a table is not accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TableError {
    /// The top of the range is not a finite position above zero, or too small to divide.
    Range,
    /// The first knot is not zero: at rest the actuator is at ambient.
    Origin,
    /// A knot is not finite, or not above the one before it.
    NotRising {
        /// Index of the first such knot.
        knot: usize,
    },
}

impl InverseTable {
    /// One kelvin a micrometre, up to 1 um.
    pub const STRAIGHT: Self = {
        let mut knots = [0.0; KNOTS];
        let mut knot = 1;
        while knot < KNOTS {
            knots[knot] = knot as f32 / SEGMENTS as f32;
            knot += 1;
        }
        Self {
            top: Micrometre(1.0),
            segments_per_um: SEGMENTS as f32,
            knots,
        }
    };

    /// A table from `knots`: the temperature rise in kelvin at `top * i / SEGMENTS`.
    ///
    /// # Errors
    /// Where the range is unusable or the knots do not rise strictly from zero.
    pub fn new(top: Micrometre, knots: [f32; KNOTS]) -> Result<Self, TableError> {
        let segments_per_um = SEGMENTS as f32 / top.0;
        if !(top.0 > 0.0 && top.0.is_finite() && segments_per_um.is_finite()) {
            return Err(TableError::Range);
        }
        if knots[0] != 0.0 {
            return Err(TableError::Origin);
        }
        for knot in 1..KNOTS {
            if !(knots[knot].is_finite() && knots[knot] > knots[knot - 1]) {
                return Err(TableError::NotRising { knot });
            }
        }
        Ok(Self {
            top,
            segments_per_um,
            knots,
        })
    }

    /// Largest position that the table knows.
    pub fn top(&self) -> Micrometre {
        self.top
    }

    /// The temperature rises at the knots, in kelvin.
    pub fn knots(&self) -> &[f32; KNOTS] {
        &self.knots
    }

    /// Temperature rise at position `z`; outside the range, and for NaN, that of the nearer end.
    pub fn temperature_rise(&self, z: Micrometre) -> Kelvin {
        // NaN becomes 0 here. (`max` and `min` would be calls of the library.)
        let z = if z.0 > 0.0 { z } else { Micrometre(0.0) };
        self.going_on_straight(if z.0 < self.top.0 { z } else { self.top })
    }

    /// Temperature rise at position `z`; outside the range its ends go on straight.
    #[inline(always)]
    pub(crate) fn going_on_straight(&self, z: Micrometre) -> Kelvin {
        let place = z.0 * self.segments_per_um;
        // The cast takes NaN to 0.
        let segment = (place as i32).clamp(0, SEGMENTS as i32 - 1);
        let knot = segment as usize;
        let (low, high) = (self.knots[knot], self.knots[knot + 1]);
        Kelvin(low + (place - segment as f32) * (high - low))
    }

    /// Kelvins for each micrometre at position `z`; beyond the ends as there.
    pub(crate) fn slope(&self, z: Micrometre) -> f32 {
        let segment = ((z.0 * self.segments_per_um) as usize).min(SEGMENTS - 1);
        (self.knots[segment + 1] - self.knots[segment]) * self.segments_per_um
    }

    /// Position at a temperature rise: the table read forward. Outside its range that of the nearer end.
    pub fn position(&self, rise: Kelvin) -> Micrometre {
        let above = self.knots.partition_point(|knot| *knot <= rise.0);
        let segment = above.saturating_sub(1).min(SEGMENTS - 1);
        let (low, high) = (self.knots[segment], self.knots[segment + 1]);
        let fraction = (rise.0 - low) / (high - low);
        // NaN becomes 0 here.
        let fraction = if fraction > 0.0 { fraction } else { 0.0 };
        let fraction = if fraction < 1.0 { fraction } else { 1.0 };
        Micrometre((segment as f32 + fraction) / self.segments_per_um)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rising_table() -> impl Strategy<Value = InverseTable> {
        (
            1.0_f32..500.0,
            proptest::collection::vec(0.01_f32..5.0, SEGMENTS),
        )
            .prop_map(|(top, rises)| {
                let mut knots = [0.0; KNOTS];
                for (i, rise) in rises.iter().enumerate() {
                    knots[i + 1] = knots[i] + rise;
                }
                InverseTable::new(Micrometre(top), knots).expect("rising from zero")
            })
    }

    proptest! {
        #[test]
        fn is_monotone(table in rising_table(), a in 0.0_f32..1.0, b in 0.0_f32..1.0) {
            let at = |part: f32| table.temperature_rise(Micrometre(part * table.top().0)).0;
            prop_assert!(at(a.min(b)) <= at(a.max(b)));
        }

        #[test]
        fn is_continuous_across_its_knots(table in rising_table(), knot in 1..SEGMENTS) {
            let z = table.top().0 * knot as f32 / SEGMENTS as f32;
            let below = table.temperature_rise(Micrometre(z * (1.0 - 2e-6))).0;
            let above = table.temperature_rise(Micrometre(z * (1.0 + 2e-6))).0;
            // 4e-6 of z is at most 6e-4 of a segment, of at most 5 K.
            prop_assert!((above - below).abs() < 4e-3, "{below} to {above}");
        }

        #[test]
        fn passes_through_its_knots(table in rising_table(), knot in 0..KNOTS) {
            let z = table.top().0 * knot as f32 / SEGMENTS as f32;
            let error = table.temperature_rise(Micrometre(z)).0 - table.knots[knot];
            // A millikelvin is a nanometre; f32 keeps 6e-5 K of the hottest, 640 K.
            prop_assert!(error.abs() < 1e-3, "{error}");
        }

        #[test]
        fn reads_the_same_forward(table in rising_table(), part in 0.0_f32..1.0) {
            let z = part * table.top().0;
            let back = table.position(table.temperature_rise(Micrometre(z))).0;
            // Rounding of the rise, divided by the slope of the flattest segment.
            prop_assert!((back - z).abs() < 1e-3 * table.top().0.max(1.0), "{back} for {z}");
        }

        #[test]
        fn any_bit_pattern_stays_between_the_ends(table in rising_table(), bits: u32) {
            let rise = table.temperature_rise(Micrometre(f32::from_bits(bits))).0;
            prop_assert!((0.0..=table.knots[SEGMENTS]).contains(&rise));
        }
    }

    #[test]
    fn refuses_what_is_not_an_inverse() {
        let good: [f32; KNOTS] = core::array::from_fn(|i| i as f32);
        let with = |knot: usize, value: f32| {
            let mut knots = good;
            knots[knot] = value;
            InverseTable::new(Micrometre(170.0), knots)
        };
        assert_eq!(with(0, 0.5), Err(TableError::Origin));
        assert_eq!(with(7, 6.0), Err(TableError::NotRising { knot: 7 }));
        assert_eq!(
            with(128, f32::NAN),
            Err(TableError::NotRising { knot: 128 })
        );
        assert_eq!(
            with(128, f32::INFINITY),
            Err(TableError::NotRising { knot: 128 })
        );
        for top in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-45] {
            assert_eq!(
                InverseTable::new(Micrometre(top), good),
                Err(TableError::Range)
            );
        }
    }
}
