//! Zeros that a lost sensor or an open lead has read.

use crate::{ACTUATORS, Row};

/// A reading is large that is more than this part of the largest.
const LARGE: f64 = 0.1;

/// Empties readings of exactly 0 amid large ones while something drives, and says how many there were.
pub(super) fn readings(rows: &mut [Row], notes: &mut Vec<String>) {
    let z = empty(rows, "displacement", |row| &mut row.z_um);
    let currents = (0..ACTUATORS).filter_map(|actuator| {
        let name = format!("current {}", actuator + 1);
        empty(rows, &name, |row| &mut row.current_a[actuator])
    });
    let found: Vec<String> = currents.collect();
    notes.extend(z.into_iter().chain(found));
}

/// Where one is emptied the row before and the next that reads anything are large, or it is the first or the last that is driven.
fn empty(
    rows: &mut [Row],
    name: &str,
    of: impl Fn(&mut Row) -> &mut Option<f64>,
) -> Option<String> {
    let is_driven = |row: &Row| row.voltage_v.iter().any(|volts| *volts != 0.0);
    let readings: Vec<(bool, Option<f64>)> = rows
        .iter_mut()
        .map(|row| (is_driven(row), *of(row)))
        .collect();
    let largest = readings.iter().filter_map(|(_, value)| *value);
    let large = LARGE * largest.fold(0.0, |most: f64, value| most.max(value.abs()));
    // Whether the last reading that is not 0 is large, going either way; an end says nothing against it.
    let run = |readings: &mut dyn Iterator<Item = &(bool, Option<f64>)>| {
        let mut is_large = true;
        let mut run = Vec::with_capacity(rows.len());
        for (is_driven, value) in readings {
            match value {
                Some(value) if *value != 0.0 => is_large = value.abs() > large,
                Some(_) if !is_driven => is_large = false,
                _ => {}
            }
            run.push(is_large);
        }
        run
    };
    let before = run(&mut readings.iter());
    let after = run(&mut readings.iter().rev());
    let is_lost = |index: usize| {
        let (is_driven, value) = readings[index];
        is_driven && value == Some(0.0) && before[index] && after[rows.len() - 1 - index]
    };
    let lost: Vec<usize> = match large > 0.0 {
        true => (0..rows.len()).filter(|&index| is_lost(index)).collect(),
        false => Vec::new(),
    };
    lost.iter().for_each(|&index| *of(&mut rows[index]) = None);
    (!lost.is_empty()).then(|| {
        format!(
            "{} readings of exactly 0 of the {name} amid others are left out: the sensor or a lead was lost there",
            lost.len()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(readings: &[(f64, f64)]) -> Vec<Row> {
        let row = |&(volts, z): &(f64, f64)| Row {
            voltage_v: [volts; ACTUATORS],
            z_um: Some(z),
            ..Row::default()
        };
        readings.iter().map(row).collect()
    }

    #[test]
    fn zeros_amid_readings_are_lost_and_those_of_rest_are_not() {
        let mut sweep = rows(&[
            (0.0, 0.0),
            (0.1, 0.0),
            (1.0, 26.0),
            (2.0, 0.0),
            (2.5, 0.0),
            (3.0, 170.0),
            (0.0, 0.0),
        ]);
        let mut notes = Vec::new();
        readings(&mut sweep, &mut notes);
        let read: Vec<bool> = sweep.iter().map(|row| row.z_um.is_some()).collect();
        assert_eq!(read, [true, true, true, false, false, true, true]);
        assert!(
            notes[0].contains("2 readings of exactly 0 of the displacement"),
            "{notes:?}"
        );
    }

    #[test]
    fn the_last_reading_may_be_lost_and_a_sensor_that_never_read_is_not() {
        let mut notes = Vec::new();
        let mut ends = rows(&[(0.0, 0.0), (1.0, 26.0), (2.0, 90.0), (3.0, 0.0)]);
        readings(&mut ends, &mut notes);
        assert_eq!(ends[3].z_um, None);
        let mut never = rows(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]);
        readings(&mut never, &mut notes);
        assert!(never.iter().all(|row| row.z_um == Some(0.0)) && notes.len() == 1);
    }
}
