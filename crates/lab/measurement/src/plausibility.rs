//! Values that are numbers but cannot be right: another unit than the column's name says, a wrong sign, a sensor at its
//! end stop.
//!
//! The checks know the size of such mirrors: heaters of hundreds of ohms (unless the model or the key `R0_ohm` says
//! otherwise), strokes of tens to hundreds of micrometres at some volts.

use crate::column::Column;
use crate::correlation::correlation;
use crate::error::Complaint;
use crate::{ACTUATORS, MeasurementFile};
use std::ops::RangeInclusive;

/// A drive below this tells little about a resistance or a stroke (V): some milliwatts, a micrometre.
const TELLING_DRIVE_V: f64 = 0.5;
/// A voltmeter may read this part more than was driven: the tolerance of a hand-held one.
const CALIBRATION: f64 = 0.02;
/// A heater that takes less than this part of the current that is expected takes none: known is it within a factor of ten.
const OPEN: f64 = 0.01;
/// Surroundings that a mirror is measured in, a climate chamber's range (degC), and what looks like them in kelvins.
const AMBIENT_C: RangeInclusive<f64> = -80.0..=200.0;
const KELVINS: RangeInclusive<f64> = 200.0..=475.0;
/// No heater on a bench takes more (A): a choice, above what a supply on a bench gives.
const MOST_A: f64 = 1e3;
/// No measurement is longer (s): 30 years, a choice; seconds since 1970 are more.
const LONGEST_S: f64 = 1e9;
/// From so many readings on their correlation with the drive tells whether it moves what they read. Noise alone comes to
/// more than so many times the correlation's standard deviation, 1 over the root of their number, once in a million files.
const TELLING_READINGS: usize = 30;
const TELLING_CORRELATION: f64 = 5.0;
/// So many rows at the same extreme reading while the drive changes are an end stop.
const SATURATED_ROWS: usize = 3;

/// What is known of what was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Device {
    /// The highest drive that it takes (V). A displacement at a higher one is not its.
    pub highest_v: f64,
    /// The resistance of its cold heater, within a factor of ten (ohm). A file's own `R0_ohm` takes precedence.
    pub cold_ohm: f64,
}

impl Default for Device {
    /// One of these mirrors, driven as high as one likes.
    fn default() -> Self {
        Self {
            highest_v: f64::INFINITY,
            cold_ohm: 360.0,
        }
    }
}

pub(crate) type Finding = (usize, Column, Complaint);

/// The first implausible thing of a file: row, column, complaint.
pub(crate) fn check(file: &MeasurementFile, device: &Device) -> Option<Finding> {
    voltage_in_millivolts(file)
        .or_else(|| voltage_beyond(file, device.highest_v))
        .or_else(|| (0..ACTUATORS).find_map(|actuator| current(file, actuator, device.cold_ohm)))
        .or_else(|| current_beyond(file))
        .or_else(|| time_beyond(file))
        .or_else(|| displacement_unit(file))
        .or_else(|| reference_unit(file))
        .or_else(|| ambient(file))
        .or_else(|| saturation(file))
}

fn voltage_in_millivolts(file: &MeasurementFile) -> Option<Finding> {
    let (row, actuator) = file.rows.iter().enumerate().find_map(|(index, row)| {
        row.voltage_v
            .iter()
            .position(|v| v.abs() > 250.0)
            .map(|actuator| (index, actuator))
    })?;
    let complaint = Complaint::new(
        format!(
            "a drive of {} V looks like mV",
            file.rows[row].voltage_v[actuator]
        ),
        "voltages are in V; divide by 1000",
    );
    Some((row, Column::Voltage(actuator), complaint))
}

/// A drive that this mirror does not take. A heater whose displacement is not measured may be any heater.
fn voltage_beyond(file: &MeasurementFile, highest_v: f64) -> Option<Finding> {
    let (row, actuator) = file.rows.iter().enumerate().find_map(|(index, row)| {
        row.z_um?;
        let beyond = |v: &f64| v.abs() > highest_v * (1.0 + CALIBRATION);
        Some((index, row.voltage_v.iter().position(beyond)?))
    })?;
    let complaint = Complaint::new(
        format!(
            "a drive of {} V is beyond the model's range, which ends at {highest_v} V",
            file.rows[row].voltage_v[actuator]
        ),
        "leave such rows out, or say `V_max` in the model file if the mirror takes more",
    );
    Some((row, Column::Voltage(actuator), complaint))
}

fn current(file: &MeasurementFile, actuator: usize, cold_ohm: f64) -> Option<Finding> {
    let driven: Vec<(usize, f64)> = file
        .rows
        .iter()
        .enumerate()
        .filter(|(_, row)| row.voltage_v[actuator].abs() >= TELLING_DRIVE_V)
        .filter_map(|(index, row)| {
            Some((index, row.current_a[actuator]? / row.voltage_v[actuator]))
        })
        .collect();
    let (first, _) = *driven.first()?;
    let conductance = median(driven.iter().map(|&(_, siemens)| siemens).collect());
    let value = file.rows[first].current_a[actuator].unwrap_or_default();
    let found = |complaint| Some((first, Column::Current(actuator), complaint));
    let nominal = file.keys.nominal_resistance_ohm().unwrap_or(cold_ohm);
    if conductance.abs() * nominal < OPEN {
        return found(Complaint::new(
            format!(
                "actuator {} is driven, up to {:.3} V, and carries no current",
                actuator + 1,
                highest_drive(file, actuator)
            ),
            "leave the column's cells empty if its current was not read; if its heater is open, write 0 V as its drive",
        ));
    }
    if conductance < 0.0 {
        return found(Complaint::new(
            format!(
                "the current of actuator {} has the wrong sign: {value} A at {} V",
                actuator + 1,
                file.rows[first].voltage_v[actuator]
            ),
            "currents are positive where the voltage is; change the sign of the column",
        ));
    }
    for (unit, factor) in [("mA", 1e3), ("uA", 1e6)] {
        let resistance = factor / conductance;
        if (0.1 * nominal..10.0 * nominal).contains(&resistance) {
            return found(Complaint::new(
                format!(
                    "a current of {value} A looks like {unit}: in A the heater would have {:.3} ohm",
                    1.0 / conductance
                ),
                format!(
                    "currents are in A; divide by {factor:.0}. If the heater is so, say R0 in the model file, or '# R0_ohm=...' in this one"
                ),
            ));
        }
    }
    None
}

/// The highest drive of an actuator (V).
fn highest_drive(file: &MeasurementFile, actuator: usize) -> f64 {
    let drives = file.rows.iter().map(|row| row.voltage_v[actuator].abs());
    drives.fold(0.0, f64::max)
}

fn current_beyond(file: &MeasurementFile) -> Option<Finding> {
    let columns = (0..ACTUATORS).map(Column::Current);
    let (row, column, amperes) = beyond(file, columns, MOST_A)?;
    let complaint = Complaint::new(
        format!("no heater takes a current of {amperes:e} A"),
        "currents are in A; leave the cell empty where none was read",
    );
    Some((row, column, complaint))
}

fn time_beyond(file: &MeasurementFile) -> Option<Finding> {
    let columns = [Column::Time, Column::GlobalTime];
    let (row, column, seconds) = beyond(file, columns, LONGEST_S)?;
    let complaint = Complaint::new(
        format!("a time of {seconds:e} s is longer than any measurement"),
        "times are in s from the file's start; a date or a counter's ticks are none",
    );
    Some((row, column, complaint))
}

/// The row and largest value of the first of these columns that is beyond `most`, either way.
fn beyond(
    file: &MeasurementFile,
    columns: impl IntoIterator<Item = Column>,
    most: f64,
) -> Option<(usize, Column, f64)> {
    columns.into_iter().find_map(|column| {
        let (row, value) = largest(file, column)?;
        (value.abs() > most).then_some((row, column, value))
    })
}

fn displacement_unit(file: &MeasurementFile) -> Option<Finding> {
    let (row, largest) = largest(file, Column::Displacement)?;
    let (unit, factor) = unit_of_length(largest, moves(file))?;
    let complaint = Complaint::new(
        format!("a largest displacement of {largest} um looks like {unit}"),
        format!("displacements are in um; {factor}"),
    );
    Some((row, Column::Displacement, complaint))
}

/// Whether the drive moves what the sensor reads: on resistors, or past the mirror, it reads its noise.
pub(crate) fn moves(file: &MeasurementFile) -> bool {
    let pairs: Vec<(f64, f64)> = file
        .rows
        .iter()
        .filter_map(|row| Some((row.heating(), row.z_um?)))
        .collect();
    let is_driven = pairs.iter().any(|(square, _)| *square >= 1.0);
    if pairs.len() < TELLING_READINGS {
        return is_driven;
    }
    // Where nothing changes it says nothing.
    let is_noise = correlation(&pairs).is_some_and(|correlation| {
        correlation.abs() * (pairs.len() as f64).sqrt() <= TELLING_CORRELATION
    });
    is_driven && !is_noise
}

/// Who moves a stage for a reference moves it by micrometres.
fn reference_unit(file: &MeasurementFile) -> Option<Finding> {
    let (row, largest) = largest(file, Column::Reference)?;
    let (unit, factor) = unit_of_length(largest, true)?;
    let complaint = Complaint::new(
        format!("a largest reference of {largest} um looks like {unit}"),
        format!("what a stage moves is in um; {factor}"),
    );
    Some((row, Column::Reference, complaint))
}

/// The value of a column that is farthest from 0, with its row.
fn largest(file: &MeasurementFile, column: Column) -> Option<(usize, f64)> {
    file.rows
        .iter()
        .enumerate()
        .filter_map(|(index, row)| Some((index, column.value(row)?)))
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
}

/// The unit that a largest length was probably written in, and what to do; a small one is telling where something `moved`.
fn unit_of_length(largest: f64, moved: bool) -> Option<(&'static str, &'static str)> {
    match largest.abs() {
        size if moved && size > 0.0 && size < 1e-3 => Some(("m", "multiply by 1e6")),
        size if moved && size > 0.0 && size < 0.5 => Some(("mm", "multiply by 1000")),
        size if size > 2e3 => Some(("nm", "divide by 1000")),
        _ => None,
    }
}

fn ambient(file: &MeasurementFile) -> Option<Finding> {
    let (row, celsius) = file
        .rows
        .iter()
        .enumerate()
        .filter_map(|(index, row)| Some((index, row.ambient_c?)))
        .find(|(_, celsius)| !AMBIENT_C.contains(celsius))?;
    let complaint = if KELVINS.contains(&celsius) {
        Complaint::new(
            format!("surroundings at {celsius} degrees Celsius look like kelvins"),
            "T_ambient_C is in degrees Celsius; subtract 273.15",
        )
    } else {
        Complaint::new(
            format!(
                "surroundings at {celsius} degrees Celsius are no room and no oven for a mirror"
            ),
            format!(
                "T_ambient_C is in degrees Celsius, from {} to {}; leave it empty where it was not measured",
                AMBIENT_C.start(),
                AMBIENT_C.end()
            ),
        )
    };
    Some((row, Column::Ambient, complaint))
}

/// A reading that repeats its extreme exactly, row after row, while the drive goes on.
fn saturation(file: &MeasurementFile) -> Option<Finding> {
    let measured: Vec<(usize, f64)> = file
        .rows
        .iter()
        .enumerate()
        .filter_map(|(index, row)| Some((index, row.z_um?)))
        .collect();
    let highest = measured
        .iter()
        .map(|&(_, z)| z)
        .fold(f64::NEG_INFINITY, f64::max);
    if highest <= 1.0 {
        return None;
    }
    let run = measured.windows(SATURATED_ROWS).find(|run| {
        let drives = || run.iter().map(|&(index, _)| file.rows[index].voltage_v);
        run.iter().all(|&(_, z)| z == highest)
            && drives().zip(drives().skip(1)).all(|(a, b)| a != b)
    })?;
    let complaint = Complaint::new(
        format!(
            "the sensor looks saturated: it stays at exactly {highest} um while the drive changes"
        ),
        "leave z_um empty where the sensor was at its end, or measure with the sensor further away",
    );
    Some((run[0].0, Column::Displacement, complaint))
}

/// The median of some numbers, the upper one of two in the middle.
///
/// # Panics
/// Where there are none.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The median of values, and that of their distances from it: the median absolute deviation.
///
/// # Panics
/// Where there are none.
pub fn median_and_deviation(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let middle = median(values.clone().collect());
    let distances = values.map(|value| (value - middle).abs());
    (middle, median(distances.collect()))
}
