use super::*;
use crate::report::ProposedForm;
use crate::whereabouts::{Driver, Located, Place, StageConfidence, Whereabouts};
use identification::{Estimate, Unit};
use mirror_model::effect::{Acts, Stage};
use std::collections::BTreeMap;

fn error(unit: Unit) -> BeforeAfter {
    BeforeAfter {
        before: 0.4,
        after: 0.2,
        unit,
    }
}

pub(crate) fn ranked(effect: &str, score: f64) -> Ranked {
    let value = Estimate {
        value: 0.0267,
        standard_error: Some(0.0027),
        unit: "1".into(),
    };
    Ranked {
        effect: effect.into(),
        form: None,
        score,
        threshold: 48.0,
        null_scores: vec![],
        weight: 1.0,
        detection_limit: Some(0.01),
        held_out_rms: error(Unit::Milliampere),
        error_rms: error(Unit::Milliampere),
        current_rms: None,
        null_improvement: None,
        plausible: true,
        parameters: BTreeMap::from([("c".into(), value)]),
        look_alikes: vec![],
        why: "for a reason".into(),
    }
}

fn diagnosis(verdict: Verdict, effects: &[&str]) -> Diagnosis {
    Diagnosis {
        verdict,
        effects: effects.iter().map(|&id| id.into()).collect(),
        discrepancy_rms: Rms {
            value: 0.3,
            unit: Unit::Milliampere,
        },
        remainder: None,
        whereabouts: None,
        proposal: None,
        error_rms: error(Unit::Milliampere),
        misfit: 2.0,
        solver_error: 0.0,
        invisible: vec!["radiation".into()],
        infeasible: vec![],
        ranking: vec![ranked("creep", 100.0), ranked("hysteresis", 30.0)],
        next_measurement: None,
        thinned_rows: 0,
        odd_file: None,
        notes: vec![],
    }
}

#[test]
fn a_diagnosis_begins_with_its_verdict() {
    for (verdict, effects, first) in [
        (Verdict::Named, &["creep"][..], "Missing: creep"),
        (
            Verdict::Ambiguous,
            &["creep", "hysteresis"],
            "Missing: one of creep, hysteresis; these data cannot tell which",
        ),
        (
            Verdict::Unknown,
            &[],
            "Something is missing, and none of the known effects explains it",
        ),
        (
            Verdict::None,
            &[],
            "Nothing is missing: what is left is noise and the model's discrepancy, though creep scores more than its threshold and is not named",
        ),
    ] {
        let said = diagnosis(verdict, effects).to_string();
        assert_eq!(said.lines().next(), Some(first));
    }
    for (verdict, effects, first) in [
        (
            Verdict::Named,
            &["creep"][..],
            "Missing: creep, or nothing: `hold` reads otherwise than the other files, which explains more",
        ),
        (
            Verdict::Unknown,
            &[],
            "`hold` reads otherwise than the other files, which explains what no known effect does",
        ),
        (
            Verdict::None,
            &[],
            "Nothing is missing, but `hold` reads otherwise than the other files",
        ),
    ] {
        let mut odd = diagnosis(verdict, effects);
        odd.odd_file = Some("hold".into());
        assert_eq!(odd.to_string().lines().next(), Some(first));
    }
    let mut blind = diagnosis(Verdict::None, &[]);
    blind.invisible.push("crosstalk".into());
    assert!(blind.to_string().starts_with("These data cannot tell"));
}

#[test]
fn an_effect_that_only_currents_show_is_told_to_be_named_for_them() {
    let mut found = diagnosis(Verdict::Named, &["creep"]);
    let errors = |before, after, unit| BeforeAfter {
        before,
        after,
        unit,
    };
    found.error_rms = errors(0.136, 0.212, Unit::Micrometre);
    found.ranking[0].current_rms = Some(errors(0.0044, 0.0031, Unit::Milliampere));
    let said = found.to_string();
    let told = "  of the currents, for which it is named, 0.0044 mA rms, then 0.0031 mA";
    assert!(said.lines().any(|line| line == told), "{said}");
    found.error_rms.after = 0.05;
    assert!(found.to_string().contains("  of the currents 0.0044"));
}

#[test]
fn what_scores_more_than_its_threshold_is_not_what_would_have_been_seen() {
    let mut found = diagnosis(Verdict::None, &[]);
    let said = found.to_string();
    assert!(said.contains("would have seen hysteresis (") && !said.contains("seen creep"));
    found.ranking[0].score = 40.0;
    let whole = "Nothing is missing: what is left is noise and the model's discrepancy";
    assert_eq!(found.to_string().lines().next(), Some(whole));
}

#[test]
fn what_takes_most_of_the_error_is_told_with_where_it_does_not() {
    let mut found = diagnosis(Verdict::Named, &["radiation"]);
    found.remainder = Some(Remainder {
        rms: found.discrepancy_rms,
        is_the_lesser_part: true,
        up_to_v: Some(9.0),
    });
    let said = found.to_string();
    let first =
        "Missing: mostly radiation, up to 9.00 V; something else above, which leaves 0.300 mA rms";
    assert_eq!(said.lines().next(), Some(first));
    assert!(said.contains("host-tool effect add radiation"), "{said}");
}

#[test]
fn what_is_named_for_its_score_and_leaves_most_of_the_error_is_not_all() {
    let mut found = diagnosis(Verdict::Named, &["radiation"]);
    found.remainder = Some(Remainder {
        rms: found.discrepancy_rms,
        is_the_lesser_part: false,
        up_to_v: None,
    });
    let said = found.to_string();
    let first = "Missing: radiation, and something else, which leaves 0.300 mA rms";
    assert_eq!(said.lines().next(), Some(first));
    assert!(said.contains("for the rest add it"), "{said}");
}

#[test]
fn what_the_model_runs_away_with_is_told() {
    let mut found = diagnosis(Verdict::None, &[]);
    found.infeasible = vec!["radiation".into()];
    let told = "not tried, since the model runs away with them: radiation";
    assert!(found.to_string().contains(told), "{found}");
}

#[test]
fn where_it_is_is_told_with_what_it_behaves_like() {
    let mut found = diagnosis(Verdict::Unknown, &[]);
    let place = Place {
        acts: Acts::Resistance,
        driver: Driver::Exposure,
    };
    let stage = |stage, confidence| StageConfidence {
        stage,
        score: 1e3,
        confidence,
    };
    found.whereabouts = Some(Whereabouts {
        stages: vec![
            stage(Stage::Resistance, 0.88),
            stage(Stage::Drive, 0.08),
            stage(Stage::Heat, 0.04),
        ],
        places: vec![Located {
            stage: place.stage(),
            place,
            score: 1e3,
            threshold: 64.0,
        }],
    });
    found.proposal = Some(ProposedForm {
        effect: "proposed-resistance".into(),
        text: String::new(),
        sentence: "the resistance x behaves as x * (1 + 2.0e-4 * s)".into(),
        stage: Stage::Resistance,
        score: 900.0,
        threshold: 70.0,
        error_rms: error(Unit::Milliampere),
        held_out_rms: error(Unit::Milliampere),
        current_rms: None,
    });
    let said = found.to_string();
    let expected = "  without the list, where it is: resistance 88 %, drive 8 %: the resistance varies with how long it was how hot\n    \
                    the resistance varies with how long it was how hot (score 1000, threshold 64)\n  \
                    no known effect; the resistance x behaves as x * (1 + 2.0e-4 * s)\n    \
                    error 0.400 mA rms, with it 0.200; on readings held out 0.400, with it 0.200\n";
    assert!(said.ends_with(expected), "{said}");
    // A law of the heaters may lower the currents' error alone.
    if let Some(proposal) = &mut found.proposal {
        proposal.current_rms = Some(error(Unit::Milliampere));
    }
    let more = "    of the currents 0.4000 mA rms, with it 0.2000\n";
    assert!(found.to_string().ends_with(&format!("{expected}{more}")));
    // Somewhere else, heat, which may be with 4 % and is beyond the 90 % that are told.
    if let Some(proposal) = &mut found.proposal {
        proposal.stage = Stage::Heat;
    }
    let said = found.to_string();
    assert!(said.contains("    it acts elsewhere (heat) than"), "{said}");
    // Of what is named, the places are not listed.
    let named = Diagnosis {
        verdict: Verdict::Named,
        ..found
    };
    assert!(!named.to_string().contains("threshold 64"), "{named}");
}

#[test]
fn errors_carry_their_unit() {
    let said = diagnosis(Verdict::Named, &["creep"]).to_string();
    assert!(
        said.contains("error 0.400 mA rms, with creep added 0.200 mA"),
        "{said}"
    );
    assert!(said.contains("0.300 mA rms in the median mirror"), "{said}");
}

/// What is added where nothing is missing fits noise, and is no find.
#[test]
fn no_effect_is_told_as_added_where_nothing_is_missing() {
    let mut found = diagnosis(Verdict::None, &[]);
    found.ranking[0].current_rms = Some(error(Unit::Milliampere));
    let said = found.to_string();
    let errors: Vec<&str> = said
        .lines()
        .filter(|line| line.starts_with("  error ") || line.starts_with("  of the currents "))
        .collect();
    assert_eq!(errors, ["  error 0.400 mA rms"], "{said}");
    found.verdict = Verdict::Unknown;
    assert!(
        found.to_string().contains("with creep added"),
        "it is evidence there: {found}"
    );
}

#[test]
fn limits_are_told_where_nothing_is_missing() {
    let said = diagnosis(Verdict::None, &[]).to_string();
    assert!(said.contains("I would have seen hysteresis ("), "{said}");
    assert!(
        said.contains("invisible in these data, at any plausible size: radiation"),
        "{said}"
    );
}
