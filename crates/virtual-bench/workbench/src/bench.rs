//! What is claimed, measured.

use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use emulated_board::{Connected, EmulatedBoard, Emulation, Speed, Surroundings, private_directory};
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
        around: Surroundings::default(),
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
    print!("{}", table(&counts, speed, &reached));
    println!(
        "\nDrawn in {}; counts written to {}.",
        picture.display(),
        figures.display()
    );
    Ok(())
}

/// The figures, whatever they are: a bench measures, and no machine is too slow for it.
fn table(counts: &[(String, String)], speed: f64, reached: &[Reached]) -> String {
    let (rms, worst) = summary(reached);
    let top = STEP_UM * f64::from(STEPS);
    let counts = figures::rows(counts);
    format!(
        "| figure | measured |\n|---|---|\n{counts}\
         | emulated board with virtual mirror, 10 kHz tick | {speed:.1} times real time |\n\
         | static error with the factory table, 0 to {top} um, rms | {rms:.2} um |\n\
         | static error with the factory table, largest | {worst:.2} um |\n"
    )
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
    for figure in figures_of_the_store(&said) {
        println!("{figure}");
    }
    Ok(())
}

/// The lines that tell what was counted. The test runner prints its dots into them.
fn figures_of_the_store(said: &str) -> impl Iterator<Item = &str> {
    let is_figure = |line: &&str| line.contains(" power cuts, ") || line.contains(" updates: ");
    let lines = said.lines().filter(is_figure);
    lines.map(|line| line.trim_start_matches('.'))
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
    let counts = counts(&said);
    ensure!(
        !counts.is_empty(),
        "the benchmark printed no counts: {said}"
    );
    Ok(counts)
}

/// What each line of the benchmark counts, behind the time at which it was said, and how often.
fn counts(said: &str) -> Vec<(String, String)> {
    let counts = said
        .lines()
        .filter_map(|line| line.split_once(' ')?.1.rsplit_once(": "));
    counts
        .map(|(what, count)| (what.to_owned(), count.to_owned()))
        .collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_benchmark_counts_is_read_and_the_rest_of_what_it_says_is_not() {
        let said = "0.000012 control core: one step: 876 instructions\n0.034125 protection alone: 893 instructions\ndone\n";
        let expected = [
            ("control core: one step", "876 instructions"),
            ("protection alone", "893 instructions"),
        ];
        let expected = expected.map(|(what, count)| (what.to_owned(), count.to_owned()));
        assert_eq!(counts(said), expected);
    }

    #[test]
    fn the_store_s_figures_are_found_among_the_runner_s_dots() {
        let said = "running 3 tests\n..12 power cuts, none lost\n.1000 updates: 3 erased\ntest result: ok\n";
        let figures: Vec<&str> = figures_of_the_store(said).collect();
        assert_eq!(
            figures,
            ["12 power cuts, none lost", "1000 updates: 3 erased"]
        );
    }

    fn at(error_um: f64) -> Reached {
        Reached {
            asked_um: 0.0,
            error_um,
        }
    }

    #[test]
    fn a_machine_that_is_slow_has_its_table_too() {
        let counts = [("one step".to_owned(), "876 instructions".to_owned())];
        let printed = table(&counts, 0.04, &[at(3.0), at(-4.0)]);
        let rows: Vec<&str> = printed.lines().skip(2).collect();
        assert_eq!(
            rows,
            [
                "| one step | 876 instructions |",
                "| emulated board with virtual mirror, 10 kHz tick | 0.0 times real time |",
                "| static error with the factory table, 0 to 170 um, rms | 3.54 um |",
                "| static error with the factory table, largest | 4.00 um |",
            ]
        );
    }

    #[test]
    fn a_summary_is_root_mean_square_and_largest() {
        // (9 + 16) / 2.
        assert_eq!(summary(&[at(3.0), at(-4.0)]), (12.5_f64.sqrt(), 4.0));
    }
}
