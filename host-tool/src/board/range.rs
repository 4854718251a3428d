//! What a board is asked for lies within its range, to the last digit. Nothing is asked of it where it does not.

use mirror_protocol::{Health, Status};
use quantities::{Length, Voltage};

use crate::error::BeyondBoard;
use crate::report::decimal;

/// Whether a board in this state reaches a position.
///
/// # Errors
/// Where it does not.
pub(crate) fn check_position(asked: Length, status: &Status) -> Result<(), BeyondBoard> {
    check_piston(asked, level_um(status))
}

/// Whether a position lies between where a level plate rests in the present room and its highest position (um).
///
/// # Errors
/// Where it does not.
pub(crate) fn check_piston(
    asked: Length,
    (low_um, high_um): (f64, f64),
) -> Result<(), BeyondBoard> {
    let (lowest, max) = (Length { um: low_um }, Length { um: high_um });
    if !(0.0..=high_um).contains(&asked.um) {
        return Err(BeyondBoard::PositionOutOfRange { asked, max });
    }
    match asked.um < low_um {
        true => Err(BeyondBoard::PositionBelowRoom { asked, lowest }),
        false => Ok(()),
    }
}

/// From the lowest to the highest position of a level plate under the calibration in use, in the present room (um).
pub(crate) fn level_um(status: &Status) -> (f64, f64) {
    (lowest_um(&status.health), decimal(status.max_position_um))
}

/// Where the range begins, as the board knows its room (um). What is not far from rest is not refused: so far off a position may be in
/// any room (`docs/requirements.md`).
pub(crate) fn lowest_um(health: &Health) -> f64 {
    const ALLOWED_UM: f64 = 0.5;
    match decimal(health.lowest_position_um) {
        um if um > ALLOWED_UM => um,
        _ => 0.0,
    }
}

/// Whether it gives these voltages.
///
/// # Errors
/// Where it does not: the first that it does not give.
pub(crate) fn check_drives(asked: [Voltage; 4], status: &Status) -> Result<(), BeyondBoard> {
    let max = Voltage {
        v: decimal(status.max_drive_v),
    };
    let outside = asked.into_iter().find(|v| !(0.0..=max.v).contains(&v.v));
    match outside {
        None => Ok(()),
        Some(asked) => Err(BeyondBoard::DriveOutOfRange { asked, max }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::tests::status;
    use mirror_protocol::Telemetry;

    #[test]
    fn both_ends_are_within_and_what_is_no_number_is_not() {
        let status = status(Telemetry::default());
        let at = |um| check_position(Length { um }, &status);
        for um in [0.0, 170.0] {
            assert!(at(um).is_ok(), "{um}");
        }
        for um in [-1e-9, 170.001, f64::NAN] {
            assert!(at(um).is_err(), "{um}");
        }
        let mut warm = status.clone();
        warm.health.lowest_position_um = 18.25;
        let told = check_position(Length { um: 5.0 }, &warm).expect_err("a heater cannot cool");
        assert!(told.to_string().contains("rests at 18.25 um"), "{told}");
        assert!(check_position(Length { um: 18.25 }, &warm).is_ok());
        // What a position may be off by in any room.
        warm.health.lowest_position_um = 0.4;
        assert!(check_position(Length { um: 0.0 }, &warm).is_ok());
        let drives = |v| check_drives([0.0, 3.5, v, 1.0].map(|v| Voltage { v }), &status);
        assert!(drives(3.5).is_ok());
        let told = drives(3.6).expect_err("above the highest").to_string();
        assert!(
            told.starts_with("3.6 V is beyond what this board drives"),
            "{told}"
        );
    }
}
