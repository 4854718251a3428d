//! The readers of text: measurements, models, effects, calibration files.

use calibration::{from_toml, to_toml};
use measurement::MeasurementFile;
use mirror_model::Model;
use mirror_model::effect::Formula;

use crate::factory::factory;

/// What the measurement reader is given.
pub(crate) fn measurement_seeds() -> Vec<Vec<u8>> {
    [
        &include_bytes!("../corpus/measurement/repeat.csv")[..],
        include_bytes!("../corpus/measurement/sine.csv"),
        include_bytes!("../corpus/measurement/step.csv"),
    ]
    .map(<[u8]>::to_vec)
    .into()
}

/// What it reads, it writes so that it reads the same.
pub(crate) fn measurement(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    if let Ok(file) = MeasurementFile::parse("fuzz.csv", &text) {
        let again = MeasurementFile::parse("fuzz.csv", &file.to_string());
        assert!(again.is_ok(), "what was written is not read: {again:?}");
    }
}

/// What the model reader is given.
pub(crate) fn model_seeds() -> Vec<Vec<u8>> {
    let presets = ["paper", "paper-refit", "reconciled"].map(|name| {
        let model = Model::load(name).expect("a preset");
        model.to_toml().into_bytes()
    });
    presets.into()
}

/// What it reads, it writes so that it reads the same, and the model can be used.
pub(crate) fn model(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    if let Ok(model) = Model::parse("fuzz.toml", &text) {
        let again = Model::parse("fuzz.toml", &model.to_toml());
        assert!(again.is_ok(), "what was written is not read: {again:?}");
        model.actuator(0).displacement_at_voltage_um(1.0);
    }
}

/// What the reader of effects is given.
pub(crate) fn effect_seeds() -> Vec<Vec<u8>> {
    vec![include_bytes!("../corpus/effect/template.toml").to_vec()]
}

/// It reads it, or says why not.
pub(crate) fn effect(input: &[u8]) {
    // Whether it is read does not matter here.
    let _ = Formula::parse("fuzz.toml", &String::from_utf8_lossy(input));
}

/// What the reader of calibration files is given.
pub(crate) fn calibration_file_seeds() -> Vec<Vec<u8>> {
    vec![to_toml(&factory()).into_bytes()]
}

/// What it reads, it writes so that it reads the same.
pub(crate) fn calibration_file(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    if let Ok(calibration) = from_toml("fuzz.toml", &text) {
        let again = from_toml("fuzz.toml", &to_toml(&calibration));
        assert!(again.is_ok_and(|again| again == calibration));
    }
}
