//! What a sensor reads of a mirror at rest: its zero, its noise, and whether it lies still.

use measurement::{MeasurementFile, Row};

/// From the median of a normal distribution's absolute values to its standard deviation.
const NORMAL: f64 = 1.4826;

/// A mirror at rest moves from one look to the next by no more than this (um), a tenth of what a calibration leaves of it at most
/// (`docs/requirements.md`), or than so many standard errors of the two medians' difference.
const STILL_UM: f64 = 0.02;
const CHANCE: f64 = 3.0;
/// The standard error of a median over that of a mean, of a normal distribution: sqrt(pi / 2).
const OF_A_MEDIAN: f64 = 1.2533;

/// Where a sensor stands while the mirror is at rest.
#[derive(Debug, Default)]
pub(super) struct Zero {
    pub(super) um: Option<f64>,
    /// How far the mirror was from its rest meanwhile, by what the board knows of earlier drives (um).
    pub(super) remembered_um: f64,
    /// The experiment has driven the mirror: where it drives nothing later on, the mirror is on its way to rest.
    is_driven: bool,
}

impl Zero {
    /// An experiment begins, which may have driven the mirror before its first row.
    pub(super) fn begin(&mut self, is_driven: bool) {
        self.is_driven = is_driven;
    }

    /// Looks at the next row of an experiment.
    pub(super) fn look_at(&mut self, row: &Row) {
        self.is_driven |= row.voltage_v != [0.0; 4];
        if !self.is_driven {
            self.um = self.um.or(row.z_um);
        }
    }

    /// Moves displacements to it; before there was one, they stay as they came.
    pub(super) fn count_from(&self, file: &mut MeasurementFile) {
        let Some(zero_um) = self.um else { return };
        for z_um in file.rows.iter_mut().filter_map(|row| row.z_um.as_mut()) {
            *z_um -= zero_um;
        }
    }
}

/// The scatter of readings at rest, one standard deviation, from the median of what one differs from the one before: the
/// mirror may still move, and a reading may stand alone. The root mean square, where most do not differ at all.
pub(super) fn noise_um(readings: &[f64]) -> Option<f64> {
    let apart: Vec<f64> = readings
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs() / std::f64::consts::SQRT_2)
        .collect();
    if apart.is_empty() {
        return None;
    }
    let mean_square = apart.iter().map(|um| um * um).sum::<f64>() / apart.len() as f64;
    let median = measurement::median(apart);
    Some(match median > 0.0 {
        true => NORMAL * median,
        false => mean_square.sqrt(),
    })
}

/// How far the mirror moved from one look to the next (um), and whether that is none to speak of; `None` where a look saw nothing.
pub(super) fn moved(before: &[f64], now: &[f64]) -> Option<(f64, bool)> {
    let (noise_before, noise_now) = (noise_um(before)?, noise_um(now)?);
    let moved_um = measurement::median(now.to_vec()) - measurement::median(before.to_vec());
    let square = |noise: f64, readings: &[f64]| noise * noise / readings.len() as f64;
    let error_um = (square(noise_before, before) + square(noise_now, now)).sqrt();
    let is_still = moved_um.abs() <= STILL_UM.max(CHANCE * OF_A_MEDIAN * error_um);
    Some((moved_um, is_still))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(drives: &[f64]) -> MeasurementFile {
        MeasurementFile {
            rows: drives
                .iter()
                .map(|&volts| Row {
                    voltage_v: [volts; 4],
                    z_um: Some(5.0 + volts),
                    ..Row::default()
                })
                .collect(),
            ..MeasurementFile::default()
        }
    }

    /// Displacements of experiments of one session.
    fn counted(drives: &[&[f64]]) -> Vec<Vec<f64>> {
        let mut zero = Zero::default();
        drives
            .iter()
            .map(|drives| {
                let mut file = file(drives);
                zero.begin(false);
                file.rows.iter().for_each(|row| zero.look_at(row));
                zero.count_from(&mut file);
                file.rows.iter().filter_map(|row| row.z_um).collect()
            })
            .collect()
    }

    #[test]
    fn displacements_count_from_the_session_s_first_one_at_rest() {
        let z_um = counted(&[&[1.0], &[0.0, 1.0, 2.0], &[3.0]]);
        assert_eq!(z_um, [vec![6.0], vec![0.0, 1.0, 2.0], vec![3.0]]);
    }

    #[test]
    fn no_drive_in_mid_experiment_is_no_rest() {
        let z_um = counted(&[&[2.0, 0.0, 2.0], &[1.0]]);
        assert_eq!(z_um, [vec![7.0, 5.0, 7.0], vec![6.0]]);
    }

    #[test]
    fn a_mirror_lies_still_where_nothing_but_noise_moves_it() {
        let look = |at_um: f64, noise_um: f64| -> Vec<f64> {
            let scatter =
                |index: i32| noise_um * 1.732 * (f64::from(index * 37 % 101) / 50.0 - 1.0);
            (0..101).map(|index| at_um + scatter(index)).collect()
        };
        let is_still = |um, noise_um| moved(&look(2.0, noise_um), &look(2.0 - um, noise_um));
        assert_eq!(is_still(0.019, 0.0).map(|(_, still)| still), Some(true));
        assert_eq!(is_still(0.03, 0.02).map(|(_, still)| still), Some(false));
        // 100 nm of noise hide 30 nm: three standard errors of two medians are 53 nm.
        assert_eq!(is_still(0.03, 0.1).map(|(_, still)| still), Some(true));
        assert_eq!(is_still(0.08, 0.1).map(|(_, still)| still), Some(false));
        let (moved_um, _) = is_still(1.0, 0.02).expect("it was seen");
        assert!((moved_um + 1.0).abs() < 1e-12);
        assert_eq!(moved(&[], &look(0.0, 0.02)), None);
    }

    #[test]
    fn noise_is_that_of_most_readings() {
        assert_eq!(noise_um(&[]), None);
        assert_eq!(noise_um(&[1.0]), None);
        // A sensor of 20 nm, as an even spread from -1.7 to 1.7 of it in the order of a prime's multiples.
        let mut readings: Vec<f64> = (0..101)
            .map(|index| 0.02 * 1.732 * (f64::from(index * 37 % 101) / 50.0 - 1.0))
            .collect();
        let is_20_nm = |noise: Option<f64>| (noise.expect("read") / 0.02 - 1.0).abs() < 0.5;
        assert!(is_20_nm(noise_um(&readings)), "{:?}", noise_um(&readings));
        readings[50] += 40.0;
        assert!(is_20_nm(noise_um(&readings)), "{:?}", noise_um(&readings));
        // A last digit that hardly ever changes.
        let mut quiet = vec![0.0; 100];
        quiet[40] = 1e-3;
        assert!(noise_um(&quiet).expect("read") > 1e-4);
    }
}
