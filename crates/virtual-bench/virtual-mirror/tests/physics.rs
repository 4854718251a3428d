//! What must hold of any mirror.

use approx::assert_relative_eq;
use virtual_mirror::{Effect, Family, MirrorConfig, Sensor, State, VirtualMirror};

fn mirror(config: &MirrorConfig) -> VirtualMirror {
    VirtualMirror::new(config).expect("valid mirror")
}

fn settled(config: &MirrorConfig, drive: [f64; 4]) -> State {
    let mut mirror = mirror(config);
    mirror.advance(drive, 100.0);
    mirror.state()
}

/// z every millisecond while the drive jumps up, across and down, in so many ticks a millisecond.
fn jumps(config: &MirrorConfig, ticks_per_ms: u32) -> Vec<f64> {
    let mut mirror = mirror(config);
    let mut z = Vec::new();
    for (volts, ms) in [(3.5, 30), (1.0, 30), (2.5, 10), (0.0, 50)] {
        for _ in 0..ms {
            for _ in 0..ticks_per_ms {
                mirror.step([volts; 4], 1e-3 / f64::from(ticks_per_ms));
            }
            z.push(mirror.state().z_um);
        }
    }
    z
}

fn farthest(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

#[test]
fn halving_the_step_changes_nothing_above_a_nanometre() {
    for config in [
        MirrorConfig::bench(),
        MirrorConfig::draw(Family::A, 1),
        MirrorConfig::paper(),
    ] {
        let run = |ticks_per_ms| jumps(&config, ticks_per_ms);
        let tick = run(10);
        for (name, other) in [
            ("half", run(20)),
            ("a sixteenth", run(160)),
            ("ten times", run(1)),
        ] {
            let worst_nm = 1e3 * farthest(&tick, &other);
            assert!(
                worst_nm < 1.0,
                "{}: {name} of the step moves z by {worst_nm} nm",
                config.name
            );
        }
    }
}

#[test]
fn a_sine_ends_the_same_in_long_and_short_ramps() {
    let run = |parts: u32| {
        let mut mirror = mirror(&MirrorConfig::bench());
        mirror.advance([1.0; 4], 1.0);
        let mut z = Vec::new();
        for row in 1..=200 {
            let end = 1.0 + 0.5 * (f64::from(row) * std::f64::consts::TAU / 100.0).sin();
            let start = 1.0 + 0.5 * (f64::from(row - 1) * std::f64::consts::TAU / 100.0).sin();
            for part in 1..=parts {
                let volts = start + (end - start) * f64::from(part) / f64::from(parts);
                mirror.advance_ramp([volts; 4], 5e-4 / f64::from(parts));
            }
            z.push(mirror.state().z_um);
        }
        z
    };
    let worst_nm = 1e3 * farthest(&run(1), &run(8));
    // Twentieths of what a sensor resolves.
    assert!(worst_nm < 1.0, "{worst_nm} nm");
}

#[test]
fn the_default_mirror_has_the_size_it_is_meant_to_have() {
    let state = settled(&MirrorConfig::bench(), [3.5; 4]);
    assert!((170.0..180.0).contains(&state.z_um), "{state:?}");
    for current in state.current_a {
        assert!((5e-3..7e-3).contains(&current), "{state:?}");
        assert!(
            (345.0..375.0).contains(&(0.01 / cold_current())),
            "{state:?}"
        );
    }
    fn cold_current() -> f64 {
        let mut mirror = mirror(&MirrorConfig::bench());
        mirror.advance([0.01; 4], 1e-9);
        mirror.state().current_a[0]
    }
}

#[test]
fn hotter_with_every_volt_and_closer_to_the_substrate() {
    let mut before = State {
        z_um: -1.0,
        hottest_k: -1.0,
        ..State::default()
    };
    for step in 0..=35 {
        let state = settled(&MirrorConfig::bench(), [f64::from(step) * 0.1; 4]);
        assert!(
            state.z_um > before.z_um && state.hottest_k > before.hottest_k,
            "{state:?}"
        );
        before = state;
    }
}

#[test]
fn alike_actuators_do_not_tilt_and_single_ones_tilt_their_way() {
    let mut config = MirrorConfig::bench();
    config.spread = Default::default();
    let state = settled(&config, [2.0; 4]);
    assert_eq!((state.tilt_x_deg, state.tilt_y_deg), (0.0, 0.0));
    for (drive, x, y) in [
        ([2.0, 1.0, 1.0, 1.0], 0.0, 1.0),
        ([1.0, 2.0, 1.0, 1.0], 1.0, 0.0),
        ([1.0, 1.0, 2.0, 1.0], 0.0, -1.0),
        ([1.0, 1.0, 1.0, 2.0], -1.0, 0.0),
    ] {
        let state = settled(&config, drive);
        let sign = |tilt: f64| {
            if tilt.abs() < 1e-9 {
                0.0
            } else {
                tilt.signum()
            }
        };
        assert_eq!(
            (sign(state.tilt_x_deg), sign(state.tilt_y_deg)),
            (x, y),
            "{state:?}"
        );
    }
}

#[test]
fn the_sign_of_a_drive_does_not_matter_to_the_heat() {
    let (plus, minus) = (
        settled(&MirrorConfig::bench(), [2.0; 4]),
        settled(&MirrorConfig::bench(), [-2.0; 4]),
    );
    assert_eq!(plus.z_um, minus.z_um);
    assert_eq!(plus.current_a.map(|i| -i), minus.current_a);
}

#[test]
fn a_long_dwell_settles_where_ticks_do() {
    let config = MirrorConfig::bench();
    let mut ticked = mirror(&config);
    for _ in 0..40_000 {
        ticked.step([1.9; 4], 100e-6);
    }
    let mut dwelt = mirror(&config);
    dwelt.advance([1.9; 4], 4.0);
    // A nanometre.
    approx::assert_abs_diff_eq!(ticked.state().z_um, dwelt.state().z_um, epsilon = 1e-3);
}

#[test]
fn the_current_is_the_voltage_over_the_resistance_that_the_heater_temperature_says() {
    let mut config = MirrorConfig::bench();
    config.spread = Default::default();
    let state = settled(&config, [3.0; 4]);
    let ohm = 360.0 * (1.0 + 3.92e-3 * state.heater_mean_k[0]);
    assert_relative_eq!(state.current_a[0], 3.0 / ohm, max_relative = 1e-9);
}

#[test]
fn a_seed_repeats_to_the_bit_and_another_differs() {
    let run = |seed| {
        let config = MirrorConfig::bench().with_seed(seed);
        let (mut mirror, mut sensor) = (mirror(&config), Sensor::new(&config));
        (1..50)
            .map(|tick| {
                mirror.step([f64::from(tick % 7) * 0.5; 4], 1e-3);
                (mirror.state(), sensor.read(&mirror.state(), 1e-3))
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(run(3), run(3));
    assert_ne!(run(3), run(4));
}

#[test]
fn an_oven_shows_the_heater_s_coefficient_and_leaves_a_resting_mirror_at_its_temperature() {
    for effect in [
        None,
        Some(Effect::Radiation),
        Some(Effect::HeatLossTemperature),
    ] {
        let mut config = MirrorConfig::bench();
        if let Some(effect) = effect {
            config = config.with_effect(effect, 1.0);
        }
        let mut mirror = VirtualMirror::new(&config).expect("valid mirror");
        let ohm = |mirror: &mut VirtualMirror| {
            mirror.advance([0.0; 4], 100.0);
            let cold_um = mirror.state().z_um;
            mirror.step([0.01; 4], 0.0);
            (0.01 / mirror.state().current_a[0], cold_um)
        };
        let (cold, cold_um) = ohm(&mut mirror);
        mirror.set_ambient(40.0);
        let (warm, warm_um) = ohm(&mut mirror);
        approx::assert_relative_eq!(
            warm / cold - 1.0,
            40.0 * config.heater.tcr_per_k,
            // Five times what the actuators' coefficients are spread by (`bench.toml`).
            max_relative = 0.02
        );
        assert!(
            warm_um - cold_um > 10.0,
            "{effect:?}: {cold_um} to {warm_um} um"
        );
        // 10 mV across 300 ohm and more are 0.3 uW, times some 6 K/mW.
        assert!(
            mirror.state().hottest_k < 0.01,
            "{effect:?}: {:?}",
            mirror.state()
        );
        mirror.set_ambient(0.0);
        let (again, again_um) = ohm(&mut mirror);
        approx::assert_relative_eq!(again, cold, max_relative = 1e-9);
        approx::assert_abs_diff_eq!(again_um, cold_um, epsilon = 1e-6);
    }
}

#[test]
fn a_mirror_that_ages_stays_as_warm_as_it_is() {
    let config = MirrorConfig::bench()
        .with_effect(Effect::HeatLossTemperature, 1.0)
        .with_effect(Effect::Hysteresis, 1.0);
    let mut mirror = VirtualMirror::new(&config).expect("valid mirror");
    mirror.set_ambient(10.0);
    mirror.set_air_loss(1.2);
    mirror.set_stage(25.0);
    mirror.advance([1.5; 4], 0.02);
    let mut same = mirror.clone();
    same.become_mirror(&config).expect("valid mirror");
    for _ in 0..100 {
        for mirror in [&mut mirror, &mut same] {
            mirror.step([1.8; 4], 1e-4);
        }
        // A nanometre: steps may be cut otherwise, and are exact to that.
        let apart_um = same.state().seen_z_um - mirror.state().seen_z_um;
        approx::assert_abs_diff_eq!(apart_um, 0.0, epsilon = 1e-3);
    }
    let mut aged = config.clone();
    aged.trim.ohm[2] = 1.1;
    let before = mirror.state();
    mirror.become_mirror(&aged).expect("valid mirror");
    let after = mirror.state();
    // The mean is weighted by resistance, and rounded.
    for (after, before) in after.heater_mean_k.into_iter().zip(before.heater_mean_k) {
        approx::assert_relative_eq!(after, before, max_relative = 1e-12);
    }
    assert_eq!(after.current_a[0], before.current_a[0]);
    approx::assert_relative_eq!(
        after.current_a[2],
        before.current_a[2] / 1.1,
        max_relative = 1e-12
    );
    aged.trim.ohm[2] = f64::NAN;
    assert!(mirror.become_mirror(&aged).is_err());
    assert_eq!(mirror.state(), after);
}

#[test]
fn warm_air_conducts_as_the_law_says_that_warmed_it() {
    let config = MirrorConfig::bench().with_effect(Effect::HeatLossTemperature, 1.0);
    let rise = |rise_k: f64| {
        let mut mirror = VirtualMirror::new(&config).expect("valid mirror");
        mirror.set_ambient(rise_k);
        mirror.advance([1.0; 4], 100.0);
        let state = mirror.state();
        state.heater_mean_k[0] / state.current_a[0]
    };
    // 40 K add 2 * 3e-3 * 40 of the air's conductance, less for the curve and for what the ends conduct.
    let kept = rise(40.0) / rise(0.0);
    assert!((0.78..0.95).contains(&kept), "{kept}");
}

#[test]
fn air_that_takes_more_cools_a_driven_mirror_and_no_cold_one() {
    let mut mirror = VirtualMirror::new(&MirrorConfig::bench()).expect("valid mirror");
    let rests = |mirror: &mut VirtualMirror, volts: f64| {
        mirror.advance([volts; 4], 100.0);
        mirror.state()
    };
    let before = rests(&mut mirror, 2.0);
    mirror.set_air_loss(1.2);
    let more = rests(&mut mirror, 2.0);
    // Part of the heat leaves through the beams' ends, which the air does not change.
    let kept = more.heater_mean_k[0] / before.heater_mean_k[0];
    assert!((1.0 / 1.2..0.99).contains(&kept), "{kept}");
    assert!(more.current_a[0] > before.current_a[0]);
    mirror.set_air_loss(f64::NAN);
    let again = rests(&mut mirror, 2.0);
    approx::assert_abs_diff_eq!(again.z_um, before.z_um, epsilon = 1e-4);
    mirror.set_air_loss(1.2);
    let cold = rests(&mut mirror, 0.0);
    // Nothing is left after 100 s.
    assert!(cold.z_um.abs() < 1e-6 && cold.hottest_k < 1e-6, "{cold:?}");
}

#[test]
fn a_stage_moves_what_the_sensor_sees_and_nothing_else() {
    let config = MirrorConfig::bench().with_effect(Effect::SensorLag, 1.0);
    let mut mirror = VirtualMirror::new(&config).expect("valid mirror");
    mirror.set_stage(50.0);
    mirror.advance([0.0; 4], 1e-4);
    let at_once = mirror.state();
    mirror.advance([0.0; 4], 1.0);
    let later = mirror.state();
    // A critically damped filter of 160 Hz has gone half a percent of the way after 0.1 ms: 0.25 um.
    assert!(at_once.seen_z_um < 10.0, "{at_once:?}");
    approx::assert_abs_diff_eq!(later.seen_z_um, 50.0, epsilon = 1e-6);
    assert!(at_once.z_um.abs() < 1e-9 && later.z_um.abs() < 1e-9);
}
