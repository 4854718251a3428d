//! What cases begin with.

use control_core::Calibration;
use mirror_model::Model;

/// The calibration that boards are delivered with.
pub(crate) fn factory() -> Calibration {
    let model = Model::load("reconciled").expect("a preset");
    let tabulated = calibration::tabulate(&model).expect("it can be inverted");
    tabulated.calibration
}
