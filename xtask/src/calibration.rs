//! A calibration has one home: the tool on a board and the closed loop go the same way, from `calibration-procedure`, and nothing
//! else takes its steps. Figures of the one are those of the other then.

use std::fs;
use std::path::Path;

use crate::cargo::workspace;
use crate::circles::used;
use crate::sources::sources;

const HOME: &str = "crates/lab/calibration-procedure";
/// Who goes that way.
const CALLERS: [&str; 2] = [
    "host-tool/src/commands/calibrate",
    "crates/virtual-bench/closed-loop/src",
];
/// The steps from an identified mirror to a calibration, of the package `calibration`.
const STEPS: [&str; 3] = ["corrected", "refined", "with_piston_residual"];

/// What of these a source uses of a package, outside of its tests.
fn used_of<'a>(source: &str, package: &str, names: &[&'a str]) -> Vec<&'a str> {
    // Most sources name none of them, and need not be parsed.
    if !names.iter().any(|name| source.contains(name)) {
        return Vec::new();
    }
    let used = used(source);
    let is_used = |name: &&str| used.contains(&vec![package.to_owned(), name.to_string()]);
    names.iter().copied().filter(is_used).collect()
}

/// The steps that a source takes.
fn steps(source: &str) -> Vec<&'static str> {
    used_of(source, "calibration", &STEPS)
}

fn read(file: &Path) -> String {
    fs::read_to_string(file).expect("a source")
}

#[test]
fn who_calibrates_goes_the_procedure_s_way() {
    for caller in CALLERS {
        let files = sources(&workspace().join(caller));
        let goes =
            |file: &Path| !used_of(&read(file), "calibration_procedure", &["Procedure"]).is_empty();
        assert!(
            files.iter().any(|file| goes(file)),
            "{caller} goes another way"
        );
    }
}

#[test]
fn nobody_else_takes_its_steps() {
    let home = workspace().join(HOME);
    let files = sources(workspace());
    let elsewhere = files.iter().filter(|file| !file.starts_with(&home));
    for file in elsewhere {
        assert_eq!(steps(&read(file)), [""; 0], "{}", file.display());
    }
    let at_home = sources(&home);
    for step in STEPS {
        let takes = |file: &Path| steps(&read(file)).contains(&step);
        assert!(at_home.iter().any(|file| takes(file)), "{step} is gone");
    }
}

#[test]
fn a_step_is_found_however_it_is_named() {
    assert_eq!(steps("use calibration::{Refined, refined};"), ["refined"]);
    assert_eq!(
        steps("fn f() { calibration::corrected(1); }"),
        ["corrected"]
    );
    assert_eq!(
        steps("use super::refined; // calibration::refined"),
        [""; 0]
    );
    let for_tests = "#[cfg(test)] mod tests { use calibration::refined; }";
    assert_eq!(steps(for_tests), [""; 0]);
}
