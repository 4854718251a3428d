//! From the f64 model to the control core's f32 calibration, and calibrations as files.
//!
//! - [`tabulate`] inverts a model: a table for each actuator, and the stages in time that the core can
//!   invert. It tells which effects are left;
//! - [`corrected`] bends the tables by what was measured at rest, where the model's curve is not the
//!   mirror's;
//! - [`ringing`] finds the plate's resonance in how it rings, and [`with_resonance`] leads moves through it;
//! - [`rehearse`] tells what a board with such a calibration would leave along a standard path;
//! - [`with_piston_residual`] notes what a calibration left where it was tried, for the uncertainty of positions;
//! - [`with_broken_promise`] notes that it left more than it promised;
//! - [`with_ambient_ratio`] finds what a kelvin of the surroundings is worth, where the mirror rested in others;
//! - [`posed`] finds levers, each actuator's own table and what they share of their heat in poses that were measured;
//! - [`Reach`] tells which poses a plate reaches;
//! - [`to_toml`], [`from_toml`] are the file that people read.

mod ambient;
mod bandwidth;
mod correct;
mod curve;
mod dynamics;
mod error;
mod file;
mod memory;
mod plate_pose;
mod pose;
mod reach;
mod refine;
mod rehearsal;
mod residual;
mod ringing;
mod statics;

pub use ambient::{
    AmbientError, LEAST_APART_K, RoomPoint, further_um, with_ambient_ratio, without_surroundings,
};
pub use bandwidth::reached;
pub use correct::{CorrectionError, StaticPoint, corrected};
pub use dynamics::Remaining;
pub use error::TabulateError;
pub use file::{CalibrationFileError, from_toml, to_toml};
pub use plate_pose::PlatePose;
pub use pose::{
    COURSE_S, COURSE_STEP_S, Cause, Drives, LeftOut, NotHeld, PoseError, PosePoint, Posed,
    SpotHeights, along_a_course, are_on_a_line, check_from_rest, check_moved, course, posed,
    poses_over_spots, poses_to_measure, with_assumed_levers,
};
pub use reach::Reach;
pub use refine::{RefineError, Refined, refined};
pub use rehearsal::{Left, Rehearsal, rehearse};
pub use residual::{with_broken_promise, with_piston_residual};
pub use ringing::{ringing, with_resonance};

use control_core::calibration::{Bounds, Label, Origin, Parts, Plate};
use control_core::{Calibration, Kelvin, Volt, Watt};
use mirror_model::Model;

use crate::residual::UNTRIED;

/// Head room of the temperature limit above what the highest drive makes.
const RISE_MARGIN: f32 = 1.05;

/// A model's inverse.
#[derive(Clone, Debug, PartialEq)]
pub struct Tabulated {
    /// What a board needs.
    pub calibration: Calibration,
    /// The effects of the model that the core does not invert, or not wholly.
    pub remaining: Vec<Remaining>,
}

/// The calibration that inverts `model` from rest to what its highest drive reaches.
///
/// Static effects go into the tables. Thermal poles, hysteresis and creep go into the stages that the
/// core inverts in time. What a sensor does to the reading is no property of the mirror and is left out.
///
/// # Errors
/// Where the model does not rise, or runs away.
pub fn tabulate(model: &Model) -> Result<Tabulated, TabulateError> {
    let statics = statics::Statics::new(model)?;
    let actuators = statics.actuators()?;
    let drive = model.parameters.drive_limit_v as f32;
    let coldest_ohm = actuators
        .iter()
        .map(|actuator| actuator.cold_resistance.0)
        .fold(f32::INFINITY, f32::min);
    let hottest_k = actuators
        .iter()
        .map(|actuator| actuator.shape.knots()[control_core::shape::SEGMENTS])
        .fold(0.0, f32::max);
    let calibration = Calibration::new(Parts {
        origin: origin(model)?,
        heat: dynamics::heat(model),
        memory: memory::memory(model, actuators[0].shape.top().0.into()),
        actuators,
        // A model of the piston knows no plate.
        plate: Plate::UNKNOWN,
        path: dynamics::path(model),
        bounds: Bounds {
            drive: Volt(drive),
            power: Watt(drive * drive / coldest_ohm),
            rise: Kelvin(RISE_MARGIN * hottest_k),
        },
        // No resistance was measured against its power yet.
        ambient_ratio: 0.0,
        sensed_crosstalk: 0.0,
        residual: UNTRIED,
    })?;
    Ok(Tabulated {
        calibration,
        remaining: dynamics::remaining(model),
    })
}

/// A hash of the model, equal for equal model files.
pub fn model_hash(model: &Model) -> u64 {
    crc::Crc::<u64>::new(&crc::CRC_64_XZ).checksum(model.to_toml().as_bytes())
}

fn origin(model: &Model) -> Result<Origin, TabulateError> {
    let label = |text: &Option<String>| {
        let text = text.as_deref().unwrap_or_default();
        Label::new(text).ok_or_else(|| TabulateError::Label(text.to_owned()))
    };
    Ok(Origin {
        device: label(&model.provenance.device)?,
        date: label(&model.provenance.date)?,
        model_hash: model_hash(model),
    })
}
