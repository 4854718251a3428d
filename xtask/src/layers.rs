//! Which crate may use which: dependencies point from boards to core, and the virtual mirror and
//! the model know nothing of each other.

use std::collections::{BTreeMap, BTreeSet};

use crate::cargo::cargo;

/// (crate, workspace crates that it may reach).
const MAY_USE: &[(&str, &[&str])] = &[
    ("board-sockets", &[]),
    ("calibration-store", &[]),
    ("control-core", &["fpu"]),
    (
        "emulated-board",
        &["board-sockets", "plant-link", "virtual-mirror"],
    ),
    ("waveforms", &[]),
    ("fpu", &[]),
    ("identification", &["least-squares", "measurement", "mirror-model"]),
    ("measurement", &[]),
    ("mirror-model", &["measurement"]),
    ("mirror-protocol", &["waveforms"]),
    ("plant-link", &[]),
    ("simulated-flash", &[]),
    ("virtual-mirror", &[]),
    ("virtual-sessions", &["measurement", "virtual-mirror"]),
    ("virtual-usb", &[]),
    (
        "calibration",
        &["control-core", "fpu", "measurement", "mirror-model"],
    ),
];

/// Hardware and runtimes that the control core must not know.
const NOT_IN_THE_CORE: [&str; 6] = [
    "cortex-m",
    "embassy-executor",
    "embassy-stm32",
    "embassy-time",
    "embedded-hal",
    "semihosting",
];

/// The crates that each crate reaches in the finished product, dev-dependencies left out.
struct Graph(BTreeMap<String, BTreeSet<String>>);

impl Graph {
    fn read() -> Self {
        let output = cargo(&["metadata", "--format-version", "1", "--all-features"])
            .output()
            .expect("cargo runs");
        let metadata: serde_json::Value =
            serde_json::from_slice(&output.stdout).expect("cargo prints JSON");
        let list = |value: &serde_json::Value| value.as_array().cloned().unwrap_or_default();
        let names: BTreeMap<String, String> = list(&metadata["packages"])
            .iter()
            .map(|package| (text(&package["id"]), text(&package["name"])))
            .collect();
        let uses = |node: &serde_json::Value| {
            list(&node["deps"])
                .iter()
                .filter(|used| {
                    list(&used["dep_kinds"])
                        .iter()
                        .any(|kind| kind["kind"] != "dev")
                })
                .map(|used| names[&text(&used["pkg"])].clone())
                .collect()
        };
        let nodes = list(&metadata["resolve"]["nodes"]);
        Self(
            nodes
                .iter()
                .map(|node| (names[&text(&node["id"])].clone(), uses(node)))
                .collect(),
        )
    }

    fn reached_by(&self, name: &str) -> BTreeSet<String> {
        let mut reached = BTreeSet::new();
        let mut open = vec![name.to_owned()];
        while let Some(next) = open.pop() {
            for used in self.0.get(&next).into_iter().flatten() {
                if reached.insert(used.clone()) {
                    open.push(used.clone());
                }
            }
        }
        reached
    }
}

fn text(value: &serde_json::Value) -> String {
    value.as_str().expect("a string").to_owned()
}

#[test]
fn crates_use_only_what_they_may() {
    let graph = Graph::read();
    let ours: BTreeSet<&str> = MAY_USE.iter().map(|(name, _)| *name).collect();
    for (name, allowed) in MAY_USE {
        assert!(
            graph.0.contains_key(*name),
            "{name} is not in the workspace"
        );
        for used in graph.reached_by(name) {
            let is_allowed = !ours.contains(used.as_str()) || allowed.contains(&used.as_str());
            assert!(is_allowed, "{name} must not use {used}");
        }
    }
}

#[test]
fn the_control_core_knows_no_hardware() {
    let reached = Graph::read().reached_by("control-core");
    assert!(reached.contains("fpu"), "the graph was read");
    for name in NOT_IN_THE_CORE {
        assert!(!reached.contains(name), "control-core must not use {name}");
    }
}
