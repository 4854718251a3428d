//! What a board has until it is calibrated: the table of a model, and samples of that model for the on-target tests.
//!
//! Both are files of the firmware, so that building it takes neither model nor lab.

use std::fs;

use anyhow::Result;
use mirror_model::{Model, PistonModel};
use xtask::cargo::workspace;

/// The model whose inverse a board uses before it has been calibrated: the reading of the paper
/// under which all of its published numbers agree.
const MODEL: &str = "reconciled";

/// The factory's calibration, as the board's store would hold it.
const CALIBRATION: &str = "src/factory.bin";
/// Samples of the model in f64, against which `tests/core.rs` holds the core on the target.
const SAMPLES: &str = "tests/reference/samples.rs";
/// So many, evenly spaced: four for every interval of the table, which has 64.
const COUNT: u32 = 256;
/// The drive's slope at a sample is taken between so much less and so much more of the drive.
const AROUND: f64 = 1e-3;

/// Writes both anew.
pub(crate) fn write() -> Result<()> {
    let model = Model::load(MODEL)?;
    fs::write(workspace().join(CALIBRATION), calibration(&model)?)?;
    fs::write(workspace().join(SAMPLES), samples(&model.actuator(0))?)?;
    println!("written: {CALIBRATION} and {SAMPLES}");
    Ok(())
}

fn calibration(model: &Model) -> Result<Vec<u8>> {
    Ok(calibration::tabulate(model)?.calibration.to_bytes().into())
}

/// Positions (um), the model's drives there (V) and their slopes (um/V), as Rust.
fn samples(model: &PistonModel) -> Result<String> {
    let mut source = format!(
        "// Written by `cargo xtask tabulate-factory`.\nstatic REFERENCE: [(f32, f64, f64); {COUNT}] = [\n"
    );
    let top_um = model.highest_displacement_um();
    for i in 1..=COUNT {
        // The core is asked in f32, so the model is too; at the very top rounding may ask too much.
        let z_um = (0.9999 * top_um * f64::from(i) / f64::from(COUNT)) as f32;
        let drive_v = model.voltage_at(z_um.into())?;
        let (below, above) = ((1.0 - AROUND) * drive_v, (1.0 + AROUND) * drive_v);
        let moved_um =
            model.displacement_at_voltage_um(above) - model.displacement_at_voltage_um(below);
        let um_per_v = moved_um / (above - below);
        source += &format!("    ({z_um:?}, {drive_v:?}, {um_per_v:?}),\n");
    }
    Ok(source + "];\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_are_what_the_model_gives() {
        let model = Model::load(MODEL).expect("it ships");
        let kept = fs::read(workspace().join(CALIBRATION)).expect("it ships");
        assert!(
            kept == calibration(&model).expect("it can be tabulated"),
            "{CALIBRATION} is not the model's: cargo xtask tabulate-factory"
        );
        let kept = fs::read_to_string(workspace().join(SAMPLES)).expect("it ships");
        assert!(
            kept == samples(&model.actuator(0)).expect("it has an inverse"),
            "{SAMPLES} are not the model's: cargo xtask tabulate-factory"
        );
    }
}
