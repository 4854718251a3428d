//! What a board is asked for lies within its range, to the last digit. Nothing is asked of it where it does not.

use calibration::Reach;
use mirror_protocol::{Health, Status};
use quantities::{Length, Voltage};

use crate::error::BeyondBoard;
use crate::report::decimal;
use crate::rounding::nanometres_within;

/// So far (um) may what is asked for lie below where the mirror rests in the present room, and the actuators of a pose beyond what holds them
/// there: so far off a position may be in any room
/// (`docs/requirements.md`), and what a board knows of its room is never the same twice. The board takes it to where it rests.
const BELOW_REST_UM: f64 = 0.5;

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
/// Where it does not, by more than half a micrometre at the lower end.
pub(crate) fn check_piston(
    asked: Length,
    (low_um, high_um): (f64, f64),
) -> Result<(), BeyondBoard> {
    let [lowest, max] = [
        nanometres_within(low_um, f64::ceil),
        nanometres_within(high_um, f64::floor),
    ];
    if !(0.0..=high_um).contains(&asked.um) {
        return Err(BeyondBoard::PositionOutOfRange { asked, max });
    }
    match asked.um < low_um - BELOW_REST_UM {
        true => Err(BeyondBoard::PositionBelowRoom { asked, lowest }),
        false => Ok(()),
    }
}

/// What a mirror of this reach is asked for without a word: what it reaches, and what is hardly beyond that.
pub(crate) fn hardly_beyond(reach: &Reach) -> Reach {
    reach.clone().bearing(BELOW_REST_UM)
}

/// From the lowest to the highest position of a level plate under the calibration in use, in the present room (um).
pub(crate) fn level_um(status: &Status) -> (f64, f64) {
    (lowest_um(&status.health), decimal(status.max_position_um))
}

/// Where the range begins, as the board knows its room (um); at rest where that is as good.
pub(crate) fn lowest_um(health: &Health) -> f64 {
    match decimal(health.lowest_position_um) {
        um if um > BELOW_REST_UM => um,
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
        warm.health.lowest_position_um = 2.669_087_4;
        warm.max_position_um = 146.724_58;
        for (um, end) in [(0.0, "2.67 um"), (150.0, "146.724 um")] {
            let told = check_position(Length { um }, &warm).expect_err("beyond");
            assert!(told.to_string().contains(end), "{told}");
        }
        warm = status.clone();
        warm.health.lowest_position_um = 18.25;
        // Half a micrometre below is as good as there.
        assert!(check_position(Length { um: 17.76 }, &warm).is_ok());
        assert!(check_position(Length { um: 17.74 }, &warm).is_err());
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
