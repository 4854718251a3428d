//! Every effect can be switched on, shows itself, and stays numbers.

use virtual_mirror::{Effect, Family, MirrorConfig, Sensor, State, VirtualMirror};

fn plain() -> MirrorConfig {
    let mut config = MirrorConfig::bench();
    config.motion = None;
    config.shape.rest_height_um = 0.0;
    noiseless(config)
}

fn noiseless(mut config: MirrorConfig) -> MirrorConfig {
    config.sensor.position_noise_nm = 0.0;
    config.sensor.wander_nm = 0.0;
    config
}

/// Displacement read (um) and first current (mA) at a few moments of a drive that goes up, down, and moves fast.
fn trace(config: &MirrorConfig, ticks_per_ms: u32) -> Vec<[f64; 2]> {
    let mut mirror = VirtualMirror::new(config).expect("valid mirror");
    let mut sensor = Sensor::new(config);
    let mut rows = Vec::new();
    let mut look = |state: State| {
        rows.push([sensor.read(&state, 1.0).z_um, state.current_a[0] * 1e3]);
    };
    let sweep = (1..=7).map(|step| ([f64::from(step) * 0.5; 4], 2.0));
    let after = [
        ([3.5; 4], 20.0),
        ([2.5, 0.2, 0.2, 0.2], 2.0),
        ([1.0; 4], 60.0),
    ];
    for (drive, seconds) in sweep.chain(after) {
        mirror.advance(drive, seconds);
        look(mirror.state());
    }
    for (volts, ms) in [(3.0, 40), (2.0, 40)] {
        for _ in 0..ms {
            for _ in 0..ticks_per_ms {
                mirror.step([volts; 4], 1e-3 / f64::from(ticks_per_ms));
            }
            look(mirror.state());
        }
    }
    rows
}

fn largest_change(a: &[[f64; 2]], b: &[[f64; 2]]) -> (f64, f64) {
    let change = |k: usize| {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a[k] - b[k]).abs())
            .fold(0.0, f64::max)
    };
    (change(0), change(1))
}

#[test]
fn every_effect_shows_itself_at_a_plausible_size() {
    let drawn = Family::ALL.map(|family| noiseless(MirrorConfig::draw(family, 3)));
    for config in drawn.into_iter().chain([plain()]) {
        let without = trace(&config, 4);
        for &effect in Effect::ALL {
            let with = trace(&config.clone().with_effect(effect, 1.0), 4);
            let (z_um, current_ma) = largest_change(&with, &without);
            let what = format!(
                "{}: {effect}: z {z_um:.3} um, I {:.3} uA",
                config.name,
                1e3 * current_ma
            );
            println!("{what}");
            assert!(with.iter().flatten().all(|x| x.is_finite()), "{what}");
            assert!((0.05..120.0).contains(&z_um) || current_ma > 2e-3, "{what}");
        }
    }
}

#[test]
fn a_stronger_effect_is_larger() {
    let without = trace(&plain(), 4);
    for &effect in Effect::ALL {
        let size = |strength| {
            let (z, current) =
                largest_change(&trace(&plain().with_effect(effect, strength), 4), &without);
            z + 10.0 * current
        };
        assert!(
            size(0.3) < size(1.0) && size(1.0) < size(3.0),
            "{effect}: {} {} {}",
            size(0.3),
            size(1.0),
            size(3.0)
        );
    }
}

#[test]
fn the_solver_is_no_effect() {
    for &effect in Effect::ALL {
        let config = plain().with_effect(effect, 1.0);
        let (z_um, _) = largest_change(&trace(&config, 10), &trace(&config, 40));
        // A quarter of a sensor's noise, 20 nm.
        assert!(
            z_um < 0.005,
            "{effect}: a quarter of the step moves z by {} nm",
            1e3 * z_um
        );
    }
}

#[test]
fn ids_are_names_both_ways() {
    for &effect in Effect::ALL {
        assert_eq!(effect.id().parse::<Effect>().as_ref(), Ok(&effect));
    }
    assert_eq!(
        Effect::ALL
            .iter()
            .filter(|effect| effect.is_listed())
            .count(),
        22
    );
    assert!("warp-drive".parse::<Effect>().is_err());
}

#[test]
fn a_mirror_file_switches_effects_on() {
    let text = format!(
        "{}\n[effects]\ncreep = 0.5\n",
        include_str!("../mirrors/bench.toml")
    );
    let config = MirrorConfig::from_toml(&text).expect("valid file");
    assert_eq!(
        config,
        MirrorConfig::bench().with_effect(Effect::Creep, 0.5)
    );
    let wrong = text.replace("creep", "crepe");
    let said = MirrorConfig::from_toml(&wrong)
        .expect_err("must be refused")
        .to_string();
    assert!(said.contains("crepe"), "{said}");
}
