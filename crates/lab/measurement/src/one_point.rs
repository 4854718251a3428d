//! Sessions of one operating point, of which nothing can be fitted.

use crate::{ACTUATORS, InputError, Row, Session};

/// A drive that was read off a meter scatters by less than this part of itself: half of a hand-held one's tolerance.
const SCATTER: f64 = 0.01;
/// So many readings tell whether they move.
const FEWEST: usize = 8;
/// The mean square of successive differences over the variance is 2 for readings that scatter alone, and tends to 0 for those that
/// move (J. von Neumann, Annals of Mathematical Statistics 12, 1941, p. 367). Halfway: a choice.
const MOVING: f64 = 1.0;

impl Session {
    /// Refuses a session of one operating point: one drive, at which nothing moves any more. Every parameter is free there to make up
    /// for every other.
    ///
    /// # Errors
    /// [`InputError::OnePoint`].
    pub fn check_points(&self) -> Result<(), InputError> {
        let rows = || self.files.iter().flat_map(|(_, file)| &file.rows);
        let is_one = (0..ACTUATORS).all(|actuator| {
            let (lowest, highest) = span(rows().map(|row| row.voltage_v[actuator]));
            highest - lowest <= SCATTER * highest.abs().max(lowest.abs())
        });
        let is_same = |of: fn(&Row) -> Option<f64>| {
            let (lowest, highest) = span(rows().filter_map(of));
            lowest >= highest
        };
        let is_moving = self.files.iter().any(|(_, file)| {
            let z = file.rows.iter().filter_map(|row| row.z_um);
            let current = |actuator: usize| {
                let rows = file.rows.iter();
                rows.filter_map(move |row| row.current_a[actuator])
                    .collect()
            };
            let mut columns = (0..ACTUATORS).map(current).chain([z.collect::<Vec<f64>>()]);
            !file.keys.is_steady() && columns.any(|readings| moves(&readings))
        });
        if !is_one || is_moving || !is_same(|row| row.ambient_c) || !is_same(|row| row.reference_um)
        {
            return Ok(());
        }
        let mut driven: Vec<f64> = rows().take(1).flat_map(|row| row.voltage_v).collect();
        driven.dedup();
        let volts: Vec<String> = driven.iter().map(|volts| format!("{volts} V")).collect();
        Err(InputError::OnePoint {
            drive: volts.join(", "),
        })
    }
}

/// The lowest and the highest of some numbers.
fn span(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    numbers.fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(lowest, highest), number| (lowest.min(number), highest.max(number)),
    )
}

/// Whether readings, in the order of time, do more than scatter.
fn moves(readings: &[f64]) -> bool {
    let (lowest, highest) = span(readings.iter().copied());
    if lowest >= highest || readings.len() < FEWEST {
        return lowest < highest;
    }
    let mean = readings.iter().sum::<f64>() / readings.len() as f64;
    let variance: f64 = readings
        .iter()
        .map(|reading| (reading - mean).powi(2))
        .sum();
    let steps: f64 = readings
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).powi(2))
        .sum();
    steps < MOVING * variance
}

#[cfg(test)]
mod tests {
    use crate::{MeasurementFile, Session};

    fn is_refused(text: &str) -> bool {
        let file = MeasurementFile::parse("one.csv", text).expect("readable");
        let session = Session {
            files: vec![("one.csv".into(), file)],
        };
        session.check_points().is_err()
    }

    #[test]
    fn one_drive_at_which_nothing_moves_is_one_point() {
        let rows = |of: fn(usize) -> String| (0..30).map(of).collect::<String>();
        let timed = "t_s,V_V,I_A,z_um\n";
        assert!(is_refused(&format!(
            "{timed}{}",
            rows(|n| format!("{n},2.0,0.00469,70.4\n"))
        )));
        // A meter and a sensor that scatter.
        let scatter = rows(|n| {
            format!(
                "{n},{},0.00469,{}\n",
                2.0 + 0.001 * (n % 3) as f64,
                70.4 + 0.01 * (n % 2) as f64
            )
        });
        assert!(is_refused(&format!("{timed}{scatter}")));
        assert!(is_refused("V_V,z_um\n2,70.1\n2,70.2\n"));
        // A step, a second drive, and an oven tell more.
        let step = rows(|n| {
            format!(
                "{n},2.0,0.00469,{}\n",
                70.4 * (1.0 - (-(n as f64) / 9.0).exp())
            )
        });
        assert!(!is_refused(&format!("{timed}{step}")));
        assert!(!is_refused("V_V,z_um\n2,70.1\n2.1,73\n"));
        assert!(!is_refused("V_V,z_um,T_ambient_C\n2,70.1,20\n2,65,60\n"));
    }
}
