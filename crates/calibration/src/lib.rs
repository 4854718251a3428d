//! From the f64 model to the control core's f32 calibration.
//!
//! [`tabulate`] samples the model's exact inverse at the knots of the core's table. [`rust_source`]
//! writes a calibration as a constant, which is how the factory's gets into the firmware.

use control_core::calibration::CalibrationError;
use control_core::table::{KNOTS, SEGMENTS, TableError};
use control_core::{
    Calibration, InverseTable, KelvinPerWatt, LaneCalibration, Micrometre, Ohm, PerKelvin, Volt,
};
use mirror_model::{Model, PistonModel, RangeError};

/// Why a model gives no calibration.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TabulateError {
    /// The model's inverse has no value where the table needs one.
    #[error("the model cannot be inverted: {0}")]
    Inverse(#[from] RangeError),
    /// The inverse does not rise.
    #[error("the model's inverse gives no table: {0:?}")]
    Table(TableError),
    /// A parameter is not finite and above zero.
    #[error("the model gives no calibration: {0:?}")]
    Calibration(CalibrationError),
}

/// The calibration that inverts `model`, from rest to what its highest drive reaches.
///
/// # Errors
/// Where the model's parameters give no rising, finite inverse.
pub fn tabulate(model: &Model) -> Result<Calibration, TabulateError> {
    let [a, b, c, d] = model.actuators();
    let lanes = [lane(&a)?, lane(&b)?, lane(&c)?, lane(&d)?];
    let max_drive = Volt(model.parameters.drive_limit_v as f32);
    Calibration::new(lanes, max_drive).map_err(TabulateError::Calibration)
}

fn lane(actuator: &PistonModel) -> Result<LaneCalibration, TabulateError> {
    let parameters = &actuator.parameters;
    Ok(LaneCalibration {
        cold_resistance: Ohm(parameters.cold_resistance_ohm as f32),
        tcr: PerKelvin(parameters.resistance_coefficient_per_k as f32),
        thermal_resistance: KelvinPerWatt(parameters.thermal_resistance_k_per_w as f32),
        shape: shape(actuator)?,
    })
}

fn shape(actuator: &PistonModel) -> Result<InverseTable, TabulateError> {
    let top_um = actuator.highest_displacement_um();
    let mut knots = [0.0; KNOTS];
    for (i, knot) in knots.iter_mut().enumerate().skip(1) {
        let z_um = top_um * i as f64 / SEGMENTS as f64;
        *knot = actuator.temperature_rise_at(z_um)? as f32;
    }
    InverseTable::new(Micrometre(top_um as f32), knots).map_err(TabulateError::Table)
}

/// `calibration` as a Rust constant `CALIBRATION`, checked once more when it is compiled.
pub fn rust_source(calibration: &Calibration) -> String {
    let lanes: Vec<String> = calibration.lanes().iter().map(lane_source).collect();
    format!(
        "/// The calibration that inverts the factory's model.\n\
         pub const CALIBRATION: control_core::Calibration = match \
         control_core::Calibration::new([{}], control_core::Volt({:?})) {{\n    \
         Ok(calibration) => calibration,\n    \
         Err(_) => panic!(\"the factory calibration is not plausible\"),\n}};\n",
        lanes.join(", "),
        calibration.max_drive().0,
    )
}

fn lane_source(lane: &LaneCalibration) -> String {
    format!(
        "control_core::LaneCalibration {{ cold_resistance: control_core::Ohm({:?}), tcr: \
         control_core::PerKelvin({:?}), thermal_resistance: control_core::KelvinPerWatt({:?}), \
         shape: match control_core::InverseTable::new(control_core::Micrometre({:?}), {:?}) {{ \
         Ok(table) => table, Err(_) => panic!(\"the factory table does not rise\") }} }}",
        lane.cold_resistance.0,
        lane.tcr.0,
        lane.thermal_resistance.0,
        lane.shape.top().0,
        lane.shape.knots(),
    )
}
