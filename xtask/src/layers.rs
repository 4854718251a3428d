//! Which package may use which.
//!
//! What runs on the board knows nothing of the lab and of the virtual bench; the model and the virtual mirror know
//! nothing of each other. Dependencies that only tests have are left out.

mod allowed;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use anyhow::{Context, Result};
use serde_json::Value;

use self::allowed::{ALLOWED, Allowed, Room};
use crate::cargo::workspace;
use crate::packages::{list, metadata, text};

/// A package of this workspace.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Member {
    name: String,
    /// Its directory, from the workspace's; empty for the workspace's own package.
    directory: String,
    /// The packages that it is built from with all features on, those for its tests left out.
    uses: BTreeSet<String>,
}

/// Everything that cargo would build, by name: what each package uses, those for tests left out.
struct Packages {
    members: Vec<Member>,
    uses: BTreeMap<String, BTreeSet<String>>,
}

impl Packages {
    /// The graph of this workspace, with all features on.
    fn read() -> Result<Self> {
        let metadata = metadata()?;
        let named: BTreeMap<&str, &Value> = list(&metadata["packages"])
            .iter()
            .map(|package| (text(&package["id"]), package))
            .collect();
        let name = |id: &Value| text(&named[text(id)]["name"]).to_owned();
        let is_built = |used: &Value| list(&used["dep_kinds"]).iter().any(|k| k["kind"] != "dev");
        let mut uses: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for node in list(&metadata["resolve"]["nodes"]) {
            let used = list(&node["deps"]).iter().filter(|used| is_built(used));
            uses.entry(name(&node["id"]))
                .or_default()
                .extend(used.map(|used| name(&used["pkg"])));
        }
        let members = list(&metadata["workspace_members"])
            .iter()
            .map(|id| {
                let name = name(id);
                let manifest = text(&named[text(id)]["manifest_path"]);
                let directory = manifest
                    .strip_prefix(text(&metadata["workspace_root"]))
                    .and_then(|path| path.strip_suffix("Cargo.toml"))
                    .context("a member lies outside of the workspace")?;
                Ok(Member {
                    directory: directory.trim_matches('/').to_owned(),
                    uses: uses[&name].clone(),
                    name,
                })
            })
            .collect::<Result<_>>()?;
        Ok(Self { members, uses })
    }

    /// The packages that `name` reaches through others, or itself uses.
    fn reached_by(&self, name: &str) -> BTreeSet<String> {
        let mut reached = BTreeSet::new();
        let mut open = vec![name.to_owned()];
        while let Some(next) = open.pop() {
            for used in self.uses.get(&next).into_iter().flatten() {
                if reached.insert(used.clone()) {
                    open.push(used.clone());
                }
            }
        }
        reached
    }
}

/// Hardware and runtimes that the control core must not know.
const NOT_IN_THE_CORE: [&str; 6] = [
    "cortex-m",
    "embassy-executor",
    "embassy-stm32",
    "embassy-time",
    "embedded-hal",
    "semihosting",
];

/// What is wrong with the workspace's packages, a sentence each.
fn violations(members: &[Member], allowed: &[Allowed]) -> Vec<String> {
    let mut wrong = Vec::new();
    for member in members {
        let name = &member.name;
        let Some((room, _, may_use)) = allowed.iter().find(|(_, listed, _)| listed == name) else {
            wrong.push(format!("{name} has no line in xtask/src/layers/allowed.rs"));
            continue;
        };
        let lies_in = Room::of(&member.directory);
        if lies_in != *room {
            wrong.push(format!("{name} is listed in {room:?}, and in {lies_in:?}"));
        }
        for used in members
            .iter()
            .filter(|used| member.uses.contains(&used.name))
        {
            if !may_use.contains(&used.name.as_str()) {
                wrong.push(format!("{name} must not use {}", used.name));
            }
            if lies_in == Room::Board && Room::of(&used.directory) != Room::Board {
                wrong.push(format!(
                    "{name} runs on the board, and uses {} which does not",
                    used.name
                ));
            }
        }
    }
    for (_, name, _) in allowed {
        if !members.iter().any(|member| member.name == *name) {
            wrong.push(format!("{name} is listed, and not in the workspace"));
        }
    }
    wrong
}

/// A package as a test makes it up.
fn member(directory: &str, uses: &[&str]) -> Member {
    Member {
        name: directory.rsplit('/').next().unwrap_or_default().to_owned(),
        directory: directory.to_owned(),
        uses: uses.iter().map(|&name| name.to_owned()).collect(),
    }
}

#[test]
fn the_workspace_keeps_to_the_list() {
    let members = Packages::read().expect("cargo tells the graph").members;
    assert_eq!(violations(&members, ALLOWED), [""; 0]);
}

/// Where the architecture says that the model and the virtual mirror meet.
#[test]
fn whoever_uses_both_mirrors_is_named_in_the_architecture() {
    let page = workspace().join("docs/developing/architecture.md");
    let page = fs::read_to_string(page).expect("the architecture");
    let (_, table) = page
        .split_once("| where | how they meet |\n")
        .expect("a table");
    let (table, _) = table.split_once("\n\n").expect("it ends");
    let members = Packages::read().expect("cargo tells the graph").members;
    let meets = |member: &&Member| {
        let used = ["mirror-model", "virtual-mirror"];
        used.iter().all(|name| member.uses.contains(*name))
    };
    let meeting: Vec<&Member> = members.iter().filter(meets).collect();
    assert!(meeting.len() > 2, "{meeting:?}");
    for member in meeting {
        let named = format!("`{}`", member.directory);
        assert!(table.contains(&named), "{named} is not in the table");
    }
}

#[test]
fn a_package_that_is_not_listed_fails() {
    let workspace = [
        member("crates/board/core", &[]),
        member("crates/lab/statistic", &["core"]),
    ];
    let wrong = violations(&workspace, &[(Room::Board, "core", &[])]);
    assert_eq!(
        wrong,
        ["statistic has no line in xtask/src/layers/allowed.rs"]
    );
}

#[test]
fn a_package_that_is_gone_fails() {
    let wrong = violations(&[], &[(Room::Board, "core", &[])]);
    assert_eq!(wrong, ["core is listed, and not in the workspace"]);
}

#[test]
fn a_package_that_uses_what_it_may_not_fails() {
    let workspace = [
        member("crates/lab/model", &["virtual-mirror", "serde"]),
        member("crates/virtual-bench/virtual-mirror", &[]),
    ];
    let allowed: [Allowed; 2] = [
        (Room::Lab, "model", &[]),
        (Room::VirtualBench, "virtual-mirror", &[]),
    ];
    assert_eq!(
        violations(&workspace, &allowed),
        ["model must not use virtual-mirror"]
    );
}

#[test]
fn the_board_uses_no_other_room_even_where_it_is_listed() {
    let workspace = [
        member("crates/board/core", &["model"]),
        member("crates/lab/model", &[]),
    ];
    let allowed: [Allowed; 2] = [(Room::Board, "core", &["model"]), (Room::Lab, "model", &[])];
    assert_eq!(
        violations(&workspace, &allowed),
        ["core runs on the board, and uses model which does not"]
    );
}

#[test]
fn a_package_in_another_room_than_listed_fails() {
    let wrong = violations(
        &[member("crates/lab/core", &[])],
        &[(Room::Board, "core", &[])],
    );
    assert_eq!(wrong, ["core is listed in Board, and in Lab"]);
}

#[test]
fn the_control_core_knows_no_hardware() {
    let reached = Packages::read()
        .expect("cargo tells the graph")
        .reached_by("control-core");
    assert!(reached.contains("fpu"), "the graph was read");
    for name in NOT_IN_THE_CORE {
        assert!(!reached.contains(name), "control-core must not use {name}");
    }
}
