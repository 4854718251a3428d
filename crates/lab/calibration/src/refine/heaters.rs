//! What the heaters' resistances tell of the thermal poles: creep moves a mirror and warms no heater.
//!
//! A heater's own temperature is no straight line of its actuator's, so resistances are compared with the best parabola over the
//! stages' rise; what is left of them is a residual like one of the displacement.

use control_core::CHANNELS;
use nalgebra::{Matrix3, Vector3};

use super::sensed::{Excursion, LEAST_SLOPE, apart_k2, noise_k2};
use super::timeline::TimeStep;

/// By how much a heater may tell another course than its actuator's beam besides (K): as little as two readings at 1 V tell. A residual of
/// the displacement is as small (0.1 K are 0.15 um), so that where creep and a slow pole would follow it alike, resistances decide. Without
/// them a mirror that creeps by 15 % is left 0.7 um off, and with them 0.2 um (`cargo xtask bench foreign`, seed 903).
const APART_K: f64 = 0.1;
/// In this unit a rise is squared (K), about what it comes to.
const UNIT_K: f64 = 100.0;

/// A resistance (ohm) beside the stages' rise (in its unit), and its weight.
struct OhmReading {
    rise: f64,
    ohm: f64,
    weight: f64,
}

/// The standardised residuals of all resistances, given each actuator's rise and what its fast poles have still to bring at the end of
/// every time step (K); none where a heater tells no parabola.
pub(super) fn residuals(steps: &[TimeStep], rises: &[[(f64, f64); CHANNELS]]) -> Vec<f64> {
    let of = |channel: usize| {
        let readings = readings(steps, rises, channel);
        let parabola = parabola(&readings);
        readings.into_iter().map(move |reading| {
            let OhmReading { rise, ohm, weight } = reading;
            parabola.map_or(0.0, |[cold, slope, bend]| {
                let told = cold + rise * (slope + rise * bend);
                let here = (slope + 2.0 * bend * rise).max(LEAST_SLOPE * slope);
                weight.sqrt() * (ohm - told) * UNIT_K / here
            })
        })
    };
    (0..CHANNELS).flat_map(of).collect()
}

fn readings(
    steps: &[TimeStep],
    rises: &[[(f64, f64); CHANNELS]],
    channel: usize,
) -> Vec<OhmReading> {
    let mut excursion = Excursion::default();
    let read = |(step, rises): (&TimeStep, &[(f64, f64); CHANNELS])| {
        let (rise, unsettled) = rises[channel];
        let moved = excursion.moved(rise, step.duration_s);
        let read = step.sensed[channel]?;
        Some(OhmReading {
            rise: rise / UNIT_K,
            ohm: read.ohm,
            weight: (noise_k2(read.volts) + apart_k2(unsettled, moved) + APART_K * APART_K).recip(),
        })
    };
    steps.iter().zip(rises).filter_map(read).collect()
}

/// The weighted least-squares parabola, from its constant upwards; `None` where it is not determined, or does not rise.
fn parabola(readings: &[OhmReading]) -> Option<[f64; 3]> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for OhmReading { rise, ohm, weight } in readings {
        let row = Vector3::new(1.0, *rise, rise * rise);
        normal += *weight * row * row.transpose();
        right += *weight * *ohm * row;
    }
    let found = normal.cholesky()?.solve(&right);
    (found.iter().all(|value| value.is_finite()) && found[1] > 0.0).then(|| found.into())
}

#[cfg(test)]
mod tests {
    use super::super::timeline::SensedResistance;
    use super::*;

    /// Steps of a second at which one heater tells these resistances, over rises that are settled.
    fn told(readings: &[(f64, f64)]) -> Vec<f64> {
        let steps: Vec<TimeStep> = readings
            .iter()
            .map(|&(_, ohm)| TimeStep {
                duration_s: 10.0,
                sensed: [Some(SensedResistance { ohm, volts: 2.0 }), None, None, None],
                ..TimeStep::default()
            })
            .collect();
        let rises: Vec<_> = readings
            .iter()
            .map(|&(rise, _)| [(rise, 0.0); CHANNELS])
            .collect();
        residuals(&steps, &rises)
    }

    #[test]
    fn a_parabola_leaves_nothing_and_what_is_off_it_stays() {
        let line = |rise: f64| 300.0 + rise + 1e-3 * rise * rise;
        let mut readings: Vec<_> = (0..=20)
            .map(|i| 5.0 * f64::from(i))
            .map(|k| (k, line(k)))
            .collect();
        assert!(told(&readings).iter().all(|left| left.abs() < 1e-6));
        readings[10].1 += 1.1;
        let left = told(&readings);
        // 1.1 ohm at 50 K are 1 K, or 8.9 of its deviations at 2 V, less what one of 21 bends the parabola by, a tenth of that.
        assert!((7.9..8.1).contains(&left[10]), "{left:?}");
    }

    #[test]
    fn what_does_not_rise_leaves_nothing() {
        let frozen: Vec<_> = (0..20)
            .map(|i| (5.0 * f64::from(i), 300.0 - f64::from(i)))
            .collect();
        assert_eq!(told(&frozen), vec![0.0; 20]);
    }
}
