//! The model in time: it ends where the steady model says, and effects do what they say.

use mirror_model::effect::{Active, Effect, Formula, built_in, find};
use mirror_model::{Interval, Model, Output, PistonModel, Preset, simulate};
use std::sync::Arc;

fn hold(voltage_v: f64, duration_s: f64) -> Interval {
    Interval::held([voltage_v; 4], duration_s)
}

fn dynamic() -> Model {
    let mut model = Model::from(Preset::Reconciled);
    let p = &mut model.parameters;
    (
        p.fast_s,
        p.middle_weight,
        p.middle_s,
        p.slow_weight,
        p.slow_s,
    ) = (1e-3, 0.3, 0.035, 0.05, 4.0);
    model
}

fn session() -> Vec<Interval> {
    let mut intervals: Vec<_> = (0..=7).map(|i| hold(0.5 * f64::from(i), 1.0)).collect();
    intervals.push(hold(0.0, 2.0));
    let sine = |i: i32| [1.0 + 0.5 * (f64::from(i) * 0.2).sin(); 4];
    intervals.extend((0..60).map(|i| Interval {
        duration_s: 5e-3,
        from_v: sine(i),
        to_v: sine(i + 1),
        ..Interval::default()
    }));
    intervals
}

#[test]
fn a_long_hold_ends_in_the_steady_state() {
    // 10 pm and 1 nA: what is left after 25 of the slowest time constants, and rounding.
    for model in [Model::from(Preset::Paper), dynamic()] {
        let steady = PistonModel {
            parameters: model.parameters,
        }
        .state_at_voltage(2.0);
        let end = simulate(&model, &[hold(2.0, 100.0)], 0.3).unwrap()[0];
        assert!(
            (end.z_um - steady.z_um).abs() < 1e-5,
            "{} {}",
            end.z_um,
            steady.z_um
        );
        assert!((end.current_a[2] - steady.current_a).abs() < 1e-9);
    }
}

#[test]
fn halving_the_step_changes_nanometres_only() {
    let z = |resolution| simulate(&dynamic(), &session(), resolution).unwrap();
    let worst = z(0.3)
        .iter()
        .zip(z(0.03))
        .map(|(a, b)| (a.z_um - b.z_um).abs())
        .fold(0.0, f64::max);
    // A fifth of what lumped equations are not asked to follow, 0.1 um (`docs/theory/missing-physics.md`).
    assert!(worst < 0.02, "{worst} um");
}

#[test]
fn every_effect_is_nothing_at_strength_0_and_something_otherwise() {
    let mut session = session();
    // A step that is read fast enough to see it ring.
    session.extend([hold(2.0, 2e-4); 20]);
    // A minute, in which what follows the clock gets somewhere.
    session.push(hold(2.0, 60.0));
    let plain = simulate(&dynamic(), &session, 0.3).unwrap();
    for effect in built_in() {
        let mut model = dynamic();
        model.effects = vec![Active::usual(effect)];
        let with = simulate(&model, &session, 0.3).unwrap();
        model.effects[0].values[0] = 0.0;
        let without = simulate(&model, &session, 0.3).unwrap();
        let id = model.effects[0].id();
        for ((w, o), p) in with.iter().zip(&without).zip(&plain) {
            // Rounding.
            assert!((o.z_um - p.z_um).abs() < 1e-4 && w.z_um.is_finite(), "{id}");
        }
        // Usual instruments read 10 nm and 2 uA: five and three of their standard deviations.
        let far = |a: &Output, b: &Output| {
            (a.z_um - b.z_um).abs() + 1e4 * (a.current_a[0] - b.current_a[0]).abs()
        };
        assert!(
            with.iter().zip(&plain).any(|(w, p)| far(w, p) > 0.05),
            "{id}"
        );
    }
}

#[test]
fn a_resonance_rings_at_its_frequency_and_dies_away() {
    let mut model = dynamic();
    let mut resonance = Active::usual(find("resonance").unwrap());
    resonance.values = vec![1.0, 1500.0, 20.0];
    model.effects = vec![resonance];
    let mut intervals = vec![hold(2.0, 1e-4); 200];
    intervals.push(hold(2.0, 60.0));
    let rings = simulate(&model, &intervals, 0.3).unwrap();
    let plain = simulate(&dynamic(), &intervals, 0.3).unwrap();
    let off: Vec<_> = rings
        .iter()
        .zip(&plain)
        .map(|(r, p)| r.z_um - p.z_um)
        .collect();
    let crossings = off[..200].windows(2).filter(|w| w[0] * w[1] < 0.0).count();
    // 60, and a sixth either way: the heat is on its way beneath it.
    assert!(
        (50..70).contains(&crossings),
        "{crossings} in 20 ms at 1500 Hz"
    );
    // Rounding, a minute later.
    assert!(off[200].abs() < 1e-6);
}

#[test]
fn a_formula_that_runs_away_is_an_error_with_its_time() {
    let text = "id = \"bomb\"\nstage = \"heat\"\nacts = \"heating\"\nformula = \"x * exp(q * dT)\"\n\
                [[parameters]]\nsymbol = \"q\"\nunit = \"1/K\"\nstart = 1.0\nlow = 0.0\nhigh = 9.0\n";
    let mut model = dynamic();
    model.effects = vec![Active::usual(Arc::new(
        Formula::parse("bomb.toml", text).unwrap(),
    ))];
    let error = simulate(&model, &session(), 0.3).unwrap_err();
    assert!(
        error.t_s > 0.9 && error.to_string().contains("runs away"),
        "{error}"
    );
}

#[test]
fn a_formula_and_a_built_in_effect_of_one_equation_are_one() {
    let text = "id = \"mine\"\nstage = \"curvature\"\nacts = \"curvature\"\nformula = \"x * (1 + c * dT)\"\n\
                [[parameters]]\nsymbol = \"c\"\nunit = \"1/K\"\nstart = 5e-4\nlow = 0.0\nhigh = 1e-2\n";
    let run = |effect| {
        let mut model = dynamic();
        model.effects = vec![Active::usual(effect)];
        simulate(&model, &session(), 0.3).unwrap()
    };
    assert_eq!(
        run(Arc::new(Formula::parse("mine.toml", text).unwrap())),
        run(find("expansion-temperature").unwrap())
    );
}

#[test]
fn a_strong_heat_loss_comes_to_rest_in_one_long_step() {
    let mut model = Model::from(Preset::Paper);
    model.effects.push(Active::usual(
        find("heat-loss-temperature").expect("built in"),
    ));
    model.effects[0].values[0] = 8e-3;
    let at_once = simulate(&model, &[hold(3.5, 1e6)], 0.5).expect("finite")[0];
    let rise = at_once.temperature_rise_k[0];
    let p = &model.parameters;
    let ohm = p.cold_resistance_ohm * (1.0 + p.resistance_coefficient_per_k * rise);
    let heating = p.thermal_resistance_k_per_w * 3.5 * 3.5 / ohm - 8e-3 * rise * rise;
    // A mK of some 100 K: the solver's own tolerance is a hundredth of it.
    assert!((heating - rise).abs() < 1e-3, "{heating} for {rise}");
}

#[test]
fn an_oven_s_temperature_rise_is_the_whole_mirror_s() {
    let model = dynamic();
    let oven = |voltage_v| Interval {
        ambient_k: 40.0,
        ..hold(voltage_v, 100.0)
    };
    let outputs = simulate(&model, &[hold(0.1, 100.0), oven(0.0), oven(0.1)], 0.3).expect("finite");
    let p = &model.parameters;
    let ohm = |output: &Output| 0.1 / output.current_a[0];
    let growth = ohm(&outputs[2]) / ohm(&outputs[0]) - 1.0;
    // The 0.1 V warm a cold mirror by some tenths of a kelvin.
    let expected = 40.0 * p.resistance_coefficient_per_k;
    assert!(
        (growth / expected - 1.0).abs() < 3e-3,
        "{growth}, not {expected}"
    );
    let expanded = PistonModel { parameters: *p }.displacement_um(40.0);
    assert!((outputs[1].z_um - expanded).abs() < 1e-9, "{outputs:?}");
}

#[test]
fn heat_losses_count_from_the_oven() {
    let own = r#"
id = "own-loss"
title = "a loss of one's own"
stage = "heat"
acts = "heating"
formula = "x - g * (dT * dT - dT_room * dT_room)"
shows = "concave in V"
[[parameters]]
symbol = "g"
unit = "1/K"
start = 3e-3
low = 0.0
high = 1e-2
"#;
    let own: Arc<dyn Effect> = Arc::new(Formula::parse("own.toml", own).expect("a formula"));
    let listed = ["heat-loss-temperature", "radiation", "gap-heat-loss"];
    let listed = listed.map(|id| find(id).expect("an effect"));
    for effect in listed.into_iter().chain([own]) {
        let id = effect.info().id.clone();
        let mut model = dynamic();
        model.effects.push(Active::usual(effect));
        let cold = Interval {
            ambient_k: 40.0,
            ..hold(0.0, 100.0)
        };
        let output = simulate(&model, &[cold], 0.3).expect("finite")[0];
        assert!(
            (output.temperature_rise_k[0] - 40.0).abs() < 1e-9,
            "{id}: {output:?}"
        );
    }
}

#[test]
fn a_stage_moves_what_the_sensor_reads_and_a_slow_sensor_follows() {
    let raised = |duration_s| Interval {
        reference_um: 50.0,
        ..hold(0.0, duration_s)
    };
    let mut model = dynamic();
    for (id, at_once, in_the_end) in [("sensor-gain", 51.0, 51.0), ("sensor-lag", 31.6, 50.0)] {
        let mut active = Active::usual(find(id).expect("an effect"));
        if id == "sensor-lag" {
            active.values = vec![0.1, 0.0];
        }
        model.effects = vec![active];
        let outputs = simulate(&model, &[hold(0.0, 1.0), raised(0.1), raised(10.0)], 0.1);
        let z: Vec<_> = outputs.expect("finite").iter().map(|o| o.z_um).collect();
        assert_eq!(z[0], 0.0);
        // As it is rounded above, 50 um times 1 - 1/e.
        assert!((z[1] - at_once).abs() < 0.05, "{id}: {z:?}");
        assert!((z[2] - in_the_end).abs() < 1e-9, "{id}: {z:?}");
    }
}

#[test]
fn a_filament_s_heat_is_in_balance_however_little_it_conducts() {
    let radiated = |rise_k: f64| (295.0 + rise_k).powi(4) - 295.0_f64.powi(4);
    for (tau_s, conductions) in [
        (0.0, &[1e2, 1e3, 1e4, 1e5, 1e6][..]),
        (0.3, &[1e2, 1e3, 1e4]),
    ] {
        for &thermal_resistance in conductions {
            let mut model = Model::from(Preset::Paper);
            let p = &mut model.parameters;
            (p.cold_resistance_ohm, p.thermal_resistance_k_per_w) = (2.2, thermal_resistance);
            p.fast_s = tau_s;
            let mut radiation = Active::usual(find("radiation").expect("built in"));
            radiation.values = vec![1e-13];
            model.effects.push(radiation);
            let ladder: Vec<_> = (1..=12)
                .chain((0..12).rev())
                .map(|i| hold(0.5 * f64::from(i), 20.0))
                .collect();
            let outputs = simulate(&model, &ladder, 0.5).expect("an answer");
            for (interval, output) in ladder.iter().zip(outputs) {
                let (power, rise) = (
                    interval.to_v[0] * output.current_a[0],
                    output.temperature_rise_k[0],
                );
                let lost = rise / thermal_resistance + 1e-13 * radiated(rise);
                // A fixed point is met to 1e-5 K, which 100 K/W make 1e-7 W.
                assert!(
                    (lost - power).abs() < 1e-4 * power.max(1e-3),
                    "R_T {thermal_resistance}, tau {tau_s}, {} V: {rise} K, {power} W in, {lost} W out",
                    interval.to_v[0]
                );
            }
        }
    }
}
