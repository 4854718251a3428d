//! A room that swings faster than air conditioning does, around mirrors that lack nothing else. How it moves the
//! readings is written down here, by what a kelvin does to such mirrors, and shares nothing with the effect's forms.

use diagnosis::{Diagnosis, Verdict, diagnose};
use experiments::Experiment;
use identification::Dataset;
use identification::dataset::Channel;
use mirror_model::{Model, Preset};
use shared_cache::null_ensembles;
use std::f64::consts::TAU;
use virtual_mirror::{Family, MirrorConfig};
use virtual_sessions::{Instruments, measure};

/// What a kelvin does to the displacement (um; the paper's mirror) and, in parts of itself, to a resistance (platinum's films).
const UM_PER_K: f64 = 1.8;
const PER_K: f64 = 3.5e-3;

#[test]
fn a_room_that_swings_in_13_s_is_named_with_its_period() {
    let drives = [
        Experiment::sweep(3.5, 14, 1.0, 1),
        Experiment::single(3.5, 5, 1.0).after(5.0),
    ];
    let found = in_a_room(MirrorConfig::draw(Family::F, 861), &drives, 0.5, 13.0);
    assert_eq!(found.verdict, Verdict::Named, "{found}");
    assert_eq!(found.effects, ["ambient-drift"], "{found}");
    // Within a tenth of a line's width, 13 s of 13 s / 58 s.
    let period_s = found.ranking[0].parameters["T"].value;
    assert!((period_s - 13.0).abs() < 0.3, "{found}");
    // The swing is all that it hides: two thirds of the error, of which the model's discrepancy is the rest.
    assert!(found.error_rms.fall() > 0.5, "{found}");
}

#[test]
#[ignore = "long"]
fn rooms_that_swing_in_13_to_140_s_are_named() {
    for (family, seed, kelvin, period_s) in [
        (Family::A, 862, 0.4, 13.0),
        (Family::C, 863, 1.0, 35.0),
        (Family::E, 864, 0.7, 60.0),
        (Family::G, 865, 1.0, 140.0),
    ] {
        let mirror = MirrorConfig::draw(family, seed);
        let found = in_a_room(mirror, &experiments::session(3.5), kelvin, period_s);
        assert_eq!(found.effects, ["ambient-drift"], "{period_s} s: {found}");
    }
}

/// What is said of a mirror in a room that swings by so much (K), in so long (s).
fn in_a_room(mirror: MirrorConfig, drives: &[Experiment], kelvin: f64, period_s: f64) -> Diagnosis {
    let session = measure(&mirror, drives, Instruments::PositionAndCurrents);
    let still = Dataset::new(&session.expect("a possible mirror"));
    let ends_s: Vec<f64> = still.ends_s().collect();
    let phase = 0.2 * period_s;
    let swing = |t_s: f64| kelvin * (TAU * t_s / period_s + phase).sin();
    let moved = still.observations.iter().map(|o| {
        let warmer = swing(ends_s[o.interval]) - swing(0.0);
        match o.channel {
            Channel::Displacement => o.value + UM_PER_K * warmer,
            Channel::Current(_) => o.value / (1.0 + PER_K * warmer),
        }
    });
    let data = still.with_values(&moved.collect::<Vec<_>>());
    let cache = null_ensembles();
    diagnose(&Model::from(Preset::Paper), &data, &[], cache.as_deref()).expect("a finite answer")
}
