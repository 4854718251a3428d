//! The resonance of the plate, read off how it rings after a jump of the drive.
//!
//! After a jump of the heating the plate comes to its new place as the temperatures do, a sum of exponentials whatever the heat goes through
//! (a thermal network has real poles only), and rings about it: exp(-pi f t / Q) (a cos + b sin). What the exponentials leave of the
//! displacement is fitted by one such ringing for all jumps, each with an amplitude and a phase of its own, over frequencies and quality
//! factors (separable least squares; Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413).

use std::f64::consts::{PI, TAU};

use control_core::calibration::{Parts, Resonance};
use control_core::{Calibration, CalibrationError, Hertz};
use measurement::{MeasurementFile, Row, Session};
use nalgebra::{DMatrix, DVector};

use crate::dynamics::path_of;

/// A jump is looked at for so long (s): five periods of the lowest resonance.
const LOOKED_AT_S: f64 = 0.06;
/// Just after a jump (s) the drive itself is on its way, by the output filter of the board: three times its two poles of 0.08 ms.
const FILTERED_S: f64 = 0.5e-3;
/// Fewer readings after a jump tell no ringing: three for each of the numbers that are fitted to it.
const FEWEST: usize = 40;
/// Time constants of the exponentials (s): three a decade tell any sum of real poles to a thousandth.
const EXPONENTIALS: usize = 12;
const FASTEST_S: f64 = 0.1e-3;
const PER_EXPONENTIAL: f64 = 2.154_434_69;
/// Frequencies that are tried (Hz), and how far one is from the next: a tenth of the width of a resonance of Q = 10.
const FREQUENCIES_HZ: (f64, f64) = (82.0, 4.9e3);
const NEXT_FREQUENCY: f64 = 1.01;
/// Quality factors that are tried.
const QUALITIES: [f64; 7] = [1.5, 3.0, 6.0, 12.0, 25.0, 50.0, 100.0];
/// Halvings of the grid about the best of it: to 1e-5 of the frequency.
const REFINEMENTS: usize = 12;
/// What a ringing must explain of the squares, in variances of what is left: noise alone explains 40 where 2900 are tried (chi-square of
/// four degrees of freedom for two jumps).
const SIGNIFICANT: f64 = 80.0;
/// Its amplitude, in standard deviations of what is left and in micrometres: less rings no position.
const LOUD: f64 = 3.0;
const LOUD_UM: f64 = 0.05;

/// The resonance that a mirror's displacement shows after jumps of its drive; `None` where it shows none that matters.
pub fn ringing(session: &Session) -> Option<Resonance> {
    let jumps: Vec<Jump> = session
        .files
        .iter()
        .flat_map(|(_, file)| jumps(file))
        .collect();
    let (found, heard) = loudest(&jumps)?;
    let readings: usize = jumps.iter().map(|jump| jump.times_s.len()).sum();
    let unknowns = jumps.len() * (EXPONENTIALS + 3) + 2;
    let left = heard.left / readings.checked_sub(unknowns).filter(|n| *n > 0)? as f64;
    let least_um = LOUD_UM.max(LOUD * left.sqrt());
    let is_heard = heard.explained > SIGNIFICANT * left && heard.amplitude_um > least_um;
    is_heard.then_some(Resonance {
        frequency: Hertz(found.frequency_hz as f32),
        quality: found.quality as f32,
    })
}

/// `calibration` for a plate with this resonance.
///
/// # Errors
/// Where the core shapes no way for it.
pub fn with_resonance(
    calibration: &Calibration,
    resonance: Resonance,
) -> Result<Calibration, CalibrationError> {
    Calibration::new(Parts {
        path: path_of(Some(resonance)),
        ..*calibration.parts()
    })
}

/// What a plate does after a jump.
struct Jump {
    /// Since the jump.
    times_s: Vec<f64>,
    /// An orthonormal basis of what exponentials make, and what they leave of the displacement (um).
    smooth: DMatrix<f64>,
    left_um: DVector<f64>,
}

/// The jumps of a file whose drive is held between its rows.
fn jumps(file: &MeasurementFile) -> Vec<Jump> {
    if file.keys.drive_is_interpolated() || file.keys.is_steady() {
        return Vec::new();
    }
    let held = file.rows.chunk_by(|a, b| a.voltage_v == b.voltage_v);
    held.filter_map(jump).collect()
}

fn jump(held: &[Row]) -> Option<Jump> {
    let start_s = held.first()?.t_s;
    let (times_s, z_um): (Vec<f64>, Vec<f64>) = held
        .iter()
        .map(|row| (row.t_s - start_s, row.z_um))
        .filter(|(t_s, _)| (FILTERED_S..LOOKED_AT_S).contains(t_s))
        .filter_map(|(t_s, z_um)| Some((t_s, z_um.filter(|um| um.is_finite())?)))
        .unzip();
    if times_s.len() < FEWEST {
        return None;
    }
    let exponential = |k: usize| FASTEST_S * PER_EXPONENTIAL.powi(k as i32);
    let smooth = DMatrix::from_fn(
        times_s.len(),
        EXPONENTIALS + 1,
        |row, column| match column {
            0 => 1.0,
            k => (-times_s[row] / exponential(k - 1)).exp(),
        },
    );
    // Columns that are nearly alike lose digits, and with them nothing that matters: what they span is what counts.
    let smooth = smooth.qr().q();
    let z_um = DVector::from_vec(z_um);
    let left_um = &z_um - &smooth * (smooth.transpose() * &z_um);
    Some(Jump {
        times_s,
        smooth,
        left_um,
    })
}

#[derive(Clone, Copy, Debug)]
struct Tone {
    frequency_hz: f64,
    quality: f64,
}

/// How well a tone explains what exponentials leave.
#[derive(Clone, Copy, Debug)]
struct Heard {
    /// Sums of squares (um^2).
    explained: f64,
    left: f64,
    /// The largest amplitude just after a jump (um).
    amplitude_um: f64,
}

/// The tone that explains most.
fn loudest(jumps: &[Jump]) -> Option<(Tone, Heard)> {
    let (lowest, highest) = FREQUENCIES_HZ;
    let frequencies = std::iter::successors(Some(lowest), |hz| {
        Some(hz * NEXT_FREQUENCY).filter(|hz| *hz < highest)
    });
    let grid = frequencies.flat_map(|frequency_hz| {
        QUALITIES.map(|quality| Tone {
            frequency_hz,
            quality,
        })
    });
    let better = |a: Option<(Tone, Heard)>, tone: Tone| {
        let heard = listen(jumps, tone)?;
        Some(
            a.filter(|(_, best)| best.explained >= heard.explained)
                .unwrap_or((tone, heard)),
        )
    };
    let mut best = grid.fold(None, |best, tone| better(best, tone).or(best))?;
    let (mut by_frequency, mut by_quality) = (NEXT_FREQUENCY, 2.0_f64);
    for _ in 0..REFINEMENTS {
        let tone = best.0;
        for (frequency, quality) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            let near = Tone {
                frequency_hz: tone.frequency_hz * by_frequency.powf(frequency),
                quality: tone.quality * by_quality.powf(quality),
            };
            best = better(Some(best), near).unwrap_or(best);
        }
        (by_frequency, by_quality) = (by_frequency.sqrt(), by_quality.sqrt());
    }
    let (Tone { frequency_hz, .. }, _) = best;
    (lowest..highest).contains(&frequency_hz).then_some(best)
}

/// `None` where a jump cannot tell its two parts from each other, or from exponentials.
fn listen(jumps: &[Jump], tone: Tone) -> Option<Heard> {
    let mut heard = Heard {
        explained: 0.0,
        left: 0.0,
        amplitude_um: 0.0,
    };
    for jump in jumps {
        let part = |of_phase: fn(f64) -> f64| {
            let values = jump.times_s.iter().map(|t_s| {
                let decay = (-PI * tone.frequency_hz * t_s / tone.quality).exp();
                decay * of_phase(TAU * tone.frequency_hz * t_s)
            });
            let column = DVector::from_iterator(jump.times_s.len(), values);
            let smooth = &jump.smooth * jump.smooth.tr_mul(&column);
            column - smooth
        };
        let parts = [part(f64::cos), part(f64::sin)];
        let [cc, cs, ss] = [(0, 0), (0, 1), (1, 1)].map(|(i, j)| parts[i].dot(&parts[j]));
        let [c, s] = parts.each_ref().map(|part| part.dot(&jump.left_um));
        let determinant = cc * ss - cs * cs;
        if determinant <= 1e-9 * cc * ss {
            return None;
        }
        let cosine = (ss * c - cs * s) / determinant;
        let sine = (cc * s - cs * c) / determinant;
        let explained = cosine * c + sine * s;
        heard.explained += explained;
        heard.left += jump.left_um.norm_squared() - explained;
        heard.amplitude_um = heard.amplitude_um.max(cosine.hypot(sine));
    }
    (!jumps.is_empty()).then_some(heard)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Readings after two jumps, as a board makes them, by the exact answer of a plate on a spring to a sum of exponentials: with a resonance or without.
    fn stepped(resonance: Option<(f64, f64)>, noise_um: f64) -> Session {
        let mut rows = Vec::new();
        let mut noise = 0.0_f64;
        for (begun_s, volts, toward_um) in [(0.0, 2.0, 50.0), (1.0, 0.0, -50.0)] {
            let mut t_s = 0.0;
            while t_s < 0.5 {
                let poles = [(0.5, 1e-3), (0.35, 33e-3), (0.15, 0.2)];
                let smooth: f64 = poles
                    .iter()
                    .map(|(weight, tau)| weight * (1.0 - (-t_s / tau as &f64).exp()))
                    .sum();
                let ringing = resonance.map_or(0.0, |(hz, quality)| {
                    // A jump of the fastest pole, seen by a resonance above it.
                    let part = 0.5 / (1.0 + (TAU * hz * 1e-3).powi(2)).sqrt();
                    part * (-PI * hz * t_s / quality).exp() * (TAU * hz * t_s + 0.4).cos()
                });
                // Evenly distributed by the golden section, with the standard deviation that is asked for.
                noise = (noise + 0.618_033_988_75).fract();
                let read_um = noise_um * 12_f64.sqrt() * (noise - 0.5);
                let rest_um = if toward_um < 0.0 { 50.0 } else { 0.0 };
                rows.push(Row {
                    t_s: begun_s + t_s,
                    voltage_v: [volts; 4],
                    z_um: Some(rest_um + toward_um * (smooth + ringing) + read_um),
                    ..Row::default()
                });
                t_s += (t_s / 20.0).max(1e-4);
            }
        }
        let file = MeasurementFile {
            rows,
            ..MeasurementFile::default()
        };
        Session {
            files: vec![("step.csv".to_owned(), file)],
        }
    }

    #[test]
    fn a_plate_that_does_not_ring_has_none() {
        for noise_um in [0.0, 0.02, 1.0] {
            assert_eq!(ringing(&stepped(None, noise_um)), None, "{noise_um}");
        }
    }

    #[test]
    fn what_is_drowned_in_noise_is_not_heard() {
        assert_eq!(ringing(&stepped(Some((900.0, 30.0)), 30.0)), None);
        assert_eq!(ringing(&Session::default()), None);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        /// To a hundredth, by which a led move rings by a thousandth (`control_core::path`).
        #[test]
        fn a_resonance_is_found(hz in 86.0_f64..4.5e3, quality in 6.0_f64..60.0) {
            let found = ringing(&stepped(Some((hz, quality)), 0.02));
            let found = found.expect("it rings");
            let (found_hz, found_q) = (f64::from(found.frequency.0), f64::from(found.quality));
            // A plate that has fallen to 1/e within ten readings is heard about, and how much it rings hardly.
            let readings = quality / (std::f64::consts::PI * hz) * 1e4;
            let allowed = if readings < 10.0 { 0.05 } else { 0.01 };
            prop_assert!((found_hz / hz - 1.0).abs() < allowed, "{found_hz} Hz instead of {hz}");
            prop_assume!(readings >= 10.0);
            // Damping adds to what is asked for by its inverse only.
            prop_assert!((found_q / quality - 1.0).abs() < 0.3, "Q {found_q} instead of {quality}");
        }
    }
}
