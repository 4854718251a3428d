//! The header line: which columns there are, and which must be.

use crate::ACTUATORS;
use crate::column::Column;
use crate::error::Complaint;

/// Whether these columns have no time at all: then each row is a settled reading.
pub(crate) fn is_timeless(columns: &[Column]) -> bool {
    !columns.contains(&Column::Time)
}

/// What is wrong with these columns taken together.
pub(crate) fn missing(columns: &[Column]) -> Option<Complaint> {
    let has = |column| columns.contains(&column);
    if !has(Column::Time) && has(Column::GlobalTime) {
        return Some(Complaint::new(
            "the column t_s is missing",
            "add the time of each row since the file's start, in seconds; where each row is a settled reading, leave both \
             times out",
        ));
    }
    let each = (0..ACTUATORS)
        .filter(|&actuator| has(Column::Voltage(actuator)))
        .count();
    if each == 0 && !has(Column::VoltageOfAll) {
        return Some(Complaint::new(
            "the drive is missing",
            "add V_V, or V1_V to V4_V, in volts",
        ));
    }
    if each != 0 && has(Column::VoltageOfAll) {
        return Some(Complaint::new(
            "V_V stands beside the single actuators' voltages",
            "give either V_V or V1_V to V4_V",
        ));
    }
    if each != 0 && each != ACTUATORS {
        let absent = (0..ACTUATORS)
            .find(|&actuator| !has(Column::Voltage(actuator)))
            .unwrap_or(0)
            + 1;
        return Some(Complaint::new(
            format!("the column V{absent}_V is missing"),
            "give all of V1_V to V4_V, or V_V alone",
        ));
    }
    if has(Column::CurrentOfEach) && (0..ACTUATORS).any(|actuator| has(Column::Current(actuator))) {
        return Some(Complaint::new(
            "I_A stands beside the single actuators' currents",
            "give either I_A or I1_A to I4_A",
        ));
    }
    None
}
