//! Calibration files that a user names.

use std::path::Path;

use control_core::{CHANNELS, Calibration};
use mirror_protocol::{CalibrationInfo, Lever};

use crate::board::Board;
use crate::error::{ToolError, UnusableInput};

/// The calibration in a file.
///
/// # Errors
/// Where it cannot be read.
pub(super) fn load(file: &Path) -> Result<Calibration, ToolError> {
    let text = input_file::read_text(file, input_file::MOST_WRITTEN)?;
    Ok(calibration::from_toml(&file.display().to_string(), &text)?)
}

/// The calibration in a file, which the board uses.
///
/// # Errors
/// Where it cannot be read, or the board uses another.
pub(super) async fn load_in_use(board: &Board, file: &Path) -> Result<Calibration, ToolError> {
    let calibration = load(file)?;
    match says(&board.calibration().await?, &calibration) {
        true => Ok(calibration),
        false => Err(UnusableInput::OtherCalibration {
            file: file.to_owned(),
        }
        .into()),
    }
}

/// Whether what a board says of its calibration is so of this one. Where it comes from does not tell: one with tilts comes from where the one
/// without them does.
fn says(info: &CalibrationInfo, calibration: &Calibration) -> bool {
    let parts = calibration.parts();
    let origin = &parts.origin;
    info.model_hash == origin.model_hash
        && info.device.as_str() == origin.device.as_str()
        && info.date.as_str() == origin.date.as_str()
        && info.levers == told_levers(calibration)
        && info.max_position_um == calibration.max_position().0
        && info.tcr_per_k == parts.actuators.each_ref().map(|it| it.tcr.0)
}

/// Its levers as a board tells them.
fn told_levers(calibration: &Calibration) -> [Lever; CHANNELS] {
    calibration.parts().plate.levers.map(|lever| Lever {
        x_um: lever.x.0,
        y_um: lever.y.0,
        warp: lever.warp,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibration::with_assumed_levers;
    use control_core::calibration::Parts;
    use mirror_protocol::{Kept, Text};

    /// As a board tells it.
    fn info(calibration: &Calibration) -> CalibrationInfo {
        let parts = calibration.parts();
        let text = |text: &str| Text::try_from(text).expect("short");
        CalibrationInfo {
            device: text(parts.origin.device.as_str()),
            date: text(parts.origin.date.as_str()),
            model_hash: parts.origin.model_hash,
            max_position_um: calibration.max_position().0,
            max_drive_v: calibration.max_drive().0,
            cold_resistance_ohm: parts.actuators.each_ref().map(|it| it.cold_resistance.0),
            tcr_per_k: parts.actuators.each_ref().map(|it| it.tcr.0),
            levers: told_levers(calibration),
            kept: Kept::Yes,
        }
    }

    #[test]
    fn a_calibration_of_tilts_is_another_than_the_one_that_it_was_made_from() {
        const FILE: &str = include_str!("../../../hil/tests/mirror-77.toml");
        let level = calibration::from_toml("mirror-77.toml", FILE).expect("a calibration");
        let tilting = with_assumed_levers(&level);
        let mut parts: Parts = *tilting.parts();
        parts.actuators[2].tcr.0 *= 1.01;
        let again = Calibration::new(parts).expect("a mirror can have it");
        for (one, calibration) in [level, tilting, again].iter().enumerate() {
            for (other, used) in [level, tilting, again].iter().enumerate() {
                assert_eq!(says(&info(used), calibration), one == other);
            }
        }
    }
}
