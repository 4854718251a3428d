//! What is claimed, measured.

use std::time::Instant;

use anyhow::{Context, Result, ensure};
use emulated_board::{EmulatedBoard, Emulation};
use virtual_mirror::MirrorConfig;

use crate::cargo::{TARGET, cargo};
use crate::images::{self, Board};
use crate::setup;

/// Wall time over which the emulator's speed is measured.
const EMULATION_S: f64 = 5.0;

/// Prints the table of figures.
pub(crate) fn run() -> Result<()> {
    setup::rust_target()?;
    setup::qemu()?;
    let counts = instructions()?;
    ensure!(
        counts == instructions()?,
        "two runs counted different instructions"
    );
    let speed = emulation_speed()?;

    println!("| figure | measured |");
    println!("|---|---|");
    for (what, count) in counts {
        println!("| {what} | {count} |");
    }
    println!("| emulated board with virtual mirror, 10 kHz tick | {speed:.1} times real time |");
    Ok(())
}

/// Instructions of the control tick, as `benches/control_tick.rs` counts and names them.
fn instructions() -> Result<Vec<(String, String)>> {
    let output = cargo(&[
        "bench",
        "--quiet",
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
        .filter_map(|line| line.split_once(' ')?.1.split_once(": "))
        .map(|(what, count)| (what.to_owned(), count.to_owned()))
        .collect();
    ensure!(
        !counts.is_empty(),
        "the benchmark printed no counts: {said}"
    );
    Ok(counts)
}

/// Simulated seconds a second.
fn emulation_speed() -> Result<f64> {
    let directory = tempfile::tempdir()?;
    let board = EmulatedBoard::start(&Emulation {
        image: images::build(Board::Mps2)?,
        mirror: MirrorConfig::bench(),
        boards_directory: directory.path().to_owned(),
        name: "bench".to_owned(),
    })?;
    let (start, before) = (Instant::now(), board.simulated_s());
    std::thread::sleep(std::time::Duration::from_secs_f64(EMULATION_S));
    Ok((board.simulated_s() - before) / start.elapsed().as_secs_f64())
}
