//! Trials of a calibration as `calibrate --trial` writes them, made up.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use control_core::Calibration;
use control_core::calibration::Label;
use mirror_model::{Model, Preset};
use serde_json::{Value, json};

/// Readings of each series.
const READINGS: u32 = 200;

/// A board that is everywhere `before` beside where it was asked to be, and then `after` (um).
pub(crate) fn trial(before_um: f64, after_um: f64) -> Value {
    let model = Model::from(Preset::Reconciled);
    let mut calibration = calibration::tabulate(&model)
        .expect("it has an inverse")
        .calibration
        .parts()
        .to_owned();
    let label = |text| Label::new(text).expect("short");
    calibration.origin.device = label("mirror <7>");
    calibration.origin.date = label("2026-11-21");
    let calibration = Calibration::new(calibration).expect("a calibration");
    json!({
        "format": 1,
        "version": env!("CARGO_PKG_VERSION"),
        "board": "a made-up board",
        "calibrated_before": "as the factory left it",
        "calibration": calibration::to_toml(&calibration),
        "not_inverted": ["resonance: it still rings"],
        "before": series(before_um),
        "after": series(after_um),
    })
}

fn series(error_um: f64) -> Value {
    let along = |asked: fn(f64) -> f64| -> Value {
        let point = |index: u32| {
            let part = f64::from(index) / f64::from(READINGS);
            let asked_um = asked(part);
            json!({ "t_s": part, "asked_um": asked_um, "reached_um": asked_um + error_um })
        };
        json!({ "points": (0..READINGS).map(point).collect::<Value>() })
    };
    let sine = |part: f64| 80.0 + 20.0 * (TAU * part).sin();
    json!({
        "rest": along(|part| 10.0 + 150.0 * part),
        "step": along(|_| 110.0),
        "step_from_um": 40.0,
        "slow_sine": along(sine),
        "fast_sine": along(sine),
        "triangle": along(|part| 60.0 + 40.0 * (part - 0.5).abs()),
    })
}

/// The same as a file.
pub(crate) fn written(trial: &Value, folder: &Path) -> PathBuf {
    let path = folder.join("trial.json");
    std::fs::write(&path, trial.to_string()).expect("written");
    path
}
