//! `load-calibration`: a calibration that `calibrate -o` wrote, on the board again, or on another.

use std::fmt;
use std::path::Path;

use control_core::Calibration;
use control_core::shape::KNOTS;
use mirror_protocol::CalibrationUse;
use serde::Serialize;

use super::{calibration_file, same_mirror};
use crate::board::Board;
use crate::commands::calibrate_sense;
use crate::commands::interrupt::Interrupt;
use crate::commands::status::calibrated_words;
use crate::error::ToolError;
use crate::report::{self, decimal};
use crate::verbosity::say;

/// By what factor the reach of a kelvin may differ between two calibrations of a mirror: more than rooms, age and a better model make of
/// it, and less than a digit mistyped. A choice.
const ALIKE: f32 = 1.5;

#[derive(Serialize)]
struct LoadedCalibration {
    calibration: String,
    /// The one that the board had.
    before: String,
    max_position_um: f64,
}

/// Reads the file before it asks anything of the board, which keeps what it has unless it takes the new one. One of another mirror it takes only
/// where that is asked for.
pub(super) async fn run(
    board: &Board,
    file: &Path,
    other_mirror: bool,
    json: bool,
) -> Result<(), ToolError> {
    let calibration = calibration_file::load(file)?;
    let before = board.calibration().await?;
    let settled = board.settled_calibration().await?;
    // What comes after is short, and done whole.
    let interrupt = Interrupt::listen()?;
    interrupt.or(calibrate_sense::zero_once(board)).await?;
    if !other_mirror {
        let checked = interrupt.or(same_mirror::check(board, file, &calibration));
        let checked = checked.await;
        board.off().await?;
        checked?;
    }
    let loaded = board
        .use_calibration(&calibration, CalibrationUse::ForGood)
        .await?;
    if let Some(warning) = settled.and_then(|settled| changed_reach(&settled, &calibration)) {
        say(format_args!("warning: {warning}"));
    }
    let max_position_um = decimal(board.status().await?.max_position_um);
    let report = LoadedCalibration {
        calibration: calibrated_words(&loaded),
        before: calibrated_words(&before),
        max_position_um,
    };
    report::print(&report, json);
    Ok(())
}

/// That the mirror of both calibrations would have become another, in words.
fn changed_reach(before: &Calibration, now: &Calibration) -> Option<String> {
    let device = |calibration: &Calibration| calibration.parts().origin.device;
    let [before_um, now_um] = [before, now].map(um_per_kelvin);
    let is_alike = (1.0 / ALIKE..=ALIKE).contains(&(now_um / before_um));
    (device(before) == device(now) && !is_alike).then(|| {
        format!(
            "this calibration moves '{}' by {now_um:.2} um a kelvin (top_um by temperature_rise_k), the one before by {before_um:.2}; \
            a mirror does not change by so much, so one of them is wrong. `host-tool calibrate` measures it",
            device(now).as_str()
        )
    })
}

/// Over the whole range, all actuators together.
fn um_per_kelvin(calibration: &Calibration) -> f32 {
    let actuators = calibration.actuators();
    let rises_k = actuators.iter().map(|it| it.shape.knots()[KNOTS - 1]);
    actuators.len() as f32 * calibration.max_position().0 / rises_k.sum::<f32>()
}

impl fmt::Display for LoadedCalibration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "calibrated {}", self.calibration)?;
        writeln!(f, "before     {}", self.before)?;
        writeln!(f, "range      0 to {:.1} um", self.max_position_um)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_that_was_mistyped_is_told_where_the_board_knows_the_mirror() {
        const FILE: &str = include_str!("../../../hil/tests/mirror-77.toml");
        let read = |text: &str| calibration::from_toml("mirror-77.toml", text).expect("a mirror's");
        let before = read(FILE);
        let top_um = before.max_position().0;
        let with_top = |factor: f32| {
            let (from, to) = (
                format!("top_um = {top_um}"),
                format!("top_um = {}", factor * top_um),
            );
            assert!(FILE.contains(&from), "{from}");
            FILE.replace(&from, &to)
        };
        assert_eq!(changed_reach(&before, &read(&with_top(1.2))), None);
        for factor in [0.5, 3.0] {
            let changed = with_top(factor);
            let told = changed_reach(&before, &read(&changed)).expect("it is told");
            assert!(told.contains("top_um"), "{told}");
            let other = changed.replacen("device = \"", "device = \"another ", 1);
            assert_eq!(changed_reach(&before, &read(&other)), None);
        }
    }
}
