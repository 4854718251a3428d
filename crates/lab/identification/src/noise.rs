//! The white noise of readings: what a file says, or else what such instruments have, or more where the readings show more.

mod bench;
mod smooth;
mod stated;
mod usual;

use measurement::held::{DIFFERENCE, MEDIAN_OF_NORMAL};
use measurement::{CurrentNoise, MeasurementFile, Row, Session, median};
use mirror_model::ACTUATORS;
use smooth::{along_drive, is_even};
pub(crate) use stated::misstated;
use usual::{DISPLACEMENT_UM, USUAL};

/// Fewer differences than this say nothing: their median is then off by a fifth or more.
const ENOUGH: usize = 40;
/// Fewer along a drive, each at one of its own, where nothing rings: their median is then off by a third or more, and chance of ten times the noise
/// that is taken looks like physics.
const ENOUGH_ALONG_DRIVE: usize = 20;

/// The noise of a session's readings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    /// How many times noisier than usual, 1 or more.
    displacement: f64,
    current: [CurrentNoise; ACTUATORS],
    /// What rounded readings of the voltage may be off by, one standard deviation (V).
    rounding_v: f64,
}

impl Noise {
    pub(crate) fn of(session: &Session) -> Self {
        let heaters = session
            .files
            .iter()
            .all(|(_, file)| file.rows.iter().all(|row| row.z_um.is_none()));
        let rounding_v = if heaters {
            bench::rounding_v(session)
        } else {
            0.0
        };
        Self {
            displacement: times_usual(shown_by_displacements(session)),
            rounding_v,
            current: std::array::from_fn(|actuator| {
                if heaters {
                    return bench::current(session, actuator, rounding_v);
                }
                let times = times_usual(shown(session, |_, row| {
                    let current = row.current_a[actuator]?;
                    Some([current, USUAL.at(current)])
                }));
                CurrentNoise {
                    constant_a: times * USUAL.constant_a,
                    ratio: times * USUAL.ratio,
                }
            }),
        }
    }

    /// Noise of a row's displacement, one standard deviation (um). What the drive may be off by is part of it: a displacement
    /// grows as the square of the drive, more or less.
    pub(crate) fn of_displacement(&self, file: &MeasurementFile, row: &Row) -> f64 {
        let highest_v = row.highest_v();
        let slope = match row.z_um {
            Some(z_um) if highest_v > 0.0 => 2.0 * z_um / highest_v,
            _ => 0.0,
        };
        self.white_um(file).hypot(slope * self.of_drive(file))
    }

    /// Noise of a row's reading of an actuator's current, one standard deviation (A). What the drive may be off by is part of it:
    /// a current grows in proportion to the drive, or less where the heater warms.
    pub(crate) fn of_current(&self, actuator: usize, file: &MeasurementFile, row: &Row) -> f64 {
        let current_a = row.current_a[actuator].unwrap_or(0.0);
        let slope = match row.voltage_v[actuator] {
            0.0 => 0.0,
            volts => current_a / volts,
        };
        self.white(actuator, file)
            .at(current_a)
            .hypot(slope * self.of_drive(file))
    }

    /// States in a session's files what it takes for their noise, where they do not say it.
    pub(crate) fn is_stated_in(&self, session: &mut Session) {
        for (_, file) in &mut session.files {
            let currents = (0..ACTUATORS).map(|actuator| self.white(actuator, file));
            let worst = currents.reduce(|a, b| CurrentNoise {
                constant_a: a.constant_a.max(b.constant_a),
                ratio: a.ratio.max(b.ratio),
            });
            let nanometres = 1e3 * self.white_um(file);
            file.keys.set("noise_z_nm", &format!("{nanometres:?}"));
            if let Some(worst) = worst.filter(|_| file.keys.current_noise().is_none()) {
                file.keys.set_current_noise(worst);
            }
            let millivolts = 1e3 * self.of_drive(file);
            file.keys.set("noise_V_mV", &format!("{millivolts:?}"));
        }
    }

    fn white_um(&self, file: &MeasurementFile) -> f64 {
        said_um(file).unwrap_or(self.displacement * DISPLACEMENT_UM)
    }

    fn white(&self, actuator: usize, file: &MeasurementFile) -> CurrentNoise {
        let said = file.keys.current_noise();
        said.unwrap_or(self.current[actuator])
    }

    /// One standard deviation (V).
    fn of_drive(&self, file: &MeasurementFile) -> f64 {
        file.keys.drive_noise_v().unwrap_or(self.rounding_v)
    }
}

/// What is taken for the noise of displacements of which no file says it, and which are too few to show it: a sentence.
pub(crate) fn assumed(session: &Session) -> Option<String> {
    let mut files = session.files.iter();
    let is_unsaid = files
        .any(|(_, file)| file.has_displacement() && file.keys.displacement_noise_um().is_none());
    (is_unsaid && shown_by_displacements(session).is_none()).then(|| {
        format!(
            "no file says the noise of its displacements, and they are too few to show it: {:.0} nm are taken, as of a laser displacement sensor. Where \
             yours has more, chance looks like physics: write `# noise_z_nm=` and its standard deviation above the headings",
            1e3 * DISPLACEMENT_UM
        )
    })
}

/// Nothing is quieter than usual.
fn times_usual(shown: Option<f64>) -> f64 {
    shown.unwrap_or(1.0).max(1.0)
}

fn shown_by_displacements(session: &Session) -> Option<f64> {
    shown(session, |file, row| match said_um(file) {
        None => Some([row.z_um?, DISPLACEMENT_UM]),
        Some(_) => None,
    })
}

/// How many times noisier than usual readings show themselves to be, each with its usual noise; `None` where they are too few.
fn shown(
    session: &Session,
    reading: impl Fn(&MeasurementFile, &Row) -> Option<[f64; 2]>,
) -> Option<f64> {
    let all = |along_drive: bool| -> Vec<f64> {
        let of = |(_, file): &(String, MeasurementFile)| {
            roughness(&file.rows, along_drive, |row| reading(file, row))
        };
        session.files.iter().flat_map(of).collect()
    };
    let ways = [(false, ENOUGH), (true, ENOUGH_ALONG_DRIVE)];
    let mut enough = ways.into_iter().filter_map(|(along_drive, enough)| {
        let all = all(along_drive);
        (all.len() >= enough).then(|| median(all) / MEDIAN_OF_NORMAL)
    });
    enough.next()
}

/// Who says it knows; and a mirror that rings looks noisy.
fn said_um(file: &MeasurementFile) -> Option<f64> {
    let said = file.keys.displacement_noise_um();
    said.filter(|&noise| noise > 0.0)
}

/// Magnitudes of differences of readings that cancel any cubic, in standard deviations of the noise that comes with each: of those at even times,
/// or of those along a drive that rises or falls from each to the next.
fn roughness(
    rows: &[Row],
    along_a_drive: bool,
    reading: impl Fn(&Row) -> Option<[f64; 2]>,
) -> Vec<f64> {
    let weights = |window: &[Row]| match along_a_drive {
        true => along_drive(&window.iter().map(Row::highest_v).collect::<Vec<_>>()),
        false => is_even(window).then(|| DIFFERENCE.to_vec()),
    };
    let size = |window: &[Row]| {
        let weights = weights(window)?;
        let gain = weights.iter().map(|d| d * d).sum::<f64>().sqrt();
        let mut difference = 0.0;
        for (row, weight) in window.iter().zip(&weights) {
            difference += weight * reading(row)?[0];
        }
        let [_, noise] = reading(&window[window.len() / 2])?;
        Some(difference.abs() / (gain * noise))
    };
    rows.windows(DIFFERENCE.len()).filter_map(size).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};
    use std::f64::consts::TAU;

    /// A sine of 60 um and 2 mA with as many rows as the standard session's.
    fn sine(z_um: f64, current_a: f64) -> Session {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut noise = |sigma: f64| Normal::new(0.0, sigma).expect("finite").sample(&mut rng);
        let rows = (0..300)
            .map(|index| {
                let phase = f64::from(index) * TAU / 100.0;
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

    /// Noise of the second row's displacement (um), and of a current of 0 A.
    fn noise(session: &Session) -> (f64, impl Fn(usize) -> f64 + use<>) {
        let (noise, file) = (Noise::of(session), session.files[0].1.clone());
        let idle = |actuator| Row {
            current_a: std::array::from_fn(|a| (a == actuator).then_some(0.0)),
            ..Row::default()
        };
        let z = noise.of_displacement(&file, &file.rows[1]);
        (z, move |actuator| {
            noise.of_current(actuator, &file, &idle(actuator))
        })
    }

    #[test]
    fn readings_that_are_noisier_than_usual_are_believed() {
        let session = sine(0.1, 6e-6);
        let (z_um, current_a) = noise(&session);
        // The median of three hundred differences is known to 7 %: three of these.
        assert!((z_um / 0.1 - 1.0).abs() < 0.2);
        assert_eq!(assumed(&session), None);
        assert!((current_a(0) / 6e-6 - 1.0).abs() < 0.2);
        assert_eq!(current_a(1), 2e-6);
    }

    #[test]
    fn readings_that_are_quieter_than_usual_are_not() {
        let session = sine(0.001, 1e-7);
        let (z_um, current_a) = noise(&session);
        assert_eq!((z_um, current_a(0)), (0.02, 2e-6));
    }

    #[test]
    fn what_a_file_says_is_believed() {
        let mut session = sine(0.1, 6e-6);
        for (key, value) in [
            ("noise_z_nm", "30"),
            ("noise_I_uA", "5"),
            ("noise_V_mV", "10"),
        ] {
            session.files[0].1.keys.set(key, value);
        }
        let (z_um, current_a) = noise(&session);
        // Nothing is driven, so that nothing follows from what the drive may be off by.
        assert_eq!(z_um, 0.03);
        assert!((current_a(0) - 5e-6).abs() < 1e-15);
        session.files[0].1.rows[1] = Row {
            voltage_v: [2.0; ACTUATORS],
            z_um: Some(4.0),
            current_a: [Some(3e-3); ACTUATORS],
            ..Row::default()
        };
        let (noise, file) = (Noise::of(&session), &session.files[0].1);
        let row = &file.rows[1];
        // 10 mV of 2 V: 1 % of the displacement, as its square; 0.5 % of the current. 30 and 40 nm are 50.
        assert!((noise.of_displacement(file, row) - 0.05).abs() < 1e-12);
        assert!((noise.of_current(0, file, row) - 15e-6_f64.hypot(5e-6)).abs() < 1e-12);
    }

    /// Stairs of one reading each, up and down, whose times nobody kept evenly.
    #[test]
    fn a_sweep_of_thirty_readings_shows_its_noise() {
        let mut session = sine(0.2, 6e-6);
        let rows = &mut session.files[0].1.rows;
        rows.truncate(30);
        for (index, row) in rows.iter_mut().enumerate() {
            let volts = 0.25 * index.min(30 - index) as f64;
            row.t_s = index as f64 + 0.05 * (7 * index % 5) as f64;
            row.voltage_v = [volts; ACTUATORS];
            let noise_um = row.z_um.expect("a reading") - 60.0 * (0.01 * TAU * index as f64).sin();
            row.z_um = Some(13.0 * volts * volts + noise_um);
        }
        let found_um = Noise::of(&session).displacement * DISPLACEMENT_UM;
        // The median of 22 differences is known to a third.
        assert!((found_um / 0.2 - 1.0).abs() < 0.34, "{found_um}");
    }

    #[test]
    fn a_few_rows_say_nothing() {
        let mut session = sine(0.1, 6e-6);
        session.files[0].1.rows.truncate(30);
        assert_eq!(noise(&session).0, 0.02);
        let told = assumed(&session).expect("nobody knows it");
        assert!(told.contains("20 nm are taken"), "{told}");
        session.files[0].1.keys.set("noise_z_nm", "30");
        assert_eq!(assumed(&session), None);
    }
}
