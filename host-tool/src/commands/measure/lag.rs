//! A sensor's own lag, taken out of what it read.

use experiments::Reading;
use measurement::{MeasurementFile, Row};

/// Gives each row the displacement that the sensor told so long after it (s), on a straight line between two readings. The
/// rows at the end, whose displacement was not told any more, stay without.
///
/// At the end of a dwell the mirror rests, and what was read is what it is.
pub(super) fn take_out(lag_s: f64, reading: Reading, file: &mut MeasurementFile) {
    if lag_s == 0.0 || reading == Reading::EndOfDwell {
        return;
    }
    file.keys.set("sensor_lag_s", &lag_s.to_string());
    let time_s = |row: &Row| row.t_global_s.unwrap_or(row.t_s);
    let told: Vec<(f64, Option<f64>)> = file
        .rows
        .iter()
        .map(|row| (time_s(row), row.z_um))
        .collect();
    for row in &mut file.rows {
        let at_s = time_s(row) + lag_s;
        let after = told.partition_point(|(t_s, _)| *t_s < at_s);
        let pair = after
            .checked_sub(1)
            .and_then(|before| told.get(before..=after));
        row.z_um = match pair {
            Some(&[(from_s, Some(from_um)), (to_s, Some(to_um))]) => {
                Some(from_um + (at_s - from_s) / (to_s - from_s) * (to_um - from_um))
            }
            _ => None,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn file(z_um: impl Iterator<Item = Option<f64>>) -> MeasurementFile {
        MeasurementFile {
            rows: z_um
                .enumerate()
                .map(|(index, z_um)| Row {
                    t_s: index as f64 * 1e-3,
                    z_um,
                    ..Row::default()
                })
                .collect(),
            ..MeasurementFile::default()
        }
    }

    const EVENLY: Reading = Reading::Evenly { readings: 100 };

    proptest! {
        /// A mirror that moves at a constant rate, seen late.
        #[test]
        fn a_late_sensor_comes_to_what_was(lag_ms in 0.1_f64..20.0, rate in -50.0_f64..50.0) {
            let was = |t_ms: f64| rate * t_ms;
            let mut file = file((0..100).map(|t_ms| Some(was(f64::from(t_ms) - lag_ms))));
            take_out(lag_ms * 1e-3, EVENLY, &mut file);
            let told = file.rows.iter().filter(|row| row.z_um.is_some()).count();
            prop_assert_eq!(told, 100 - lag_ms.ceil() as usize);
            for row in file.rows.iter().take(told) {
                prop_assert!((row.z_um.unwrap() - was(row.t_s * 1e3)).abs() < 1e-6);
            }
            let told_s = file.keys.get("sensor_lag_s").map(str::parse);
            prop_assert_eq!(told_s, Some(Ok(lag_ms * 1e-3)));
        }
    }

    #[test]
    fn nothing_is_made_of_a_missing_reading_and_nothing_changes_at_rest() {
        let missing =
            || file([Some(1.0), Some(2.0), None, Some(4.0), Some(5.0), Some(6.0)].into_iter());
        let mut late = missing();
        take_out(0.5e-3, EVENLY, &mut late);
        let z_um: Vec<_> = late.rows.iter().map(|row| row.z_um).collect();
        assert_eq!(z_um.len(), 6);
        assert_eq!([z_um[1], z_um[2], z_um[5]], [None; 3]);
        assert!((z_um[0].unwrap() - 1.5).abs() < 1e-9 && (z_um[4].unwrap() - 5.5).abs() < 1e-9);
        let mut resting = missing();
        take_out(0.5e-3, Reading::EndOfDwell, &mut resting);
        assert_eq!(resting, missing());
    }
}
