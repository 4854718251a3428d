//! Readings that stand at exactly one number while the drive moves: a sensor that froze, a meter at the end of its range.

use crate::column::Column;
use crate::error::Complaint;
use crate::plausibility::{Finding, moves};
use crate::{ACTUATORS, MeasurementFile};

/// Parts of the drive's range, of which a reading that stands still passes several: a choice.
const PARTS: f64 = 20.0;
/// Parts that a displacement stands still over, and numbers that the file has of it. So many are steps of less than a tenth of
/// what it moves, over which it stands still for two or three parts of the heating.
const FROZEN_PARTS: usize = 5;
const FROZEN_VALUES: usize = 10;
/// The same of a current, which grows ever less with the drive: steps of a twentieth, two or three parts of the drive.
const CLIPPED_PARTS: usize = 4;
const CLIPPED_VALUES: usize = 20;

/// A reading: its row, how far it was driven, and what was read.
type Reading = (usize, f64, f64);

/// The first column that stands still.
pub(crate) fn check(file: &MeasurementFile) -> Option<Finding> {
    frozen(file).or_else(|| (0..ACTUATORS).find_map(|actuator| clipped(file, actuator)))
}

/// A displacement that stays the same, row after row, over much of the heating.
fn frozen(file: &MeasurementFile) -> Option<Finding> {
    let rows = file.rows.iter().enumerate();
    let read = rows.filter_map(|(index, row)| Some((index, row.heating(), row.z_um?)));
    let read: Vec<Reading> = read.collect();
    let whole = range(&read);
    let mut runs = read.chunk_by(|a, b| a.2 == b.2);
    let run = runs.find(|run| parts(run, whole) >= FROZEN_PARTS)?;
    if values(&read) < FROZEN_VALUES || !moves(file) {
        return None;
    }
    let (row, _, z_um) = run[0];
    let complaint = Complaint::new(
        format!(
            "the sensor looks frozen: it stays at exactly {z_um} um for {} rows while the drive changes",
            run.len()
        ),
        "leave z_um empty where the sensor stood still, and see why it did",
    );
    Some((row, Column::Displacement, complaint))
}

/// A current that is exactly the highest one over much of the drive.
fn clipped(file: &MeasurementFile, actuator: usize) -> Option<Finding> {
    let rows = file.rows.iter().enumerate();
    let read = rows.filter_map(|(index, row)| {
        Some((index, row.voltage_v[actuator], row.current_a[actuator]?))
    });
    let read: Vec<Reading> = read.collect();
    let highest = read.iter().map(|reading| reading.2).fold(0.0, f64::max);
    let at_it = read.iter().filter(|reading| reading.2 == highest);
    let at_it: Vec<Reading> = at_it.copied().collect();
    let is_clipped = highest > 0.0
        && parts(&at_it, range(&read)) >= CLIPPED_PARTS
        && values(&read) >= CLIPPED_VALUES;
    let &(row, ..) = at_it.first().filter(|_| is_clipped)?;
    let complaint = Complaint::new(
        format!(
            "the current of actuator {} looks clipped: it is exactly {highest} A in {} rows while the drive changes",
            actuator + 1,
            at_it.len()
        ),
        "leave the cell empty where the meter was at the end of its range, or measure in a larger one",
    );
    Some((row, Column::Current(actuator), complaint))
}

/// The lowest and the highest drive.
fn range(read: &[Reading]) -> (f64, f64) {
    let drives = || read.iter().map(|reading| reading.1);
    let lowest = drives().fold(f64::INFINITY, f64::min);
    (lowest, drives().fold(f64::NEG_INFINITY, f64::max))
}

/// How many parts of the whole range some readings are driven in.
fn parts(read: &[Reading], (lowest, highest): (f64, f64)) -> usize {
    if read.len() < CLIPPED_PARTS || lowest >= highest {
        return 0;
    }
    let part = |reading: &Reading| (PARTS * (reading.1 - lowest) / (highest - lowest)) as usize;
    let mut parts: Vec<usize> = read.iter().map(part).collect();
    parts.sort_unstable();
    parts.dedup();
    parts.len()
}

/// How many different numbers were read.
fn values(read: &[Reading]) -> usize {
    let mut values: Vec<f64> = read.iter().map(|reading| reading.2).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values.len()
}

#[cfg(test)]
mod tests {
    use crate::MeasurementFile;

    /// A sweep up and down in steps of 0.1 V, with what a sensor and a meter make of displacement (um) and current (A).
    fn sweep(sensor: impl Fn(usize, f64) -> f64, meter: impl Fn(f64) -> f64) -> Result<(), String> {
        let mut text = String::from("t_s,V_V,z_um,I1_A\n");
        for n in 0..70 {
            let volts = 0.1 * (35 - (n as i32 - 35).abs()) as f64;
            let (z_um, amperes) = (20.0 * volts * volts, volts / (350.0 + 70.0 * volts));
            text += &format!("{n},{volts},{},{}\n", sensor(n, z_um), meter(amperes));
        }
        let read = MeasurementFile::parse("sweep.csv", &text);
        read.map(drop).map_err(|error| error.to_string())
    }

    #[test]
    fn a_sensor_that_freezes_is_told() {
        let sensor = |n, z_um| if n >= 45 { 125.0 } else { z_um };
        let said = sweep(sensor, |amperes| amperes).expect_err("frozen");
        assert!(
            said.contains("sweep.csv:47: the sensor looks frozen"),
            "{said}"
        );
    }

    #[test]
    fn a_meter_at_the_end_of_its_range_is_told() {
        let said = sweep(|_, z_um| z_um, |amperes| amperes.min(5e-3)).expect_err("clipped");
        assert!(
            said.contains("the current of actuator 1 looks clipped: it is exactly 0.005 A"),
            "{said}"
        );
    }

    #[test]
    fn coarse_readings_are_none_of_both() {
        for (z_step, a_step) in [(1.0, 1e-4), (10.0, 2.5e-4), (25.0, 1e-3), (25.0, 3e-3)] {
            let rounded = |value: f64, step: f64| step * (value / step).round();
            let read = sweep(
                |_, z_um| rounded(z_um, z_step),
                |amperes| rounded(amperes, a_step),
            );
            assert_eq!(read, Ok(()), "{z_step} um, {a_step} A");
        }
    }
}
