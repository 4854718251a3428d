//! What a board is asked for lies within its range, to the last digit. Nothing is asked of it where it does not.

use mirror_protocol::Status;

use crate::error::BeyondBoard;
use crate::quantity::{Length, Voltage};
use crate::report::decimal;

/// Whether a board in this state reaches a position.
///
/// # Errors
/// Where it does not.
pub(crate) fn check_position(asked: Length, status: &Status) -> Result<(), BeyondBoard> {
    let max = Length {
        um: decimal(status.max_position_um),
    };
    match (0.0..=max.um).contains(&asked.um) {
        true => Ok(()),
        false => Err(BeyondBoard::PositionOutOfRange { asked, max }),
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
        let drives = |v| check_drives([0.0, 3.5, v, 1.0].map(|v| Voltage { v }), &status);
        assert!(drives(3.5).is_ok());
        let told = drives(3.6).expect_err("above the highest").to_string();
        assert!(
            told.starts_with("3.6 V is beyond what this board drives"),
            "{told}"
        );
    }
}
