//! Identification finds what the data support, and invents nothing.

use experiments::{Experiment, Measurement};
use identification::{Dataset, Identification, Tried, identify};
use measurement::Session;
use mirror_model::{Model, Preset, Symbol};
use virtual_mirror::MirrorConfig;
use virtual_sessions::{Instruments, measure};

fn identified(experiments: Vec<Experiment>, instruments: Instruments) -> (Model, Identification) {
    let session = measure(&MirrorConfig::bench(), &experiments, instruments);
    from(&session.expect("the mirror is possible"))
}

fn from(session: &Session) -> (Model, Identification) {
    let data = Dataset::new(session);
    identify(&Model::from(Preset::Reconciled), &data, &["a.csv".into()]).expect("a finite answer")
}

fn a_sweep_and_a_step() -> Vec<Experiment> {
    vec![
        Experiment::sweep(3.5, 14, 1.0, 1),
        Experiment::step(2.0, 6.0, 5e3).after(5.0),
    ]
}

fn verdict<'a>(found: &'a Identification, what: &str) -> (bool, &'a str) {
    let tried = tried(found, what);
    (tried.kept, &tried.because)
}

fn tried<'a>(found: &'a Identification, what: &str) -> &'a Tried {
    let tried = found.tried.iter().find(|tried| tried.what == what);
    tried.unwrap_or_else(|| panic!("{what} was not tried"))
}

/// How long the step is held that would show it.
fn step_s(tried: &Tried) -> Option<f64> {
    match tried.shown_by {
        Some(Measurement::Step { hold_s, .. }) if !tried.kept => Some(hold_s),
        _ => None,
    }
}

#[test]
fn steady_points_give_no_time_constants_and_say_what_would() {
    let sweep = Experiment::sweep(3.5, 14, 1.0, 1);
    let (model, found) = identified(vec![sweep], Instruments::PositionAndCurrents);
    for what in ["a second thermal pole", "resonance", "thermal-lag"] {
        assert_eq!(step_s(tried(&found, what)), Some(30.0), "{what}");
    }
    assert_eq!(model.parameters.get(Symbol::MiddleWeight), 0.0);
    assert!(!found.parameters.keys().any(|name| name.starts_with("tau")));
    assert_eq!(found.parameters["R0.1"].unit, "ohm");
}

#[test]
fn too_few_seconds_give_no_slow_pole_and_no_memory() {
    let short = Experiment::step(2.0, 0.5, 5e3);
    let (model, found) = identified(vec![short], Instruments::PositionAndCurrents);
    for what in ["a slow thermal pole", "creep", "hysteresis"] {
        assert_eq!(step_s(tried(&found, what)), Some(60.0), "{what}");
    }
    assert_eq!(model.parameters.get(Symbol::SlowWeight), 0.0);
}

#[test]
fn without_a_sensor_nothing_is_said_of_the_motion() {
    let step = Experiment::step(2.0, 6.0, 5e3);
    let (_, found) = identified(vec![step], Instruments::Currents);
    assert!(!verdict(&found, "resonance").0 && !verdict(&found, "creep").0);
    assert!(found.residual_rms_um.is_none() && found.residual_rms_ma.is_some());
}

#[test]
fn a_step_shows_the_resonance_with_its_error_and_no_memory_that_is_not_there() {
    let (model, found) = identified(a_sweep_and_a_step(), Instruments::PositionAndCurrents);
    // `mirrors/bench.toml`: 1450 Hz, no memory, and heat that is all fast.
    let frequency = &found.parameters["resonance.f"];
    // A move takes five periods: 1 % is a twentieth of one.
    assert!(
        (frequency.value - 1450.0).abs() < 15.0,
        "{}",
        frequency.value
    );
    assert!(frequency.standard_error.is_some_and(|error| error < 10.0));
    assert!(
        !verdict(&found, "creep").0 && !verdict(&found, "hysteresis").0,
        "{found:?}"
    );
    assert!(!verdict(&found, "a slow thermal pole").0, "{found:?}");
    // Of the order of a millisecond, as beams of a quarter of a millimetre have it.
    assert!(model.parameters.fast_s > 1e-4 && model.parameters.fast_s < 5e-3);
    // Twice what lumped equations are not asked to follow, 0.1 um (`docs/theory/missing-physics.md`).
    assert!(
        found.residual_rms_um.is_some_and(|rms| rms < 0.2),
        "{found:?}"
    );
    assert_eq!(model.provenance.files, ["a.csv"]);
}

#[test]
fn actuators_driven_alone_show_the_heat_that_goes_across() {
    let paper = MirrorConfig::paper();
    let sweep = || Experiment::sweep(3.5, 7, 1.0, 1);
    let found = |experiments: &[Experiment]| {
        let session = measure(&paper, experiments, Instruments::PositionAndCurrents);
        from(&session.expect("the mirror is possible")).1
    };
    let alike = found(&[sweep()]);
    let crosstalk = tried(&alike, "crosstalk");
    assert!(
        !crosstalk.kept && matches!(crosstalk.shown_by, Some(Measurement::Single { .. })),
        "{crosstalk:?}"
    );
    let apart = found(&[sweep(), Experiment::single(3.5, 4, 1.0).after(5.0)]);
    // Its beams lose their heat into one ledge.
    assert!(verdict(&apart, "crosstalk").0, "{apart:?}");
    // Three times what `calibrate` leaves of this mirror from ten times as many readings (`docs/guide/calibrate.md`).
    assert!(
        apart.residual_rms_um.is_some_and(|rms| rms < 1.0),
        "{apart:?}"
    );
}

#[test]
fn a_gap_and_a_channel_that_is_missing_take_nothing_from_the_rest() {
    let experiments = a_sweep_and_a_step();
    let instruments = Instruments::PositionAndCurrents;
    let mut session = measure(&MirrorConfig::bench(), &experiments, instruments).expect("possible");
    for (_, file) in &mut session.files {
        // Half a second of the step, and two steps of the sweep.
        file.rows
            .retain(|row| !(1.0..1.5).contains(&row.t_s) && !(5.5..7.5).contains(&row.t_s));
        for row in &mut file.rows {
            row.current_a[1] = None;
        }
    }
    let (_, found) = from(&session);
    assert!(found.parameters.contains_key("R0.1") && !found.parameters.contains_key("R0.2"));
    let frequency = found.parameters["resonance.f"].value;
    // As without a gap.
    assert!((frequency - 1450.0).abs() < 15.0, "{frequency}");
}
