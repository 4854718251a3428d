//! Other surroundings than those of the calibration, told by the heaters' resistances and made up for.
//!
//! The mirrors are of physics that share nothing with the core (`virtual-mirror`), calibrated by what was measured of them.

use closed_loop::calibrate;
use closed_loop::surroundings::{
    Around, RECOVERED_UM, Reached, calibrated_in_another_room, errors, recovery,
};
use control_core::{Calibration, Limit};
use virtual_mirror::{Effect, Family, MirrorConfig};

/// 10 to 40 degC around the 22 of a laboratory, and the same room (K).
const ROOMS_K: [f64; 4] = [0.0, -12.0, 9.0, 18.0];

/// A mirror with what usual ones have, of a family that was developed with.
fn mirror() -> MirrorConfig {
    MirrorConfig::draw(Family::A, 31)
        .with_effect(Effect::HeatLossTemperature, 1.0)
        .with_effect(Effect::SubstrateWarming, 0.7)
        .with_effect(Effect::Hysteresis, 0.3)
        .with_effect(Effect::Creep, 0.2)
        .with_effect(Effect::Resonance, 1.0)
}

fn largest_um(reached: &[Reached]) -> f64 {
    let within = reached.iter().filter(|reached| reached.is_within_reach());
    within
        .map(|reached| reached.error_um.abs())
        .fold(0.0, f64::max)
}

fn around(rise_k: f64, air: f64) -> Around {
    Around { rise_k, air }
}

#[test]
#[ignore = "long"]
fn a_room_is_told_and_made_up_for() {
    let config = mirror();
    let first = calibrate(&config).expect("a mirror").calibration;
    let mut calibration = calibrated_in_another_room(&first, &config).expect("a mirror");
    println!("ambient ratio {:.4}", calibration.parts().ambient_ratio);
    for rise_k in ROOMS_K {
        let mut reach = |makes_up| {
            errors(&mut calibration, &config, around(rise_k, 1.0), makes_up).expect("a mirror")
        };
        let (off, on) = (reach(false), reach(true));
        let (off_um, on_um) = (largest_um(&off), largest_um(&on));
        println!("{rise_k} K: {off_um:.2} um, made up for {on_um:.2} um");
        assert!(on_um < 0.5, "{on:?}");
        // Some 1.8 um for each kelvin.
        assert!(off_um > 1.2 * rise_k.abs(), "{off:?}");
        let known = on[on.len() - 1].known.expect("calibrated");
        // A hundredth of a kelvin in the curve, and the scatter of the films' own coefficients.
        assert!((f64::from(known.rise.0) - rise_k).abs() < 0.5, "{known:?}");
        // 18 K bend further than 20 um.
        let is_warm = on.iter().any(|it| it.limits.contains(Limit::RoomWarm));
        assert_eq!(is_warm, rise_k > 15.0, "{on:?}");
    }
    a_step_is_recovered_from(&mut calibration, &config);
}

fn a_step_is_recovered_from(calibration: &mut Calibration, config: &MirrorConfig) {
    for step in [(120.0, 20.0), (60.0, -20.0)] {
        let recovered = recovery(calibration, config, step, true).expect("a mirror");
        println!(
            "{step:?}: within {RECOVERED_UM} um after {:.4} s",
            recovered.within_s
        );
        assert!(recovered.within_s < 0.1);
    }
}
