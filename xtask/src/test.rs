//! Everything that must pass before code is shared.
//!
//! The steps share their builds: all that runs on this machine is built once, by the linter, which is the compiler with more
//! to say; so is all that runs on the emulated board. What is flashed is built by the compiler alone.

use std::ffi::OsStr;
use std::fs;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

use crate::cargo::{ON_HOST, TARGET, cargo, run, target_directory};
use crate::checks::{self, Check};
use crate::deny;
use crate::dist;
use crate::docs;
use crate::hil;
use crate::images::{self, Board};
use crate::mistakes;
use crate::on_target;
use crate::port;
use crate::python;
use crate::setup;
use crate::test_programs::{self, TestProgram};

/// Programs of tests that take the longest, begun in this order, so that no processor waits at the end.
const LONGEST: [&str; 9] = [
    "tests/lab",
    "tests/pose",
    "tests/elsewhere",
    "tests/refine",
    "tests/json",
    "tests/scan",
    "tests/emulated",
    "tests/flashed",
    "tests/device",
];

/// What the checks of [`hil::PACKAGE`] are told to run boards on, where that is not QEMU.
const EMULATOR: &str = "MIRROR_EMULATOR";

/// Programs of tests that run once more, on silicon twins.
const ON_THE_TWIN: [&str; 3] = ["tests/acceptance", "tests/faults", "tests/stack"];
const TWIN: &str = "g474";

/// Programs that test the tool, and want of a board no more than that it is fast: they run on boards on this machine.
const OF_THE_TOOL: [&str; 12] = [
    "tests/beyond_drives",
    "tests/calibrate",
    "tests/completion",
    "tests/in_use",
    "tests/json",
    "tests/measure",
    "tests/monitor",
    "tests/plane",
    "tests/pose",
    "tests/room",
    "tests/scan",
    "tests/serve",
];
const THIS_MACHINE: &str = "host";

/// Programs that wait most of their time: on boards on this machine, whose clock is the wall's.
const THAT_WAIT: [&str; 4] = [
    "tests/in_use",
    "tests/measure",
    "tests/monitor",
    "tests/serve",
];

/// What the tool is told by where it keeps null ensembles.
const OF_THE_TOOL_S_CACHE: &str = "XDG_CACHE_HOME";

/// Programs of tests that take less are not told one by one.
const TOLD: Duration = Duration::from_secs(5);

/// The steps that have passed, and how long each took.
#[derive(Default)]
struct Gate {
    passed: Vec<(String, Duration)>,
}

impl Gate {
    /// Runs a step, or fails with its name.
    fn step<T>(&mut self, name: &str, step: impl FnOnce() -> Result<T>) -> Result<T> {
        eprintln!("\n== {name}");
        let (result, took) = timed(step);
        let result = result.with_context(|| format!("step `{name}`"))?;
        self.passed.push((name.to_owned(), took));
        Ok(result)
    }

    /// Runs checks, and keeps the times of the long ones.
    fn run(&mut self, name: &str, checks: Vec<Check>) -> Result<()> {
        let ended = self.step(name, || checks::run(checks))?;
        let long = ended.into_iter().filter(|(_, took)| *took >= TOLD);
        self.passed
            .extend(long.map(|(name, took)| (format!("  {name}"), took)));
        Ok(())
    }

    fn print(&self, all: Duration) {
        println!("\nPassed, in seconds:");
        for (name, took) in &self.passed {
            println!("{:>6.0}  {name}", took.as_secs_f64());
        }
        println!("{:>6.0}  all", all.as_secs_f64());
    }
}

/// Programs that have been built.
struct Built {
    on_host: Vec<TestProgram>,
    on_target: Vec<TestProgram>,
}

/// Passes all tests, with `full` the long ones too, or stops at the first step that fails.
pub(crate) fn run_all(full: bool) -> Result<()> {
    setup::rust_target(TARGET)?;
    setup::rust_components()?;
    setup::qemu()?;
    let browser = full.then(setup::browser).transpose()?;
    if full {
        setup::programs(&setup::SHELLS)?;
    }
    let start = Instant::now();
    let mut gate = Gate::default();
    gate.step("format", || run(&mut cargo(&["fmt", "--all", "--check"])))?;
    gate.step("licences, sources and duplicates", deny::check)?;
    gate.step("the example of another PCB fits the sources", port::fits)?;
    gate.step("drivers' mistakes fit the sources", mistakes::fit)?;
    let built = build(&mut gate)?;
    gate.step(
        "images: their size, and no panic in the control tick",
        || {
            images::check(Board::Stm32g474)?;
            images::check(Board::Mps2)
        },
    )?;
    empty_cache()?;
    gate.run(
        "tests on the host, on the target, on emulated boards and on the silicon twin",
        checks(&built, browser.as_deref())?,
    )?;
    gate.step("real boards", hil::name_real_boards)?;
    if full {
        gate.step(
            "the tool for macOS and Windows, as far as a compiler tells",
            other_systems,
        )?;
        gate.step("documentation, and the examples in it", documentation)?;
        gate.step("the book, its links and its search", || {
            docs::build(true, false)
        })?;
        gate.step(
            "the example of another PCB, on its silicon twin",
            port::check,
        )?;
        gate.step("drivers' mistakes", mistakes::try_all)?;
        gate.step("fuzzing", || fuzz(&[]))?;
        gate.step("packages, on a clean system", || dist::build(true))?;
    }
    gate.print(start.elapsed());
    Ok(())
}

/// Builds for the host and for the target at once: the last stage of an image keeps one processor only. Meanwhile what the Python
/// package is tested with comes over the network.
fn build(gate: &mut Gate) -> Result<Built> {
    let (on_host, on_target, for_python) = gate.step("builds, and their lints", || {
        thread::scope(|scope| {
            let for_python = scope.spawn(|| timed(python::install));
            let on_target = scope.spawn(|| {
                timed(|| {
                    images::build(Board::Stm32g474)?;
                    on_target::build_and_lint()
                })
            });
            let on_host = timed(test_programs::build_and_lint);
            let on_target = on_target.join().expect("it does not panic");
            let for_python = for_python.join().expect("it does not panic");
            Ok((on_host, on_target, for_python))
        })
    })?;
    let (installed, took) = for_python;
    installed?;
    gate.passed.push(("  for Python".to_owned(), took));
    let mut kept = |name: &str, (built, took): (Result<Vec<TestProgram>>, Duration)| {
        gate.passed.push((format!("  for the {name}"), took));
        built.with_context(|| format!("build for the {name}"))
    };
    Ok(Built {
        on_host: kept("host", on_host)?,
        on_target: kept("target", on_target)?,
    })
}

/// What is built, as checks, the longest first; with a browser what is long, too.
fn checks(built: &Built, browser: Option<&OsStr>) -> Result<Vec<Check>> {
    let place = |program: &&TestProgram| {
        let place = LONGEST.iter().position(|name| program.name == *name);
        (
            place.unwrap_or(LONGEST.len()),
            program.package != hil::PACKAGE,
        )
    };
    let mut programs: Vec<&TestProgram> = built.on_host.iter().collect();
    programs.sort_by_key(place);
    let mut checks = python::checks(browser.is_some())?;
    let before = checks.len();
    checks.extend(programs.iter().map(|program| on_host(program, browser)));
    checks.extend(built.on_target.iter().map(on_target::check));
    for name in ON_THE_TWIN {
        let program = programs.iter().find(|program| program.name == name);
        let program = program.with_context(|| format!("{name} was not built"))?;
        let mut check = on_host(program, browser);
        check.name.push_str(", on the silicon twin");
        check.command.env(EMULATOR, TWIN);
        checks.insert(before + LONGEST.len(), check);
    }
    for Check { command, .. } in &mut checks {
        command.env(shared_cache::VARIABLE, cache());
        command.env(OF_THE_TOOL_S_CACHE, cache());
    }
    Ok(checks)
}

/// Where the tests of a run keep what others need, too.
fn cache() -> PathBuf {
    target_directory().join("tests-cache")
}

/// What a run before left there may be of other mirrors and other fits.
fn empty_cache() -> Result<()> {
    match fs::remove_dir_all(cache()) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(error).with_context(|| format!("{} cannot be emptied", cache().display()))
        }
        _ => Ok(()),
    }
}

fn on_host(program: &TestProgram, browser: Option<&OsStr>) -> Check {
    let mut command = program.command();
    if program.package == hil::PACKAGE && OF_THE_TOOL.contains(&program.name.as_str()) {
        command.env(EMULATOR, THIS_MACHINE);
    }
    if let Some(browser) = browser {
        command
            .arg("--include-ignored")
            .env(long_runs::VARIABLE, "1");
        command.env(setup::BROWSER, browser);
    }
    let mut check = Check::new(format!("{} of {}", program.name, program.package), command);
    check.waits = THAT_WAIT.contains(&program.name.as_str());
    check
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let start = Instant::now();
    (work(), start.elapsed())
}

/// The fuzzer, with every check that a debug build makes.
pub(crate) fn fuzz(arguments: &[String]) -> Result<()> {
    let fuzzer = ["run", "--profile", "fuzz", "--package", "fuzz", "--"];
    run(cargo(&fuzzer).args(arguments))
}

fn other_systems() -> Result<()> {
    for target in ["aarch64-apple-darwin", "x86_64-pc-windows-gnu"] {
        setup::rust_target(target)?;
        run(&mut cargo(&[
            "check",
            "--package",
            "host-tool",
            "--target",
            target,
        ]))?;
    }
    Ok(())
}

fn documentation() -> Result<()> {
    let deny = ("RUSTDOCFLAGS", "-D warnings");
    run(cargo(&["doc", "--workspace", "--no-deps"]).env(deny.0, deny.1))?;
    run(on_target::document().env(deny.0, deny.1))?;
    run(cargo(&["test", "--doc", "--quiet"]).args(ON_HOST))
}
