//! `load-calibration`: a calibration that `calibrate -o` wrote, on the board again, or on another.

use std::fmt;
use std::path::Path;

use control_core::shape::KNOTS;
use control_core::{CHANNELS, Calibration};
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
/// And by what factor the temperature coefficients of its heaters: two calibrations of one mirror agree to a hundredth, and one that is 15 % off
/// moves it 12 um beyond 60 um.
const ALIKE_TCR: f32 = 1.05;
/// And the highest drive that is allowed: a choice.
const ALIKE_DRIVE: f32 = 1.25;

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
    for warning in settled
        .iter()
        .flat_map(|settled| changed(settled, &calibration))
    {
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

/// What the mirror of both calibrations would have changed by, in words.
fn changed(before: &Calibration, now: &Calibration) -> Vec<String> {
    let device = |calibration: &Calibration| calibration.parts().origin.device;
    if device(before) != device(now) {
        return Vec::new();
    }
    let mirror = device(now);
    let changed = |of: &dyn Fn(&Calibration) -> f32, alike: f32| {
        let [before, now] = [before, now].map(of);
        (!(1.0 / alike..=alike).contains(&(now / before))).then_some((before, now))
    };
    let one_is_wrong = "a mirror does not change by so much, so one of them is wrong. `host-tool calibrate` measures it";
    let reach = changed(&um_per_kelvin, ALIKE).map(|(before_um, now_um)| {
        format!(
            "this calibration moves '{}' by {now_um:.2} um a kelvin (top_um by temperature_rise_k), the one before by {before_um:.2}; {one_is_wrong}",
            mirror.as_str()
        )
    });
    let coefficients = (0..CHANNELS).filter_map(|actuator| {
        let (before, now) = changed(&|it| it.actuators()[actuator].tcr.0, ALIKE_TCR)?;
        Some(format!(
            "tcr_per_k of actuator {} is {now:.6} / K in this calibration, and {before:.6} / K in the one before; {one_is_wrong}",
            actuator + 1
        ))
    });
    let drive = changed(&|it| it.parts().bounds.drive.0, ALIKE_DRIVE).map(|(before_v, now_v)| {
        format!(
            "this calibration allows {now_v:.2} V (max_drive_v), the one before {before_v:.2} V: what takes more is not reached, and where even cold heaters \
             count as too hot, load the one before and `host-tool clear`"
        )
    });
    reach.into_iter().chain(coefficients).chain(drive).collect()
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
    use control_core::calibration::Parts;

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
        let told = |text: &str| changed(&before, &read(text));
        assert_eq!(told(&with_top(1.2)), [""; 0]);
        for factor in [0.5, 3.0] {
            let changed = with_top(factor);
            assert!(told(&changed)[0].contains("top_um"));
            let other = changed.replacen("device = \"", "device = \"another ", 1);
            assert_eq!(told(&other), [""; 0]);
        }
    }

    #[test]
    fn coefficients_and_bounds_that_were_mistyped_are_told() {
        const FILE: &str = include_str!("../../../hil/tests/mirror-77.toml");
        let before = calibration::from_toml("mirror-77.toml", FILE).expect("a mirror's");
        let before = *before.parts();
        let told = |now: Parts| {
            let [before, now] = [before, now].map(|it| Calibration::new(it).expect("a mirror's"));
            changed(&before, &now)
        };
        let mut now = before;
        now.actuators[2].tcr.0 *= 1.15;
        let said = told(now);
        assert!(
            said.len() == 1 && said[0].starts_with("tcr_per_k of actuator 3"),
            "{said:?}"
        );
        let mut now = before;
        now.bounds.drive.0 = 0.1;
        assert!(told(now)[0].contains("allows 0.10 V (max_drive_v)"));
        let mut now = before;
        now.actuators[0].tcr.0 *= 1.02;
        assert_eq!(told(now), [""; 0]);
    }
}
