//! Actuators whose drive no column tells.

use super::assignment::Assignment;
use super::error::ImportError;
use crate::column::Column;
use crate::{ACTUATORS, Row};

/// A current that is a smaller part of the highest is an offset of the meter, or leaks.
const NONE: f64 = 0.1;

/// That they are taken for off, where columns tell the drives of others.
///
/// # Errors
/// Where a current flows through one of them.
pub(super) fn drives(
    assignments: &[Assignment],
    rows: &[Row],
    notes: &mut Vec<String>,
) -> Result<(), ImportError> {
    let drive_of = |actuator: usize| {
        let is_it = |a: &&Assignment| {
            a.column == Column::Voltage(actuator) || a.column == Column::VoltageOfAll
        };
        assignments.iter().find(is_it)
    };
    let untold: Vec<usize> = (0..ACTUATORS).filter(|&i| drive_of(i).is_none()).collect();
    let Some(told) = (0..ACTUATORS).find_map(|i| Some((i, drive_of(i)?))) else {
        return Ok(());
    };
    if untold.is_empty() {
        return Ok(());
    }
    let highest_a = |actuator: usize| {
        let currents = rows.iter().filter_map(|row| row.current_a[actuator]);
        currents.map(f64::abs).fold(0.0, f64::max)
    };
    let most_a = (0..ACTUATORS).map(highest_a).fold(0.0, f64::max);
    let flowing = untold.iter().find(|&&i| highest_a(i) > NONE * most_a);
    if let Some(&actuator) = flowing {
        return Err(flows(assignments, told, actuator, highest_a(actuator)));
    }
    let numbers: Vec<String> = untold.iter().map(|i| (i + 1).to_string()).collect();
    notes.push(format!(
        "no column tells what drives actuator {}: each is taken for off. Where one voltage drives all four, say --column V={}",
        numbers.join(", "),
        told.1.source + 1
    ));
    Ok(())
}

/// That so much flows through an actuator whose drive is not told, where another's is.
fn flows(
    assignments: &[Assignment],
    (told, drive): (usize, &Assignment),
    actuator: usize,
    highest_a: f64,
) -> ImportError {
    let of_each = assignments
        .iter()
        .find(|a| a.column == Column::CurrentOfEach);
    let other = match of_each {
        Some(current) => format!(
            "or whose current it is, --column I{}={}",
            told + 1,
            current.source + 1
        ),
        None => format!(
            "or which drives this one, --column V{}=NUMBER",
            actuator + 1
        ),
    };
    ImportError::new(
        format!(
            "through actuator {} flow up to {:.3} mA, and no column tells what drives it",
            actuator + 1,
            1e3 * highest_a
        ),
        format!(
            "say which voltage drives all four, --column V={}, {other}",
            drive.source + 1
        ),
    )
}
