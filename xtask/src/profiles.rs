//! What the profiles of `Cargo.toml` promise: a tool for speed, without what only a debugger reads, and firmware for size, with
//! it.

use std::fs;

use toml::{Table, Value};

use crate::cargo::workspace;
use crate::images::PROFILE;

/// A setting of a profile, or of the one that it inherits from.
fn setting(profiles: &Table, profile: &str, key: &str) -> Option<Value> {
    let profile = profiles.get(profile)?.as_table()?;
    let inherited = || setting(profiles, profile.get("inherits")?.as_str()?, key);
    profile.get(key).cloned().or_else(inherited)
}

fn profiles() -> Table {
    let manifest = fs::read_to_string(workspace().join("Cargo.toml")).expect("the manifest");
    let manifest: Table = manifest.parse().expect("it is TOML");
    manifest["profile"].as_table().expect("profiles").clone()
}

#[test]
fn the_tool_is_built_for_speed_and_stripped() {
    let of_the_tool = |key| setting(&profiles(), "release", key);
    // Without a word of it, cargo's: 3, and no debug information.
    assert_eq!(of_the_tool("opt-level"), None);
    assert_eq!(of_the_tool("debug"), None);
    assert_eq!(of_the_tool("strip"), Some(true.into()));
}

#[test]
fn the_firmware_is_built_for_size_and_keeps_what_a_debugger_needs() {
    let of_the_firmware = |key| setting(&profiles(), PROFILE, key);
    assert_eq!(of_the_firmware("opt-level"), Some("s".into()));
    assert_eq!(of_the_firmware("debug"), Some(2.into()));
    assert_eq!(of_the_firmware("strip"), Some(false.into()));
}
