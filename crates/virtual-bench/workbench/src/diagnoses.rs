//! How well the diagnosis finds what is hidden, and how long it takes.

use std::fs;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use experiments::session;
use virtual_mirror::MirrorConfig;
use virtual_sessions::{Instruments, measure};

use xtask::cargo::run;
use xtask::tool;

/// Seeds of mirrors that nobody developed on.
const FIRST_SEED: &str = "7201";
/// The first seed of the mirrors that the table of confusions is made from, how many seeds, and the displacement's noise (nm): half an
/// hour.
const LEARNED_FROM: [&str; 3] = ["3001", "2", "20"];
const TABLE: &str = "crates/lab/diagnosis/src/confusions.toml";
/// Diagnoses with warm caches, of which the median is told.
const WARM: usize = 5;

/// Hides effects and counts what is found; `arguments` go to the counting (`--help`), and may choose other seeds.
pub(crate) fn count(arguments: &[String]) -> Result<()> {
    let [cold_s, warm_s] = seconds()?;
    let mut counting = tool::missing_physics();
    counting.args(arguments);
    if !arguments
        .iter()
        .any(|word| word.starts_with("--first-seed"))
    {
        counting.args(["--first-seed", FIRST_SEED]);
    }
    run(&mut counting)?;
    println!(
        "| one diagnosis of a standard session, release build, whole process, caches warm | {warm_s:.1} s | 1.5 s |"
    );
    println!("| the same, caches cold | {cold_s:.1} s | 10 s |");
    Ok(())
}

/// Hides effects in mirrors of the calibrating families, and writes what was taken for what.
pub(crate) fn learn() -> Result<()> {
    let [first, seeds, noise] = LEARNED_FROM;
    let mut learning = tool::missing_physics();
    learning.args(["--learn", TABLE, "--first-seed", first]);
    run(learning.args(["--seeds", seeds, "--noises", noise]))
}

/// What a user of a release build waits for a diagnosis of a standard session, with cold and with warm caches.
fn seconds() -> Result<[f64; 2]> {
    let directory = tempfile::tempdir()?;
    let folder = directory.path().join("session");
    fs::create_dir(&folder)?;
    let measured = measure(
        &MirrorConfig::bench(),
        &session(3.5),
        Instruments::PositionAndCurrents,
    )?;
    for (name, file) in measured.files {
        fs::write(folder.join(name), file.to_string())?;
    }
    let cache = directory.path().join("cache");
    let mut tool = tool::released()?;
    tool.args(["diagnose", "paper"])
        .arg(&folder)
        .env("XDG_CACHE_HOME", &cache);
    let cold = duration_s(&mut tool)?;
    let mut warm = (0..WARM)
        .map(|_| duration_s(&mut tool))
        .collect::<Result<Vec<_>>>()?;
    warm.sort_by(f64::total_cmp);
    Ok([cold, warm[WARM / 2]])
}

/// Seconds that a command takes, process and all.
fn duration_s(tool: &mut Command) -> Result<f64> {
    let start = Instant::now();
    let output = tool.output().context("the host tool does not run")?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "no diagnosis: {said}");
    Ok(start.elapsed().as_secs_f64())
}
