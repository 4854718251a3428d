//! Levers and shapes from poses, of a plate that is known.

use calibration::{PlatePose, PoseError, PosePoint, Reach, posed, poses_to_measure, tabulate};
use control_core::calibration::{Lag, Parts, Plate};
use control_core::{CHANNELS, Calibration, Limits, Micrometre, PlateInverse, Pose, Radian, Second};
use mirror_model::{Model, Preset};

fn calibration(lever_um: f32) -> Calibration {
    let factory = tabulate(&Model::from(Preset::Reconciled)).expect("a calibration");
    Calibration::new(Parts {
        plate: Plate::cross(Micrometre(lever_um)),
        ..*factory.calibration.parts()
    })
    .expect("levers only")
}

/// A plate of its own levers, on actuators each of which goes by a curve of its own.
fn plate_reaches(asked_um: [f64; CHANNELS]) -> PlatePose {
    let taken: [f64; CHANNELS] = std::array::from_fn(|i| {
        let (gain, bend) = [(1.03, 2e-4), (0.97, 0.0), (1.01, -1e-4), (0.99, 1e-4)][i];
        gain * asked_um[i] + bend * asked_um[i] * asked_um[i]
    });
    PlatePose {
        z_um: taken.iter().sum::<f64>() / 4.0,
        tilt_x_rad: (taken[1] - taken[3]) / (2.0 * 310.0),
        tilt_y_rad: (taken[2] - taken[0]) / (2.0 * 290.0),
    }
}

fn asked_um(calibration: &Calibration, pose: &PlatePose) -> [f64; CHANNELS] {
    let plate = PlateInverse::new(&calibration.parts().plate, calibration.max_position());
    let pose = Pose {
        z: Micrometre(pose.z_um as f32),
        tilt_x: Radian(pose.tilt_x_rad as f32),
        tilt_y: Radian(pose.tilt_y_rad as f32),
    };
    let mut limits = Limits::NONE;
    plate.positions(&pose, &mut limits).map(f64::from)
}

fn measured(calibration: &Calibration) -> Vec<PosePoint> {
    let top_um = f64::from(calibration.max_position().0);
    let reach = Reach::new(calibration.parts().plate, top_um);
    let point = |asked: PlatePose| PosePoint {
        asked,
        held_s: 2.0,
        reached: Some(plate_reaches(asked_um(calibration, &asked))),
    };
    poses_to_measure(&reach, top_um)
        .into_iter()
        .map(point)
        .collect()
}

#[test]
fn a_plate_on_uneven_actuators_is_found() {
    let before = calibration(500.0);
    let posed = posed(&before, &measured(&before)).expect("a plate");
    // The polynomials hold these curves: what is left is the prior's and f32's.
    assert!(posed.piston_rms_um < 5e-3, "{posed:?}");
    assert!(posed.tilt_rms_rad < 1e-5, "{posed:?}");
    println!(
        "left: {} um, {} rad",
        posed.piston_rms_um, posed.tilt_rms_rad
    );
    let after = &posed.calibration;
    let top_um = f64::from(after.max_position().0);
    let reach = Reach::new(after.parts().plate, top_um);
    for step in 1..20 {
        let z_um = top_um * f64::from(step) / 20.0;
        let (sine, cosine) = (0.7 * f64::from(step)).sin_cos();
        let rad = 0.7 * reach.largest_tilt_rad(z_um, (cosine, sine));
        let asked = PlatePose {
            z_um,
            tilt_x_rad: rad * cosine,
            tilt_y_rad: rad * sine,
        };
        // The same heat takes an actuator as far as before.
        let positions = asked_um(after, &asked);
        let reached = plate_reaches(std::array::from_fn(|i| {
            let rise = after.actuators()[i]
                .shape
                .temperature_rise(Micrometre(positions[i] as f32));
            f64::from(before.actuators()[i].shape.position(rise).0)
        }));
        // What the fit leaves, and a table of 128 segments; the same at levers of 400 um and more.
        assert!(
            (reached.z_um - z_um).abs() < 0.02,
            "{reached:?} for {asked:?}"
        );
        assert!(
            (reached.tilt_x_rad - asked.tilt_x_rad).abs() < 5e-5,
            "{reached:?} for {asked:?}"
        );
        assert!(
            (reached.tilt_y_rad - asked.tilt_y_rad).abs() < 5e-5,
            "{reached:?} for {asked:?}"
        );
    }
}

/// Hysteresis holds a mirror that was moved off its rest, where the sensor's zero was taken.
#[test]
fn an_instrument_whose_zero_is_not_at_rest_tells_the_same_plate() {
    let before = calibration(500.0);
    let points = measured(&before);
    let zero = PlatePose {
        z_um: 0.4,
        tilt_x_rad: 6e-4,
        tilt_y_rad: -3e-4,
    };
    let off = points.iter().map(|point| PosePoint {
        reached: point.reached.map(|pose| PlatePose {
            z_um: pose.z_um - zero.z_um,
            tilt_x_rad: pose.tilt_x_rad - zero.tilt_x_rad,
            tilt_y_rad: pose.tilt_y_rad - zero.tilt_y_rad,
        }),
        ..*point
    });
    let found = posed(&before, &off.collect::<Vec<_>>()).expect("a plate");
    let level = posed(&before, &points).expect("a plate");
    // A tenth of what the zero is off by: the lowest poses lie above rest by a thirteenth of the range, and curves go on below them.
    assert!((found.zero.z_um - zero.z_um).abs() < 0.04, "{found:?}");
    assert!(
        (found.zero.tilt_x_rad - zero.tilt_x_rad).abs() < 6e-5,
        "{found:?}"
    );
    assert!(
        (found.zero.tilt_y_rad - zero.tilt_y_rad).abs() < 6e-5,
        "{found:?}"
    );
    let plates = [found, level].map(|posed| posed.calibration.parts().plate);
    for (one, other) in plates[0].levers.iter().zip(&plates[1].levers) {
        // A percent of a lever of 300 um.
        assert!(
            (one.x.0 - other.x.0).hypot(one.y.0 - other.y.0) < 3.0,
            "{plates:?}"
        );
    }
}

/// Where an actuator rests depends on where it came from.
#[test]
fn hysteresis_is_taken_neither_for_shared_heat_nor_for_growing_losses() {
    const FRICTION_UM: f64 = 0.15;
    let lag = |weight, s| Lag {
        weight,
        time: Second(s),
    };
    let mut parts = *calibration(500.0).parts();
    parts.heat.fast = [lag(0.5, 6e-4), lag(0.43, 0.036), lag(0.0, 0.0)];
    parts.heat.slow = [lag(0.07, 5.0), lag(0.0, 5.0)];
    let before = Calibration::new(parts).expect("the paper's poles");
    let mut points = measured(&before);
    let mut was_um = [0.0; CHANNELS];
    for point in &mut points {
        let at_um = asked_um(&before, &point.asked);
        let held =
            std::array::from_fn(|i| at_um[i] - FRICTION_UM * (at_um[i] - was_um[i]).signum());
        point.reached = Some(plate_reaches(held));
        was_um = at_um;
    }
    let found = posed(&before, &points).expect("a plate").calibration;
    let shared: f32 = found.parts().heat.shared.iter().sum();
    let growths = found
        .actuators()
        .each_ref()
        .map(|it| it.loss_growth.0.abs());
    let growth = growths.iter().sum::<f32>() / CHANNELS as f32;
    // Nothing is shared, and no loss grows. Friction of a thousandth of the range leaves both open: a percent of a pole, and 3 % of a loss at
    // 100 K.
    assert!(shared < 0.01 && growth < 3e-4, "{shared}, {growths:?}");
}

#[test]
fn what_does_not_fit_a_plate_is_refused_in_words() {
    let before = calibration(500.0);
    let good = measured(&before);
    assert_eq!(posed(&before, &good[..10]), Err(PoseError::TooFew(10)));
    let unknown = Calibration::new(Parts {
        plate: Plate::UNKNOWN,
        ..*before.parts()
    });
    assert_eq!(
        posed(&unknown.expect("level"), &good),
        Err(PoseError::NoLevers)
    );
    let mut gap = good.clone();
    gap[4].reached = Some(PlatePose {
        tilt_y_rad: f64::NAN,
        ..PlatePose::default()
    });
    assert_eq!(posed(&before, &gap), Err(PoseError::NotFinite(5)));
    // Tilts of another mirror, or in another order.
    let mut other = good.clone();
    let count = other.len();
    for (i, point) in other.iter_mut().enumerate() {
        let [mut here, there] = [i, (7 * i + 3) % count].map(|k| good[k].reached.expect("read"));
        here.tilt_x_rad = there.tilt_x_rad;
        point.reached = Some(here);
    }
    let refused = posed(&before, &other);
    assert!(
        matches!(refused, Err(PoseError::NoPlate { .. })),
        "{refused:?}"
    );
}
