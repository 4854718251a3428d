//! What is claimed, measured.

use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use emulated_board::{Connected, EmulatedBoard, Emulation, Speed, private_directory};
use virtual_mirror::MirrorConfig;

use crate::picture::{self, Reached};
use xtask::cargo::{TARGET, cargo, workspace};
use xtask::figures;
use xtask::images::{self, Board};
use xtask::setup;
use xtask::tool;

/// Wall time over which the emulator's speed is measured.
const EMULATION_TIME: Duration = Duration::from_secs(5);

/// Positions at which the factory's table is tried.
const STEP_UM: f64 = 10.0;
const STEPS: u32 = 17;

/// Prints the table of figures.
pub(crate) fn run() -> Result<()> {
    setup::rust_target(TARGET)?;
    setup::qemu()?;
    let counts = instructions()?;
    ensure!(
        counts == instructions()?,
        "two runs counted different instructions"
    );
    let directory = private_directory()?;
    let board = EmulatedBoard::start(&Emulation {
        image: images::build(Board::Mps2)?,
        connected: Connected::Mirror(Box::new(MirrorConfig::bench())),
        boards_directory: directory.path().to_owned(),
        name: "bench".to_owned(),
        flash: None,
        speed: Speed::Fastest,
        has_monitor: false,
    })?;
    let speed = emulation_speed(&board);
    let reached = static_errors(&board)?;
    let picture = workspace().join("docs/pictures/set-z.svg");
    picture::draw(&picture, &reached)?;

    let figures = figures::write_control_tick(&counts)?;
    println!("| figure | measured |");
    println!("|---|---|");
    print!("{}", figures::rows(&counts));
    println!("| emulated board with virtual mirror, 10 kHz tick | {speed:.1} times real time |");
    let (rms, worst) = summary(&reached);
    let top = STEP_UM * f64::from(STEPS);
    println!("| static error with the factory table, 0 to {top} um, rms | {rms:.2} um |");
    println!("| static error with the factory table, largest | {worst:.2} um |");
    println!(
        "\nDrawn in {}; counts written to {}.",
        picture.display(),
        figures.display()
    );
    Ok(())
}

/// Prints what the tests of the calibration store count.
pub(crate) fn store() -> Result<()> {
    let tests = ["test", "--quiet", "--package", "calibration-store", "--"];
    let output = cargo(&tests)
        .arg("--nocapture")
        .env(long_runs::VARIABLE, "1")
        .output()
        .context("cargo does not run")?;
    let said = String::from_utf8_lossy(&output.stdout);
    ensure!(output.status.success(), "the store's tests failed: {said}");
    let is_figure = |line: &&str| line.contains(" power cuts, ") || line.contains(" updates: ");
    // The test runner prints its dots into the same lines.
    for line in said.lines().filter(is_figure) {
        println!("{}", line.trim_start_matches('.'));
    }
    Ok(())
}

/// Instructions of the control tick, as `benches/control_tick.rs` counts and names them.
fn instructions() -> Result<Vec<(String, String)>> {
    let output = cargo(&[
        "bench",
        "--quiet",
        "--profile",
        images::PROFILE,
        "--package",
        "mirror-firmware",
        "--target",
        TARGET,
    ])
    .args([
        "--features",
        &Board::Mps2.feature(),
        "--bench",
        "control_tick",
    ])
    .output()
    .context("cargo does not run")?;
    let said = String::from_utf8_lossy(&output.stdout);
    ensure!(
        output.status.success(),
        "the control tick was not counted: {said}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let counts: Vec<_> = said
        .lines()
        .filter_map(|line| line.split_once(' ')?.1.rsplit_once(": "))
        .map(|(what, count)| (what.to_owned(), count.to_owned()))
        .collect();
    ensure!(
        !counts.is_empty(),
        "the benchmark printed no counts: {said}"
    );
    Ok(counts)
}

/// Simulated seconds a second.
fn emulation_speed(board: &EmulatedBoard) -> f64 {
    let (start, before) = (Instant::now(), board.simulated_s());
    std::thread::sleep(EMULATION_TIME);
    (board.simulated_s() - before) / start.elapsed().as_secs_f64()
}

/// Asks for one position after the other, as a user does.
fn static_errors(board: &EmulatedBoard) -> Result<Vec<Reached>> {
    (0..=STEPS)
        .map(|step| {
            let asked_um = STEP_UM * f64::from(step);
            let asked = format!("{asked_um}um");
            let report = tool::json(
                tool::command()
                    .args(["set-z", &asked, "--settle", "2s"])
                    .env("MIRROR_BOARD", board.socket()),
            )?;
            let error_um = report["error_um"].as_f64().context("no virtual sensor")?;
            Ok(Reached { asked_um, error_um })
        })
        .collect()
}

/// Root mean square and largest error.
fn summary(reached: &[Reached]) -> (f64, f64) {
    let squares: f64 = reached.iter().map(|point| point.error_um.powi(2)).sum();
    let worst = reached
        .iter()
        .map(|point| point.error_um.abs())
        .fold(0.0, f64::max);
    ((squares / reached.len() as f64).sqrt(), worst)
}
