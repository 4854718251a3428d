//! Calibration files: TOML that a person can read and edit.
//!
//! ```toml
//! format = 1
//! device = "mirror 7"
//! date = "2026-11-21"
//! model_hash = "0123456789abcdef"
//! move_time_s = 0.007
//! beam_lag_s = 0.0002 # with which the beams follow their heaters
//! time_growth_s_per_k = 0.000002 # by which the time constants grow with the rise
//! resonance = { frequency_hz = 950.0, quality = 30.0 } # of the plate; none where nobody knows it
//! max_drive_v = 3.5
//! max_power_w = 0.034
//! max_rise_k = 136.0
//! ambient_ratio = 1.02 # kelvins of a heater that one of the surroundings is worth; without it these are not compensated
//! sensed_crosstalk = -0.03 # kelvins that a heater tells more for each by which the four are warmer in the mean; nothing where poses have not told it
//! residual = { piston_um = 0.03, tried_um = 168.2, part = 0.03, apart = 0.03, ambient_ratio = 0.05 } # standard uncertainties; none where nobody knows them
//! fast_poles = [{ weight = 0.6, time_s = 0.001 }, { weight = 0.34, time_s = 0.035 }]
//! slow_poles = [{ weight = 0.06, time_s = 4.7, shared = 0.9 }] # shared: the part that the heating of all four drives
//! plays = [{ weight = 0.01, radius_um = 4.0 }]
//! creep = [{ weight = 0.003, time_s = 5.0 }]
//! levers = [{ x_um = 480.0, y_um = 0.0, warp = 1.0 }, ...] # of the four actuators; none where nobody knows them
//!
//! [[actuators]]
//! cold_resistance_ohm = 360.2
//! tcr_per_k = 0.00392
//! thermal_resistance_k_per_w = 5712.0
//! loss_growth_per_k = 0.0012
//! slower_by_s = -0.00006 # than the poles say; nothing where poses have not told it
//! top_um = 173.7
//! temperature_rise_k = [0.0, 0.78, ...] # 129 of them, at equal steps of z from 0 to top_um
//! sensed_top_k = 105.0
//! sensed_rise_k = [0.01, 6.2, ...] # 17 of them, at equal steps of the rise from 0 to sensed_top_k; none where nobody knows them
//! ```

mod coherent;
mod stored;

use std::sync::Arc;

use control_core::Calibration;
use miette::{Diagnostic, NamedSource, SourceSpan};

use stored::Stored;

/// Why a calibration file cannot be used.
#[derive(Debug, thiserror::Error, Diagnostic)]
pub enum CalibrationFileError {
    /// It is not written as a calibration file is.
    #[error("'{name}' is no calibration file: {message}")]
    #[diagnostic(help("write one with `host-tool calibrate`, or mend the place that is marked"))]
    Content {
        /// The file.
        name: String,
        /// What is wrong.
        message: String,
        /// The file's text.
        #[source_code]
        text: Arc<NamedSource<String>>,
        /// Where.
        #[label("here")]
        place: SourceSpan,
    },
    /// One of its values cannot be used.
    #[error("the calibration in '{name}' cannot be used: {message}")]
    #[diagnostic(help("calibrate the mirror again, or mend the value"))]
    Value {
        /// The file.
        name: String,
        /// Which value, and what is wrong with it.
        message: String,
    },
}

/// `calibration` as the text of a calibration file.
pub fn to_toml(calibration: &Calibration) -> String {
    let stored = Stored::from(calibration);
    toml::to_string(&stored).expect("numbers and texts are TOML")
}

/// The calibration in the text of a file called `name`.
///
/// # Errors
/// Points at the place that is wrong, or names the value that no mirror can have, or not beside the others.
pub fn from_toml(name: &str, text: &str) -> Result<Calibration, CalibrationFileError> {
    let stored: Stored = toml::from_str(text).map_err(|error| CalibrationFileError::Content {
        name: name.to_owned(),
        message: error.message().to_owned(),
        text: Arc::new(NamedSource::new(name, text.to_owned())),
        place: error.span().unwrap_or_default().into(),
    })?;
    let read = stored.read();
    read.and_then(|calibration| coherent::check(&calibration).map(|()| calibration))
        .map_err(|message| CalibrationFileError::Value {
            name: name.to_owned(),
            message,
        })
}
