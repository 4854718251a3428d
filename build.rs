//! The factory calibration, the linker's map of the chosen board, and what the firmware was built
//! from.

use std::env;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::Command;

/// The model whose inverse a board uses before it has been calibrated: the reading of the paper
/// under which all of its published numbers agree.
const FACTORY_MODEL: &str = "reconciled";

fn main() -> Result<(), Box<dyn Error>> {
    let out = env::var("OUT_DIR")?;
    let model = mirror_model::Model::load(FACTORY_MODEL)?;
    let calibration = calibration::tabulate(&model)?.calibration;
    fs::write(Path::new(&out).join("factory.bin"), calibration.to_bytes())?;

    fs::write(
        Path::new(&out).join("reference.rs"),
        reference(&model.actuator(0))?,
    )?;

    for (feature, board) in [("BOARD_MPS2", "mps2"), ("BOARD_STM32G474", "stm32g474")] {
        if env::var_os(format!("CARGO_FEATURE_{feature}")).is_some() {
            let map = format!("src/board/{board}/memory.x");
            println!("cargo::rerun-if-changed={map}");
            fs::copy(map, Path::new(&out).join("board-memory.x"))?;
        }
    }
    println!("cargo::rerun-if-changed=memory.x");
    println!("cargo::rustc-link-search={out}");
    if env::var("TARGET")?.starts_with("thumb") {
        for argument in ["--nmagic", "--emit-relocs", "-Tlink.x", "-Tdefmt.x"] {
            println!("cargo::rustc-link-arg={argument}");
        }
        println!("cargo::rustc-link-arg-tests=-Tembedded-test.x");
    }

    // The log of HEAD changes with every commit.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) {
        println!("cargo::rerun-if-changed={log}");
    }
    let commit = git(&["rev-parse", "--short", "HEAD"]).unwrap_or("unknown".to_owned());
    println!("cargo::rustc-env=FIRMWARE_BUILD={commit}");
    Ok(())
}

/// Samples of the f64 model, for the on-target test that holds the core against it.
fn reference(model: &mirror_model::PistonModel) -> Result<String, mirror_model::RangeError> {
    const SAMPLES: u32 = 1000;
    let top_um = model.highest_displacement_um();
    let mut source = format!("static REFERENCE: [(f32, f64, f64); {SAMPLES}] = [\n");
    for i in 1..=SAMPLES {
        // The core is asked in f32, so the model is too.
        let z_um = (0.9999 * top_um * f64::from(i) / f64::from(SAMPLES)) as f32;
        let drive_v = model.voltage_at(z_um.into())?;
        let (below, above) = (0.999 * drive_v, 1.001 * drive_v);
        let moved_um =
            model.displacement_at_voltage_um(above) - model.displacement_at_voltage_um(below);
        let um_per_v = moved_um / (above - below);
        source += &format!("    ({z_um:?}, {drive_v:?}, {um_per_v:?}),\n");
    }
    Ok(source + "];\n")
}

/// What git answers, where there is git.
fn git(words: &[&str]) -> Option<String> {
    let output = Command::new("git").args(words).output().ok()?;
    let answer = String::from_utf8(output.stdout).ok()?.trim().to_owned();
    (output.status.success() && !answer.is_empty()).then_some(answer)
}
