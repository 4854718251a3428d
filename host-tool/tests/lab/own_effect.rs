//! The worked example of `docs/guide/own-effect.md`: an effect that no list knows is hidden, told to be unknown, described, and
//! added.

use std::path::Path;

use crate::common::no_boards;
use crate::{json, session};

#[test]
fn what_is_unknown_is_described_and_added_and_the_error_falls() {
    let place = no_boards();
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/examples/aging.toml");
    let files = session("\"heater-aging\"").display().to_string();
    let [example, with] =
        [example, place.path().join("aged.toml")].map(|p| p.display().to_string());
    assert_eq!(json(&["diagnose", "paper", &files])["verdict"], "unknown");
    let told = json(&["diagnose", "paper", &files, "--effect", &example]);
    assert_eq!(
        told["ranking"][0]["effect"], "my-aging",
        "{}",
        told["ranking"][0]
    );
    let edit = json(&["effect", "add", &example, "paper", &files, "-o", &with]);
    let current = |when: &str| edit[when]["current_rms_ma"].as_f64().expect("currents");
    assert!(
        current("after") < 0.9 * current("before"),
        "{}",
        edit["advice"]
    );
    assert_ne!(json(&["diagnose", &with, &files])["verdict"], "unknown");
}
