//! What `--json` prints, command by command, is what docs/reference/json.md says. `MIRROR_WRITE_PAGES=1` writes that page anew.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::path::Path;

use emulated_board::Speed;
use hil::Bench;
use serde_json::Value;

const PAGE: &str = "../docs/reference/json.md";
/// What follows this line is made from what was printed.
const BELOW: &str = "## What each command prints\n";
/// The largest whole number up to which a double holds each.
const MOST_EXACT: u64 = 1 << 53;
/// Objects whose keys are names of parameters: one row stands for all.
const NAMED: [&str; 1] = ["parameters"];

/// On the board, and then on a session that ships, in the order in which they are typed.
const COMMANDS: [&str; 30] = [
    "list",
    "status",
    "status --history",
    "range",
    "set-z 60um --settle 10ms",
    "set-drive 1V --settle 10ms",
    "record -o record.csv --duration 20ms",
    "scan sine --frequency 100Hz --cycles 3 -o scan.csv",
    "measure sweep --steps 5 --dwell 20ms --rest 0s -o sweep.csv",
    "off",
    "clear",
    "calibrate-sense",
    "load-calibration factory.toml",
    "load-calibration nowhere.toml",
    "set-z 3",
    "explain",
    "explain over-temperature",
    "import table.csv",
    "import table.csv -o imported.csv",
    "fit paper SESSION -o fitted.toml",
    "compare fitted.toml SESSION",
    "diagnose paper SESSION",
    "effect list",
    "effect show hysteresis",
    "effect new -o mine.toml",
    "effect add hysteresis paper SESSION -o better.toml",
    "effect remove hysteresis better.toml SESSION -o without.toml",
    "identify reconciled SESSION -o identified.toml",
    "report SESSION -o report.html",
    "replay report.html",
];

#[test]
fn the_page_says_what_is_printed() {
    let bench = Bench::changed(|emulation| emulation.speed = Speed::Awaited);
    let place = |name: &str| bench.directory().join(name);
    let model = mirror_model::Model::from(mirror_model::Preset::Reconciled);
    let factory = calibration::tabulate(&model).expect("it has an inverse");
    let factory = calibration::to_toml(&factory.calibration);
    fs::write(place("factory.toml"), factory).expect("written");
    let table = "Voltage (V),height (um)\n0,0\n1,20\n2,70\n";
    fs::write(place("table.csv"), table).expect("written");
    let session = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/hidden/06");

    let cache = shared_cache::of_the_tool().unwrap_or_else(|| place("cache"));
    let mut told = String::new();
    for command in COMMANDS {
        let line = command.replace("SESSION", &session.to_string_lossy());
        let words: Vec<&str> = line.split(' ').chain(["--json"]).collect();
        let mut tool = bench.command(&words);
        let output = tool.env("XDG_CACHE_HOME", &cache).output();
        let output = output.expect("the tool runs");
        let said = String::from_utf8_lossy(&output.stderr);
        let printed = serde_json::from_slice::<Value>(&output.stdout);
        let printed = printed.unwrap_or_else(|error| panic!("{command}: {error}: {said}"));
        assert_eq!(printed["format"], 1, "{command}");
        assert_eq!(
            output.status.success(),
            printed["error"].is_null(),
            "{command}"
        );
        told += &section(command, &printed);
    }
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join(PAGE);
    let written = fs::read_to_string(&page).expect("the page");
    let (above, below) = written.split_once(BELOW).expect("its heading");
    if std::env::var_os("MIRROR_WRITE_PAGES").is_some() {
        fs::write(&page, format!("{above}{BELOW}{told}")).expect("written");
    } else {
        assert_eq!(
            below, told,
            "write it anew: MIRROR_WRITE_PAGES=1 cargo test -p hil --test json"
        );
    }
}

/// What a command printed, a row a key.
fn section(command: &str, printed: &Value) -> String {
    let mut rows = BTreeMap::new();
    look_at("", printed, &mut rows);
    let mut section = format!("\n### `{command}`\n\n| key | what stands there |\n|---|---|\n");
    for (key, kinds) in rows {
        let kinds: Vec<&str> = kinds.into_iter().collect();
        let _ = writeln!(section, "| `{key}` | {} |", kinds.join(" or "));
    }
    section
}

/// Notes what stands below `key`.
fn look_at(key: &str, value: &Value, rows: &mut BTreeMap<String, BTreeSet<&'static str>>) {
    let kind = match value {
        Value::Object(keys) => {
            let is_named = NAMED.iter().any(|named| key.ends_with(named));
            for (name, value) in keys {
                let name = if is_named { "NAME" } else { name };
                let below = if key.is_empty() {
                    name.to_owned()
                } else {
                    format!("{key}.{name}")
                };
                look_at(&below, value, rows);
            }
            return;
        }
        Value::Array(items) => {
            let below = format!("{key}[]");
            items.iter().for_each(|item| look_at(&below, item, rows));
            if !items.is_empty() {
                return;
            }
            "an empty list"
        }
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(number) => {
            let whole = number.as_i64().map(i64::unsigned_abs).or(number.as_u64());
            assert!(whole <= Some(MOST_EXACT), "{key} is {number}");
            "number"
        }
        Value::String(_) => "text",
    };
    rows.entry(key.to_owned()).or_default().insert(kind);
}
