//! A short form of the bench: one sweep of mirrors whose design the diagnosis is told, or not.

use crate::case::{Case, Hidden, Instruments};
use crate::outcome::{Outcome, diagnosed};
use diagnosis::Verdict;
use std::path::Path;
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
