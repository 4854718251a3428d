//! The model lab as a user types it, on sessions of virtual mirrors that share nothing with the
//! model.

mod bad_input;
mod browser;
#[path = "../common/mod.rs"]
mod common;
mod heaters;
mod hidden;
mod import;
#[path = "../common/interrupt.rs"]
mod interrupt;
mod many_rows;
mod page;
mod readme;
mod shown;
mod trial;

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use common::{Said, host_tool, host_tool_with, no_boards};
use interrupt::interrupt;
use serde_json::Value;

/// A session that ships, by what the answers say is hidden in it.
fn session(hidden: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/hidden");
    let answers = fs::read_to_string(directory.join("answers.toml")).expect("answers");
    let line = answers
        .lines()
        .find(|line| line.ends_with(&format!("= [{hidden}]")))
        .unwrap_or_else(|| panic!("no session with {hidden}"));
    directory.join(line.split_once(' ').expect("name and answer").0)
}

/// A folder for all tests of one run, empty at first.
fn place() -> &'static Path {
    static PLACE: OnceLock<PathBuf> = OnceLock::new();
    PLACE.get_or_init(|| {
        let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("lab");
        let _ = fs::remove_dir_all(&place);
        fs::create_dir_all(&place).expect("a folder");
        place
    })
}

/// A cache for all of them, with what the sessions of `data/hidden` share.
fn cache() -> &'static Path {
    static CACHE: OnceLock<PathBuf> = OnceLock::new();
    CACHE.get_or_init(|| {
        let cache = shared_cache::of_the_tool().unwrap_or_else(|| place().join("cache"));
        let files = session("");
        let words = ["diagnose", "paper", &files.to_string_lossy()];
        let said = host_tool_with(&cache, &words, &[("XDG_CACHE_HOME", &cache)]);
        assert_eq!(said.code, 0, "{}", said.err);
        cache
    })
}

fn lab(words: &[&str]) -> Said {
    host_tool_with(no_boards().path(), words, &[("XDG_CACHE_HOME", cache())])
}

fn json(words: &[&str]) -> Value {
    let said = lab(&[words, &["--json"]].concat());
    assert_eq!(said.code, 0, "{words:?}: {}", said.err);
    serde_json::from_str(&said.out).expect("JSON")
}

fn refuses(words: &[&str], sentence: &str) {
    let said = lab(words);
    let err = said.sentence();
    assert_ne!(said.code, 0, "{words:?}");
    assert!(err.contains(sentence), "`{sentence}` is not in: {err}");
    assert!(!err.contains("panicked"), "{err}");
}

#[test]
fn a_fit_lowers_the_error_and_its_model_is_taken_everywhere() {
    let place = no_boards();
    let (files, model) = (session(""), place.path().join("fitted.toml"));
    let (files, model) = (files.to_string_lossy(), model.to_string_lossy());
    let before = json(&["compare", "paper", &files])["rms"].as_f64().unwrap();
    let fitted = json(&["fit", "paper", &files, "-o", &model]);
    assert!(
        fitted["parameters"]
            .as_object()
            .is_some_and(|found| found.len() > 5),
        "{fitted}"
    );
    let after = json(&["compare", &model, &files])["rms"].as_f64().unwrap();
    // The paper's parameters are off by micrometres on another mirror, and a fit leaves a fraction of one.
    assert!(after < 0.1 * before, "{before} um became {after} um");
}

/// The mirror with nothing hidden, and a sensor that was mounted the other way round.
#[test]
fn a_turned_sign_is_no_mirror_that_lacks_nothing() {
    let place = no_boards();
    let mut turned = measurement::Session::load(&[session("")]).expect("a session");
    let files = turned.files.iter_mut();
    let rows = files.flat_map(|(_, file)| &mut file.rows);
    for z_um in rows.filter_map(|row| row.z_um.as_mut()) {
        *z_um = -*z_um;
    }
    for (name, file) in turned.files {
        let file_name = Path::new(&name).file_name().expect("a file");
        fs::write(place.path().join(file_name), file.to_string()).expect("written");
    }
    let files = place.path().to_string_lossy();
    let found = json(&["diagnose", "paper", &files]);
    assert_eq!(found["verdict"], "unknown", "{found}");
    for command in ["compare", "diagnose"] {
        let said = lab(&[command, "paper", &files]);
        assert!(said.out.contains("is their sign turned?"), "{}", said.out);
    }
}

#[test]
fn work_that_is_interrupted_says_so_and_leaves_no_file() {
    let place = no_boards();
    let (files, proposed) = (session(""), place.path().join("proposed.toml"));
    let mut tool = Command::new(env!("CARGO_BIN_EXE_host-tool"))
        .args(["--verbose", "diagnose", "paper"])
        .args([&*files.to_string_lossy(), "--propose"])
        .arg(&proposed)
        .env("MIRROR_BOARDS", place.path())
        .env("NO_COLOR", "1")
        // Nothing is kept there yet, so that it is at work for long.
        .env("XDG_CACHE_HOME", place.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the tool runs");
    let mut said = BufReader::new(tool.stderr.take().expect("piped"));
    let mut told = String::new();
    said.read_line(&mut told).expect("it says where it is");
    interrupt(&tool);
    said.read_to_string(&mut told).expect("text");
    let ended = tool.wait_with_output().expect("it ends");
    // A shell says 130 of it.
    assert_eq!(ended.status.code(), Some(130), "{told}");
    assert!(told.contains("interrupted before it was done"), "{told}");
    assert!(!proposed.exists() && ended.stdout.is_empty());
}

#[test]
fn a_comparison_speaks_and_draws() {
    let place = no_boards();
    let (files, picture) = (session(""), place.path().join("picture.svg"));
    let (files, picture) = (files.to_string_lossy(), picture.to_string_lossy());
    let said = lab(&["compare", "reconciled", &files, "--picture", &picture]);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(said.out.contains("sweep") && said.out.contains("measured less modelled"));
    let svg = fs::read_to_string(&*picture).expect("a picture");
    assert!(
        svg.starts_with("<svg") && svg.contains("sine_100"),
        "{}",
        &svg[..200]
    );
    // It is not replaced unasked, and no other format is promised.
    for (name, said_of) in [
        (&*picture, "already exists"),
        ("picture.png", "would hold SVG"),
    ] {
        let said = lab(&["compare", "reconciled", &files, "--picture", name]);
        assert_eq!(said.code, 1, "{}", said.out);
        assert!(said.err.contains(said_of), "{}", said.err);
    }
    let again = [
        "compare",
        "reconciled",
        &files,
        "--picture",
        &picture,
        "--force",
    ];
    assert_eq!(lab(&again).code, 0);
}

#[test]
fn adding_the_effect_that_is_hidden_lowers_the_error_and_removing_it_raises_it() {
    const HIDDEN: &str = "hysteresis";
    let place = no_boards();
    let files = session(&format!("{HIDDEN:?}"));
    let files = files.to_string_lossy();
    let [with, without] = ["with.toml", "without.toml"].map(|name| {
        let path = place.path().join(name);
        path.to_string_lossy().into_owned()
    });
    let errors = |edit: &Value| {
        ["before", "after"].map(|when| edit[when]["rms"].as_f64().expect("an error"))
    };
    let edit = json(&["effect", "add", HIDDEN, "paper", &files, "-o", &with]);
    let [before, after] = errors(&edit);
    // Five times the fall from which on one counts.
    assert!(after < 0.9 * before, "{}", edit["advice"]);
    let model = fs::read_to_string(&with).expect("a model");
    assert!(model.contains(HIDDEN));
    let edit = json(&["effect", "remove", HIDDEN, &with, &files, "-o", &without]);
    let [before, after] = errors(&edit);
    assert!(after > before, "{}", edit["advice"]);
}

#[test]
fn an_effect_of_ones_own_is_written_and_tried() {
    let place = no_boards();
    let (own, with) = (
        place.path().join("mine.toml"),
        place.path().join("with.toml"),
    );
    let (own, with) = (own.to_string_lossy(), with.to_string_lossy());
    assert_eq!(lab(&["effect", "new", "-o", &own]).code, 0);
    let files = session("");
    json(&[
        "effect",
        "add",
        &own,
        "paper",
        &files.to_string_lossy(),
        "-o",
        &with,
    ]);
    assert!(
        fs::read_to_string(&*with)
            .expect("a model")
            .contains("my-stiffening")
    );
    json(&["compare", &with, &files.to_string_lossy()]);

    let broken = fs::read_to_string(&*own)
        .expect("the template")
        .replace("(1 - q * x)", "(1 - q *");
    fs::write(&*own, broken).expect("a file");
    let output = place.path().join("never.toml");
    let words = [
        "effect",
        "add",
        &own,
        "paper",
        &files.to_string_lossy(),
        "-o",
        &output.to_string_lossy(),
    ];
    refuses(&words, "formula");
    assert!(!output.exists());
}

#[test]
fn effects_are_listed_and_shown() {
    let said = lab(&["effect", "list"]);
    assert_eq!(said.out.lines().count(), 25);
    let said = lab(&["effect", "show", "creep"]);
    assert!(
        said.out.contains("equation") && said.out.contains("hold for a minute"),
        "{}",
        said.out
    );
    assert_eq!(json(&["effect", "show", "creep"])["stage"], "memory");
}

#[test]
fn what_is_not_there_is_told() {
    let place = no_boards();
    let files = session("");
    let files = files.to_string_lossy();
    let output = place.path().join("out.toml");
    let output = output.to_string_lossy();
    refuses(&["compare", "nonsense", &files], "nonsense");
    refuses(
        &["compare", "paper", "/no/such.csv"],
        "'/no/such.csv' cannot be read",
    );
    refuses(
        &["effect", "add", "warp", "paper", &files, "-o", &output],
        "there is no effect `warp`",
    );
    refuses(
        &["effect", "show", "warp"],
        "`host-tool effect list` shows those there are",
    );
    fs::write(&*output, "kept").expect("a file");
    refuses(&["fit", "paper", &files, "-o", &output], "already exists");
    assert_eq!(fs::read_to_string(&*output).expect("still there"), "kept");
    let not_a_model = place.path().join("broken.toml");
    fs::write(
        &not_a_model,
        "format = 1\npreset = \"paper\"\n[[effects]]\nid = \"warp\"\n",
    )
    .unwrap();
    refuses(&["compare", &not_a_model.to_string_lossy(), &files], "warp");
}

#[test]
fn every_measurement_that_may_be_proposed_is_a_command_of_the_tool() {
    for proposal in diagnosis::proposals(3.5) {
        let command = host_tool::command_line::proposal_line(&proposal);
        let words: Vec<&str> = command.split(' ').skip(1).collect();
        let said = host_tool(no_boards().path(), &words);
        assert!(
            said.sentence().contains("no board was found"),
            "{command}: {}",
            said.err
        );
    }
}
