//! What drives hold of what a plate reaches, where actuators share heat.

use calibration::{Drives, PlatePose, Reach, tabulate};
use control_core::calibration::{Heat, Lag, Parts, Plate};
use control_core::{
    CHANNELS, Calibration, Limits, Micrometre, PerKelvin, PlateInverse, Pose, Second,
};
use mirror_model::{Model, Preset};
use nalgebra::{Matrix4, Vector4};
use proptest::prelude::*;

/// What the tool's decision may be off by in the range's rounding, and what it lets pass (K).
const LET_PASS_K: f64 = 0.0101;

/// A plate on actuators that share this part of half of their heat.
fn calibration(shared: f32, growth: f32, levers: [(f32, f32); CHANNELS]) -> Calibration {
    let factory = tabulate(&Model::from(Preset::Reconciled)).expect("a calibration");
    let mut parts = Parts {
        plate: Plate::cross(Micrometre(480.0)),
        ..*factory.calibration.parts()
    };
    for (lever, (x, y)) in parts.plate.levers.iter_mut().zip(levers) {
        lever.x.0 += x;
        lever.y.0 += y;
    }
    for actuator in &mut parts.actuators {
        actuator.loss_growth = PerKelvin(growth);
    }
    let lag = |weight, s| Lag {
        weight,
        time: Second(s),
    };
    parts.heat.fast = [lag(0.5, 6e-4), lag(0.5, 0.03), lag(0.0, 0.0)];
    parts.heat.slow = Heat::INSTANT.slow;
    parts.heat.shared[1] = shared;
    Calibration::new(parts).expect("shared poles")
}

fn calibrations() -> impl Strategy<Value = (f32, Calibration)> {
    let lever = (-40.0_f32..40.0, -40.0_f32..40.0);
    let all = (
        0.05_f32..0.95,
        0.0_f32..2e-3,
        proptest::array::uniform4(lever),
    );
    all.prop_map(|(shared, growth, levers)| (shared, calibration(shared, growth, levers)))
}

fn top_um(calibration: &Calibration) -> f64 {
    f64::from(calibration.max_position().0)
}

fn reach(calibration: &Calibration, low_um: f64) -> Reach {
    Reach::new(calibration.parts().plate, top_um(calibration))
        .above(low_um)
        .held_by(Drives::new(calibration.parts()))
}

/// The powers that hold a pose, as the rises that they would hold without any growth (K), by the four equations that couple the actuators.
fn powers(shared: f32, calibration: &Calibration, pose: &PlatePose, low_um: f64) -> Vector4<f64> {
    let plate = PlateInverse::new(&calibration.parts().plate, calibration.max_position());
    let mut limits = Limits::NONE;
    let um = plate.positions(&Pose::from(*pose), &mut limits);
    let actuators = calibration.actuators();
    let rise = |i: usize, um: f64| {
        let shape = &actuators[i].shape;
        f64::from(shape.temperature_rise(Micrometre(um as f32)).0)
    };
    let heated: Vector4<f64> =
        Vector4::from_fn(|i, _| rise(i, f64::from(um[i])) - rise(i, low_um) + rise(i, 0.0));
    let whole = 0.5 * f64::from(shared);
    let coupling = (1.0 - whole) * Matrix4::identity() + Matrix4::from_element(0.25 * whole);
    let heatings = coupling.try_inverse().expect("shared in part") * heated;
    Vector4::from_fn(|i, _| heatings[i] + f64::from(actuators[i].loss_growth.0) * heated[i].powi(2))
}

/// As it is told, and typed by who reads it.
fn typed(pose: &PlatePose) -> PlatePose {
    let rounded = |value: f64, digits: f64| (value * digits).round() / digits;
    let deg = |rad: f64| rounded(rad.to_degrees(), 1e4).to_radians();
    PlatePose {
        z_um: rounded(pose.z_um, 1e3),
        tilt_x_rad: deg(pose.tilt_x_rad),
        tilt_y_rad: deg(pose.tilt_y_rad),
    }
}

proptest! {
    #[test]
    fn a_pose_that_is_reached_takes_no_power_below_zero_and_the_nearest_is_reached(
        (shared, calibration) in calibrations(),
        z_part in 0.02..0.98, part in 0.0..1.0, angle in 0.0..6.3_f64, low_um in prop_oneof![Just(0.0), 0.0..30.0],
    ) {
        let z_um = low_um + z_part * (top_um(&calibration) - low_um);
        let reach = reach(&calibration, low_um);
        let (sine, cosine) = angle.sin_cos();
        let most_rad = reach.by_range().largest_tilt_rad(z_um, (cosine, sine));
        let tilted = |rad: f64| PlatePose { z_um, tilt_x_rad: rad * cosine, tilt_y_rad: rad * sine };
        let asked = tilted(0.999 * part * most_rad);
        let least = |pose: &PlatePose| powers(shared, &calibration, pose, low_um).min();
        let own = 1.0 - 0.5 * f64::from(shared);
        let nearest = reach.nearest(&asked);
        prop_assert!(own * least(&nearest) > -LET_PASS_K, "{nearest:?} {}", least(&nearest));
        match reach.kept_warm(&asked) {
            None => {
                prop_assert_eq!(nearest, asked);
                prop_assert!(own * least(&asked) > -LET_PASS_K, "{}", least(&asked));
            }
            Some(kept_warm) => {
                prop_assert!((own * least(&asked) + kept_warm.k).abs() < 1e-3);
                prop_assert!(!reach.contains(&asked) && reach.by_range().contains(&asked));
                prop_assert!(reach.contains(&typed(&nearest)), "{nearest:?}");
                // No nearer one is held: what is asked is, within the rounding.
                prop_assert!(least(&nearest) < 1e-3, "{}", least(&nearest));
                // And that is what the tilt's range says.
                let largest_rad = reach.largest_tilt_rad(z_um, (cosine, sine));
                let told_rad = nearest.tilt_x_rad.hypot(nearest.tilt_y_rad);
                prop_assert!((told_rad - largest_rad).abs() < 1e-6, "{told_rad} {largest_rad}");
            }
        }
    }

    #[test]
    fn pistons_and_tilts_tell_the_same(
        (_, calibration) in calibrations(), z_part in 0.05..0.95, angle in 0.0..6.3_f64,
    ) {
        let z_um = z_part * top_um(&calibration);
        let reach = reach(&calibration, 0.0);
        let direction = (angle.cos(), angle.sin());
        let most_rad = reach.largest_tilt_rad(z_um, direction);
        let at = |share: f64| reach.pistons_um(share * most_rad * direction.0, share * most_rad * direction.1);
        let (low_um, high_um) = at(0.999).expect("reached");
        prop_assert!(low_um <= z_um && z_um <= high_um, "{z_um} of {low_um} to {high_um}");
        let beyond = at(1.002).is_some_and(|(low_um, high_um)| low_um <= z_um && z_um <= high_um);
        prop_assert!(!beyond);
    }
}

#[test]
fn where_nothing_is_shared_every_pose_within_the_range_is_held() {
    let calibration = calibration(0.0, 0.0, [(0.0, 0.0); CHANNELS]);
    let by_range = Reach::new(calibration.parts().plate, top_um(&calibration));
    assert_eq!(reach(&calibration, 0.0), by_range);
}

#[test]
fn a_plate_that_shares_two_fifths_tilts_as_far_as_its_coldest_heater_does_without_power() {
    let calibration = calibration(0.8, 0.0, [(0.0, 0.0); CHANNELS]);
    let reach = reach(&calibration, 0.0);
    let shape = &calibration.actuators()[0].shape;
    let rise = |um: f64| f64::from(shape.temperature_rise(Micrometre(um as f32)).0);
    let z_um = 85.0;
    let down_um = 480.0 * reach.largest_tilt_rad(z_um, (1.0, 0.0));
    let mean = 0.25 * (rise(z_um - down_um) + 2.0 * rise(z_um) + rise(z_um + down_um));
    assert!(
        (rise(z_um - down_um) - 0.4 * mean).abs() < 1e-3,
        "{down_um} um"
    );
    // Exactly there it is reached, a hundredth of a kelvin below it is not.
    let tilted = |um: f64| PlatePose {
        z_um,
        tilt_x_rad: um / 480.0,
        tilt_y_rad: 0.0,
    };
    assert!(reach.contains(&tilted(down_um)));
    assert!(!reach.contains(&tilted(down_um + 0.05)));
    // Level it stays as it was.
    assert_eq!(
        reach.pistons_um(0.0, 0.0),
        Some((0.0, top_um(&calibration)))
    );
    assert!(reach.contains(&PlatePose::default()));
}
