//! What a board reached before and after its calibration: `calibrate --trial` writes it, `report --trial` shows it.

mod picture;

use std::path::Path;

use calibration_procedure::{Figures, Trial};
use control_core::Calibration;
use input_file::MOST_MADE;
use serde::{Deserialize, Serialize};

pub(crate) use self::picture::before_and_after;
use crate::error::{ToolError, UnusableInput};

/// The format that this tool writes and reads.
const FORMAT: u32 = 1;
/// A series of fewer readings was never tried.
const FEWEST: usize = 2;

/// A calibration, and what the board reached without and with it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Tried {
    format: u32,
    /// Version of the tool that wrote it.
    version: String,
    /// What the board calls itself.
    pub(crate) board: String,
    /// The calibration that it had before, in words.
    pub(crate) calibrated_before: String,
    /// The new one, as a calibration file.
    calibration: String,
    /// What the identified model has and the board does not invert, in words.
    pub(crate) not_inverted: Vec<String>,
    pub(crate) before: Trial,
    pub(crate) after: Trial,
}

/// What is compared.
pub(crate) struct Figure {
    /// In words.
    pub(crate) what: String,
    pub(crate) unit: &'static str,
    pub(crate) before: f64,
    pub(crate) after: f64,
}

impl Tried {
    pub(crate) fn new(
        (board, calibrated_before): (String, String),
        calibration: &Calibration,
        not_inverted: Vec<String>,
        (before, after): (Trial, Trial),
    ) -> Self {
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            board,
            calibrated_before,
            calibration: calibration::to_toml(calibration),
            not_inverted,
            before,
            after,
        }
    }

    pub(crate) fn to_json(&self) -> String {
        serde_json::to_string(self).expect("plain data")
    }

    /// From a file.
    pub(crate) fn load(path: &Path) -> Result<Self, ToolError> {
        let text = input_file::read_text(path, MOST_MADE)?;
        let read = || {
            let json: serde_json::Value =
                serde_json::from_str(&text).map_err(|error| error.to_string())?;
            match json["format"].as_u64() {
                Some(format) if format == u64::from(FORMAT) => {}
                Some(format) => {
                    return Err(format!("it has format {format}, this tool reads {FORMAT}"));
                }
                None => return Err("it states no format".into()),
            }
            let tried: Self = serde_json::from_value(json).map_err(|error| error.to_string())?;
            tried.calibration().map(|_| tried)
        };
        read().map_err(|reason| {
            ToolError::from(UnusableInput::NotATrial {
                path: path.to_owned(),
                reason,
            })
        })
    }

    /// The calibration, where all of the trial is whole; or why it is not.
    pub(crate) fn calibration(&self) -> Result<Calibration, String> {
        let series = [&self.before, &self.after].map(Trial::series);
        if series
            .iter()
            .flatten()
            .any(|series| series.points.len() < FEWEST)
        {
            return Err("one of its series has no readings".into());
        }
        calibration::from_toml("its calibration", &self.calibration).map_err(|e| e.to_string())
    }
}

/// What two trials come to, side by side.
pub(crate) fn figures(b: &Figures, a: &Figures) -> [Figure; 7] {
    let figure = |what: &str, unit, before, after| Figure {
        what: what.into(),
        unit,
        before,
        after,
    };
    let triangle = format!("20 Hz triangle of {:.0} um, rms", a.triangle_um);
    [
        figure("error at rest, rms", "um", b.rest_rms_um, a.rest_rms_um),
        figure(
            "error at rest, largest",
            "um",
            b.rest_largest_um,
            a.rest_largest_um,
        ),
        figure("step, time to 95 %", "ms", b.t95_ms, a.t95_ms),
        figure(
            "step, overshoot",
            "%",
            b.overshoot_percent,
            a.overshoot_percent,
        ),
        figure("loop at 1 Hz", "um", b.slow_loop_um, a.slow_loop_um),
        figure("loop at 20 Hz", "um", b.loop_um, a.loop_um),
        figure(&triangle, "um", b.triangle_rms_um, a.triangle_rms_um),
    ]
}
