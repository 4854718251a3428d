//! The white noise of readings: what a file says, or else what such instruments have, or more where the readings show more.

mod bench;

use measurement::{MeasurementFile, Row, Session};
use mirror_model::ACTUATORS;

/// White noise of the displacement where a file does not say `noise_z_nm`: that of a laser displacement sensor, and of the
/// virtual bench's (`virtual-sessions`).
const DEFAULT_DISPLACEMENT_UM: f64 = 0.02;
/// Noise of a current reading of the driver board (`docs/board.md`), constant, and as a part of the reading.
const CURRENT_A: f64 = 2e-6;
const CURRENT_RATIO: f64 = 1e-4;
/// Fourth differences of even rows: they cancel any cubic, and a mirror is that smooth over five rows, and noise is not.
const DIFFERENCE: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
/// Rows are even whose steps of time differ by less than this share.
const EVEN: f64 = 0.01;
/// Fewer differences than this say nothing: their median is then off by a fifth or more.
const ENOUGH: usize = 40;
/// The median magnitude of normal numbers, in standard deviations: the normal distribution's third quartile.
const MEDIAN_OF_NORMAL: f64 = 0.6745;

/// The noise of a session's readings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    /// How many times noisier than usual, 1 or more.
    displacement: f64,
    current: [Current; ACTUATORS],
}

/// Noise of a current: constant, and in proportion.
#[derive(Clone, Copy, Debug)]
struct Current {
    constant_a: f64,
    ratio: f64,
}

impl Current {
    const USUAL: Self = Self {
        constant_a: CURRENT_A,
        ratio: CURRENT_RATIO,
    };

    fn at(&self, current_a: f64) -> f64 {
        self.constant_a.hypot(self.ratio * current_a)
    }
}

impl Noise {
    pub(crate) fn of(session: &Session) -> Self {
        let times = |reading: &dyn Fn(&MeasurementFile, &Row) -> Option<[f64; 2]>| {
            let mut roughness: Vec<f64> = session
                .files
                .iter()
                .flat_map(|(_, file)| roughness(&file.rows, |row| reading(file, row)))
                .collect();
            roughness.sort_by(f64::total_cmp);
            match roughness.get(roughness.len() / 2) {
                Some(median) if roughness.len() >= ENOUGH => (median / MEDIAN_OF_NORMAL).max(1.0),
                _ => 1.0,
            }
        };
        let heaters = session
            .files
            .iter()
            .all(|(_, file)| file.rows.iter().all(|row| row.z_um.is_none()));
        Self {
            displacement: times(&|file, row| match said_um(file) {
                None => Some([row.z_um?, DEFAULT_DISPLACEMENT_UM]),
                Some(_) => None,
            }),
            current: std::array::from_fn(|actuator| {
                if heaters {
                    return bench::current(session, actuator);
                }
                let times = times(&|_, row| {
                    let current = row.current_a[actuator]?;
                    Some([current, Current::USUAL.at(current)])
                });
                Current {
                    constant_a: times * CURRENT_A,
                    ratio: times * CURRENT_RATIO,
                }
            }),
        }
    }

    /// White noise of a file's displacements, one standard deviation (um).
    pub(crate) fn of_displacement(&self, file: &MeasurementFile) -> f64 {
        said_um(file).unwrap_or(self.displacement * DEFAULT_DISPLACEMENT_UM)
    }

    /// White noise of a reading of an actuator's current, one standard deviation (A).
    pub(crate) fn of_current(&self, actuator: usize, current_a: f64) -> f64 {
        self.current[actuator].at(current_a)
    }
}

/// Who says it knows; and a mirror that rings looks noisy.
fn said_um(file: &MeasurementFile) -> Option<f64> {
    let said = file.keys.displacement_noise_um();
    said.filter(|&noise| noise > 0.0)
}

/// Magnitudes of the fourth differences of readings, in standard deviations of the noise that comes with each.
fn roughness(rows: &[Row], reading: impl Fn(&Row) -> Option<[f64; 2]>) -> Vec<f64> {
    let gain = DIFFERENCE.iter().map(|d| d * d).sum::<f64>().sqrt();
    rows.windows(DIFFERENCE.len())
        .filter(|window| is_even(window))
        .filter_map(|window| {
            let mut difference = 0.0;
            for (row, weight) in window.iter().zip(DIFFERENCE) {
                difference += weight * reading(row)?[0];
            }
            let [_, noise] = reading(&window[DIFFERENCE.len() / 2])?;
            Some(difference.abs() / (gain * noise))
        })
        .collect()
}

fn is_even(rows: &[Row]) -> bool {
    let steps = || rows.windows(2).map(|pair| pair[1].t_s - pair[0].t_s);
    let longest = steps().fold(0.0, f64::max);
    let shortest = steps().fold(f64::INFINITY, f64::min);
    shortest > (1.0 - EVEN) * longest
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    /// A sine of 60 um and 2 mA with as many rows as the standard session's.
    fn sine(z_um: f64, current_a: f64) -> Session {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut noise = |sigma: f64| Normal::new(0.0, sigma).expect("finite").sample(&mut rng);
        let rows = (0..300)
            .map(|index| {
                let phase = f64::from(index) * std::f64::consts::TAU / 100.0;
                Row {
                    t_s: f64::from(index) * 1e-3,
                    z_um: Some(60.0 * phase.sin() + noise(z_um)),
                    current_a: [
                        Some(2e-3 * phase.cos() + noise(current_a)),
                        None,
                        None,
                        None,
                    ],
                    ..Row::default()
                }
            })
            .collect();
        let file = MeasurementFile {
            rows,
            ..MeasurementFile::default()
        };
        Session {
            files: vec![("sine.csv".into(), file)],
        }
    }

    #[test]
    fn readings_that_are_noisier_than_usual_are_believed() {
        let session = sine(0.1, 6e-6);
        let noise = Noise::of(&session);
        let file = &session.files[0].1;
        assert!((noise.of_displacement(file) / 0.1 - 1.0).abs() < 0.2);
        assert!((noise.of_current(0, 0.0) / 6e-6 - 1.0).abs() < 0.2);
        assert_eq!(noise.of_current(1, 0.0), 2e-6);
    }

    #[test]
    fn readings_that_are_quieter_than_usual_are_not() {
        let session = sine(0.001, 1e-7);
        let noise = Noise::of(&session);
        assert_eq!(noise.of_displacement(&session.files[0].1), 0.02);
        assert_eq!(noise.of_current(0, 0.0), 2e-6);
    }

    #[test]
    fn what_a_file_says_is_believed() {
        let mut session = sine(0.1, 6e-6);
        session.files[0].1.keys.set("noise_z_nm", "30");
        let noise = Noise::of(&session);
        assert_eq!(noise.of_displacement(&session.files[0].1), 0.03);
    }

    #[test]
    fn a_few_rows_say_nothing() {
        let mut session = sine(0.1, 6e-6);
        session.files[0].1.rows.truncate(30);
        let noise = Noise::of(&session);
        assert_eq!(noise.of_displacement(&session.files[0].1), 0.02);
    }
}
