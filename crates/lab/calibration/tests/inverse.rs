//! The f32 table of the control core against the f64 model that it inverts.

use calibration::tabulate;
use control_core::{Ampere, CHANNELS, Calibration, Controller, Micrometre, Setpoint, Volt};
use mirror_model::{Model, PistonModel};
use proptest::prelude::*;

/// The paper's sensor resolution.
const BOUND_UM: f64 = 0.010;

fn presets() -> [Model; 3] {
    ["paper", "paper-refit", "reconciled"].map(|name| Model::load(name).expect("a preset"))
}

fn drive_at(controller: &mut Controller, z_um: f64) -> f64 {
    let setpoint = Setpoint::track(Micrometre(z_um as f32));
    let mut tick = || *controller.step(setpoint, [Volt(0.0); CHANNELS], [Ampere(0.0); CHANNELS]);
    // The first tick takes the mirror there, the second one holds it.
    tick();
    f64::from(tick().drives[0].0)
}

/// Where the mirror of the model goes when the core is asked for `z_um`, less `z_um`.
fn error_um(controller: &mut Controller, model: &PistonModel, z_um: f64) -> f64 {
    model.displacement_at_voltage_um(drive_at(controller, z_um)) - z_um
}

#[test]
fn the_core_inverts_the_model_to_the_sensors_resolution() {
    for model in presets() {
        let mut calibration = tabulate(&model).expect("a calibration").calibration;
        let mut controller = Controller::new(&mut calibration);
        let actuator = model.actuator(0);
        let top_um = actuator.highest_displacement_um();
        let worst = (0..=100_000)
            .map(|i| error_um(&mut controller, &actuator, top_um * f64::from(i) / 1e5).abs())
            .fold(0.0, f64::max);
        println!(
            "{:?}: worst error {:.3} nm of 0 to {top_um:.1} um",
            model.preset,
            worst * 1e3
        );
        assert!(worst <= BOUND_UM, "{:?}: {worst} um", model.preset);
    }
}

#[test]
fn a_lane_takes_at_most_two_kilobytes() {
    assert!(
        size_of::<Calibration>() / CHANNELS <= 2048,
        "{}",
        size_of::<Calibration>()
    );
}

proptest! {
    #[test]
    fn drives_rise_with_the_position(low in 0.0_f64..1.0, high in 0.0_f64..1.0) {
        let model = Model::load("reconciled").expect("a preset");
        let mut calibration = tabulate(&model).expect("a calibration").calibration;
        let mut controller = Controller::new(&mut calibration);
        let top_um = model.actuator(0).highest_displacement_um();
        let mut drive = |part: f64| drive_at(&mut controller, part * top_um);
        prop_assert!(drive(low.min(high)) <= drive(low.max(high)));
    }
}
