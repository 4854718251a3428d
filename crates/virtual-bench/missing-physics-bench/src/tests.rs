//! Short forms of the bench: one sweep of mirrors whose design the diagnosis is told, or not; a data set of three sessions.

use crate::arguments::Instruments;
use crate::case::{Case, Hidden};
use crate::export::{self, Exported, Split};
use crate::other_mirror::{Law, OtherMirror};
use crate::outcome::{Outcome, diagnosed};
use diagnosis::diagnose;
use diagnosis::{CALIBRATING, Verdict};
use measurement::Session;
use mirror_model::effect::Stage;
use mirror_model::{Model, Preset};
use std::fs;
use std::path::Path;
use std::process::Command;
use virtual_mirror::{Effect, Family};

fn outcome(hidden: Hidden, is_described: bool, cache: &Path) -> Outcome {
    let case = Case {
        hidden,
        family: Family::G,
        seed: 41,
        design: is_described.then_some(40),
        noise_nm: 20.0,
        instruments: Instruments::Sweep,
    };
    diagnosed(&case, true, cache).expect("a possible mirror")
}

#[test]
#[ignore = "long"]
fn what_ignorance_hides_is_found_where_the_design_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let hidden = Hidden::One(Effect::QuadraticTcr, 1.0);
    let open = outcome(hidden, false, folder.path());
    assert!(
        !open.is_found(Instruments::Sweep.set()),
        "{open}\n{}",
        open.rivals()
    );
    println!("{open}\n{}", open.rivals());
    let described = outcome(hidden, true, folder.path());
    assert!(
        described.is_found(Instruments::Sweep.set()),
        "{described}\n{}",
        described.rivals()
    );
    let nothing = outcome(Hidden::Nothing, true, folder.path());
    assert_eq!(nothing.found.verdict, Verdict::None, "{nothing}");
}

#[test]
fn what_is_exported_tells_nothing_of_what_is_hidden_and_is_scored() {
    let folder = tempfile::tempdir().expect("a folder");
    let exported = export::sessions(8601, 1);
    for Exported { id, split, case } in &exported {
        let is_calibrating = CALIBRATING.contains(&case.family);
        assert_eq!(is_calibrating, *split == Split::Train, "{id}");
    }
    let is_chosen = |e: &Exported| ["train-001", "test-001", "test-002"].contains(&e.id.as_str());
    let few: Vec<Exported> = exported.into_iter().filter(is_chosen).collect();
    export::write(folder.path(), &few).expect("written");
    let manifest = fs::read_to_string(folder.path().join("manifest.csv")).expect("text");
    let lines: Vec<&str> = manifest.lines().collect();
    assert_eq!(lines.len(), 4, "{manifest}");
    assert!(lines[1].starts_with("train-001,train,20,z I1 I2 I3 I4,") && !lines[1].ends_with(','));
    assert_eq!(lines[2], "test-001,test,20,z I1 I2 I3 I4,");
    for exported in &few {
        let session =
            Session::load(&[folder.path().join("sessions").join(&exported.id)]).expect("readable");
        let measured = exported
            .case
            .measured(&exported.case.config())
            .expect("possible");
        assert_eq!(session.files.len(), measured.files.len());
        for (name, file) in &session.files {
            for effect in Effect::ALL {
                assert!(
                    !file.to_string().contains(effect.id()),
                    "{name} tells {effect}"
                );
            }
        }
    }

    // Two answers, and what two methods might say of them.
    let shown = [None, Some(true), Some(false)];
    export::write_answers(folder.path(), &few, &shown).expect("written");
    let answers = fs::read_to_string(folder.path().join("answers-test.csv")).expect("text");
    assert_eq!(answers.lines().count(), 3, "{answers}");
    let predictions = folder.path().join("silent.csv");
    fs::write(&predictions, "id,verdict,probability\ntest-001,none,0.5\n").expect("written");
    let scripts = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../benches/missing-physics");
    let python = |words: &[&str]| {
        Command::new("python3")
            .arg("-B")
            .args(words)
            .current_dir(&scripts)
            .output()
    };
    let Ok(tests) = python(&["-m", "unittest", "-q", "test_score"]) else {
        println!("no python3: the score is not tested");
        return;
    };
    assert!(
        tests.status.success(),
        "{}",
        String::from_utf8_lossy(&tests.stderr)
    );
    let words = [
        "score.py",
        folder.path().to_str().expect("a path"),
        predictions.to_str().expect("a path"),
    ];
    let scored = python(&words).expect("it ran before");
    let table = String::from_utf8_lossy(&scored.stdout);
    assert!(
        table.contains("| answered | 50 % (1 of 2) |"),
        "{table}{}",
        String::from_utf8_lossy(&scored.stderr)
    );
}

#[test]
#[ignore = "long"]
fn a_law_that_no_list_has_is_placed_on_another_author_s_mirror_and_nothing_where_nothing_is() {
    let folder = tempfile::tempdir().expect("a folder");
    let found = |law| {
        let mirror = OtherMirror { law, seed: 12 };
        let session = mirror
            .session(&experiments::session(3.5))
            .expect("possible");
        diagnose(
            &Model::from(Preset::Paper),
            &session,
            &[],
            Some(folder.path()),
        )
        .expect("finite")
    };
    let nothing = found(None);
    assert_eq!(nothing.verdict, Verdict::None, "{nothing}");
    assert_eq!(nothing.whereabouts, None);
    assert_eq!(nothing.proposal, None);
    let onset = found(Some((Law::FlowOnset, 1.0)));
    let places = onset.whereabouts.as_ref().expect("a place");
    assert_eq!(places.stages[0].stage, Stage::Heat, "{onset}");
    let sum: f64 = places.stages.iter().map(|stage| stage.confidence).sum();
    assert!((sum - 1.0).abs() < 1e-12, "{sum}");
}
