//! What a heater's resistance tells where the mirror rests, over the stages' rise: the reference from which the core counts the
//! surroundings (`control_core::surroundings`).
//!
//! A linear spline with a penalty on its second differences (P-spline, Eilers and Marx 1996): the stages' rise is as much a
//! temperature as displacement and power tell, so what a resistance tells over it is smooth, and no straight line.

use control_core::Kelvin;
use control_core::calibration::{SENSED_RISES, SensedRises};
use control_core::surroundings::excursion::{APART, SETTLES};
use nalgebra::{SMatrix, SVector};

/// A reading of a resistance, and what the stages tell beside it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    /// The stages' temperature rise (K).
    pub(super) rise: f64,
    /// What the fast poles have still to bring (K).
    pub(super) unsettled: f64,
    /// How far the stages' rise has moved of late (K).
    pub(super) moved: f64,
    /// Temperature rise that the resistance tells, by its line (K).
    pub(super) sensed: f64,
    /// The voltage that it was read at (V).
    pub(super) volts: f64,
}

/// Standard deviation of a reading at 1 V (K): 1 uA of 3 mA, by the 300 K that double a resistance.
const NOISE_K: f64 = 0.1;
/// Part of what the fast poles have still to bring by which heater and stages may be apart meanwhile: they see the same poles with
/// other weights.
const UNSETTLED: f64 = 1.0;
/// Both that and what plate and frame leave after a move count ten times here, so that only where the mirror rests counts: what moves up is
/// off to one side, and no mean takes that away.
const NOT_AT_REST: f64 = 10.0;
/// Standard deviation that second differences from knot to knot may have (K): resistances of the paper's mirror bend by 0.2 K.
const BEND_K: f64 = 0.5;
/// A curve whose slope is less than this part of a straight line's tells no temperature: its readings count for a fifth. A choice.
pub(super) const LEAST_SLOPE: f64 = 0.2;

/// How far an actuator has moved of late, as the core counts it from update to update, over steps of any length.
#[derive(Clone, Copy, Default)]
pub(super) struct Excursion {
    mean: f64,
    range: f64,
}

impl Excursion {
    /// How far it has moved of late (K) once it is at `rise` (K) after so long (s).
    pub(super) fn moved(&mut self, rise: f64, duration_s: f64) -> f64 {
        let kept = (-duration_s / f64::from(SETTLES.0)).exp();
        self.mean = rise + (self.mean - rise) * kept;
        self.range = (self.range * kept).max((rise - self.mean).abs());
        self.range
    }
}

/// Variance by which heater and stages may be apart (K2), with what the fast poles have still to bring and how far the rise has moved
/// of late (K).
pub(super) fn apart_k2(unsettled: f64, moved: f64) -> f64 {
    (UNSETTLED * unsettled).powi(2) + (f64::from(APART) * moved).powi(2)
}

/// Variance of a reading at a voltage (K2).
pub(super) fn noise_k2(volts: f64) -> f64 {
    (NOISE_K / volts).powi(2)
}

/// The curve through readings up to the rise `top_k`; `None` where they show none that rises.
pub(super) fn through(readings: impl Iterator<Item = Reading>, top_k: f64) -> Option<SensedRises> {
    type Square = SMatrix<f64, SENSED_RISES, SENSED_RISES>;
    let step_k = top_k / (SENSED_RISES - 1) as f64;
    let (mut normal, mut right) = (Square::zeros(), SVector::<f64, SENSED_RISES>::zeros());
    for reading in readings {
        let place = (reading.rise / step_k).max(0.0);
        let segment = (place as usize).min(SENSED_RISES - 2);
        let high = place - segment as f64;
        let apart_k2 = NOT_AT_REST.powi(2) * apart_k2(reading.unsettled, reading.moved);
        let weight = (noise_k2(reading.volts) + apart_k2).recip();
        for (i, share) in [(segment, 1.0 - high), (segment + 1, high)] {
            right[i] += weight * share * reading.sensed;
            for (j, other) in [(segment, 1.0 - high), (segment + 1, high)] {
                normal[(i, j)] += weight * share * other;
            }
        }
    }
    for middle in 1..SENSED_RISES - 1 {
        let second = [(middle - 1, 1.0), (middle, -2.0), (middle + 1, 1.0)];
        for (i, a) in second {
            for (j, b) in second {
                normal[(i, j)] += a * b / (BEND_K * BEND_K);
            }
        }
    }
    let knots = normal.cholesky()?.solve(&right);
    let rises = |i: usize| knots[i] - knots[i - 1] > LEAST_SLOPE * step_k;
    (1..SENSED_RISES).all(rises).then(|| SensedRises {
        top: Kelvin(top_k as f32),
        knots: std::array::from_fn(|i| knots[i] as f32),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(rise: f64, sensed: f64) -> Reading {
        Reading {
            rise,
            unsettled: 0.0,
            moved: 0.0,
            sensed,
            volts: 2.0,
        }
    }

    #[test]
    fn a_bent_resistance_is_followed_and_one_that_is_not_at_rest_does_not_count() {
        let bent = |k: f64| 0.3 + k * (1.0 + 2e-3 * k);
        let at_rest = (0..=50).map(|i| reading(2.0 * f64::from(i), bent(2.0 * f64::from(i))));
        let moving = (0..=50).map(|i| Reading {
            unsettled: 500.0,
            ..reading(2.0 * f64::from(i), 60.0)
        });
        // A move away from zero, which the frame has not followed yet.
        let moved = (0..=50).map(|i| Reading {
            moved: 100.0,
            ..reading(2.0 * f64::from(i), 0.99 * bent(2.0 * f64::from(i)))
        });
        let curve = through(at_rest.chain(moving).chain(moved), 100.0).expect("it rises");
        for (i, knot) in curve.knots.iter().enumerate() {
            let exact = bent(100.0 * i as f64 / 16.0);
            // A segment of 6.25 K bends by 0.02 K.
            assert!(
                (f64::from(*knot) - exact).abs() < 0.03,
                "{knot} for {exact}"
            );
        }
    }

    #[test]
    fn a_move_counts_less_and_less() {
        let mut excursion = Excursion::default();
        assert!((excursion.moved(50.0, 0.0) - 50.0).abs() < 1e-9);
        // In one step, or in many.
        let at_once = Excursion::moved(&mut excursion.clone(), 50.0, 0.6);
        let mut in_steps = 0.0;
        (0..60).for_each(|_| in_steps = excursion.moved(50.0, 0.01));
        assert!((at_once / (50.0 * f64::exp(-2.0)) - 1.0).abs() < 1e-6);
        assert!((at_once - in_steps).abs() < 1e-6);
    }

    #[test]
    fn what_does_not_rise_or_was_never_read_tells_nothing() {
        let frozen = (0..50).map(|i| reading(2.0 * f64::from(i), 20.0));
        assert_eq!(through(frozen, 100.0), None);
        assert_eq!(through(std::iter::empty(), 100.0), None);
    }
}
