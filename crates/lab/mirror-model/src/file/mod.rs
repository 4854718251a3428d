//! Model files: TOML that a person can read and edit.
//!
//! ```toml
//! format = 1
//! preset = "reconciled"
//!
//! [parameters]
//! R_T = { value = 5812.0, unit = "K/W", standard_error = 9.1 }
//! R0 = { value = 360.4, unit = "ohm", actuators = [359.8, 361.0, 360.2, 360.6] }
//!
//! [[effects]]
//! id = "creep"
//! [effects.parameters]
//! c = { value = 0.012, unit = "1", standard_error = 0.001 }
//!
//! [device]
//! leads = { value = 6.5, unit = "ohm", tolerance = 0.5, source = "four-wire measurement" }
//!
//! [provenance]
//! device = "mirror 7"
//! files = ["sweep.csv"]
//! residual_rms_um = 0.12
//! ```
//!
//! A parameter that is left out has the preset's value, or its effect's usual one. A user's own effect carries its
//! `definition`, the text of its file.

mod error;
mod read;
mod read_device;
mod reader;
mod write;

use crate::{Model, Preset};
pub use error::ModelFileError;
use input_file::MOST_WRITTEN;
use reader::ModelReader;
use std::path::Path;

impl Model {
    /// The preset of this name, or else the model in the file of this path.
    ///
    /// # Errors
    /// See [`ModelFileError`].
    pub fn load(name_or_path: &str) -> Result<Self, ModelFileError> {
        if let Some(preset) = Preset::from_name(name_or_path) {
            return Ok(preset.into());
        }
        if !Path::new(name_or_path).exists() {
            return Err(ModelFileError::NotFound {
                name: name_or_path.into(),
            });
        }
        let text = input_file::read_text(Path::new(name_or_path), MOST_WRITTEN)?;
        Self::parse(name_or_path, &text)
    }

    /// Reads a model file's text; `name` is what errors call it.
    ///
    /// # Errors
    /// [`ModelFileError::Content`], pointing at the place.
    pub fn parse(name: &str, text: &str) -> Result<Self, ModelFileError> {
        ModelReader { name, text }.model()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{self, Active, Effect, Formula};
    use crate::{Measured, Provenance, Symbol};
    use miette::Diagnostic;
    use proptest::prelude::*;
    use std::sync::Arc;

    fn error(text: &str) -> (String, String) {
        match Model::parse("m.toml", text) {
            Err(ModelFileError::Content { message, place, .. }) => {
                let place = text[place.offset()..place.offset() + place.len()].to_owned();
                (message, place)
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_presets_name_is_a_model() {
        for preset in Preset::ALL {
            assert_eq!(Model::load(preset.name()).unwrap(), Model::from(preset));
        }
        let said = Model::load("papper").unwrap_err();
        assert!(
            said.to_string().contains("papper")
                && said.help().unwrap().to_string().contains("paper-refit")
        );
    }

    #[test]
    fn what_is_left_out_is_the_presets() {
        let text =
            "format = 1\npreset = \"paper\"\n[parameters]\nxi = { value = 3e-3, unit = \"1/K\" }\n";
        let model = Model::parse("m.toml", text).unwrap();
        assert_eq!(model.parameters.resistance_coefficient_per_k, 3e-3);
        assert_eq!(model.parameters.cold_resistance_ohm, 360.0);
    }

    #[test]
    fn effects_are_kept_with_their_values_and_definitions() {
        let own = "id = \"own-thing\"\ntitle = \"own's \\\"thing\\\"\"\nstage = \"shape\"\nacts = \"displacement\"\nformula = \"x * (1 + q)\"\n\
                   [[parameters]]\nsymbol = \"q\"\nunit = \"1\"\nstart = 0.1\nlow = 0.0\nhigh = 1.0\n";
        let mut model = Model::from(Preset::Paper);
        for effect in effect::built_in()
            .into_iter()
            .chain([Arc::new(Formula::parse("own", own).unwrap()) as Arc<dyn Effect>])
        {
            let mut active = Active::usual(effect);
            active.values[0] *= 0.7;
            active.standard_errors[0] = Some(1e-3);
            model.effects.push(active);
        }
        assert_eq!(Model::parse("m.toml", &model.to_toml()).unwrap(), model);
    }

    #[test]
    fn effects_that_are_not_known_are_pointed_at() {
        let head = "format = 1\npreset = \"paper\"\n[[effects]]\n";
        for (rest, message, place) in [
            ("id = \"creeep\"", "no effect called 'creeep'", "\"creeep\""),
            (
                "id = \"creep\"\n[effects.parameters]\nq = { value = 1.0, unit = \"1\" }",
                "no parameter 'q'",
                "q",
            ),
            (
                "id = \"creep\"\n[effects.parameters]\ntau = { value = 1.0, unit = \"ms\" }",
                "tau is in s",
                "\"ms\"",
            ),
            (
                "id = \"creep\"\n[effects.parameters]\ntau = { value = inf, unit = \"s\" }",
                "finite",
                "inf",
            ),
            (
                "id = \"hysteresis\"\n[effects.parameters]\nr = { value = -1.0, unit = \"um\" }",
                "r = -1 um is impossible",
                "-1.0",
            ),
            (
                "id = \"creep\"\n[effects.parameters]\ntau = { value = 0.0, unit = \"s\" }",
                "tau = 0 s is impossible",
                "0.0",
            ),
            (
                "id = \"creep\"\n[[effects]]\nid = \"creep\"",
                "creep is there twice",
                "\"creep\"",
            ),
        ] {
            let (said, at) = error(&format!("{head}{rest}\n"));
            assert!(said.contains(message), "{said}");
            assert_eq!(at, place);
        }
    }

    #[test]
    fn errors_point_at_the_place() {
        let head = "format = 1\npreset = \"paper\"\n[parameters]\n";
        for (line, message, place) in [
            (
                "Q = { value = 1.0, unit = \"K\" }",
                "no parameter called 'Q'",
                "Q",
            ),
            (
                "R0 = { value = 0.36, unit = \"kohm\" }",
                "R0 is in ohm",
                "\"kohm\"",
            ),
            (
                "R0 = { value = -1.0, unit = \"ohm\" }",
                "impossible",
                "-1.0",
            ),
            ("R0 = { value = nan, unit = \"ohm\" }", "impossible", "nan"),
            (
                "R0 = { value = 1.0, unit = \"ohm\", actuators = [1.0, 1.0, 1.0, 0.0] }",
                "impossible",
                "[1.0, 1.0, 1.0, 0.0]",
            ),
            (
                "R0 = { value = 1.0, unit = \"ohm\", standard_error = -1.0 }",
                "not negative",
                "-1.0",
            ),
            (
                "R0 = { value = 1.0, unit = \"ohm\", measured = 0.0 }",
                "cannot have been measured so",
                "0.0",
            ),
            (
                "R0 = { value = 1.0, unit = \"ohm\", colour = 1 }",
                "colour",
                "colour",
            ),
        ] {
            let (said, at) = error(&format!("{head}{line}\n"));
            assert!(said.contains(message), "{said}");
            assert_eq!(at, place);
        }
        let heavy =
            "w_mid = { value = 0.7, unit = \"1\" }\nw_slow = { value = 0.6, unit = \"1\" }\n";
        let (said, at) = error(&format!("{head}{heavy}"));
        assert!(said.contains("w_mid and w_slow come to 1.2"), "{said}");
        assert_eq!(at, "0.6");
        assert_eq!(error("format = 9\npreset = \"paper\"").1, "9");
        assert_eq!(error("format = 1\npreset = \"papa\"").1, "\"papa\"");
        assert!(Model::parse("m.toml", "").is_err());
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_back(
            preset in prop::sample::select(&Preset::ALL[..]),
            r_t in 1e2..1e4_f64, error in prop::option::of(0.0..1e3_f64), each in prop::option::of([1.0..1e3_f64, 1.0..1e3, 1.0..1e3, 1.0..1e3]),
            device in prop::option::of(".*"), residual in prop::option::of(0.0..10.0_f64), files in prop::collection::vec(".*", 0..3),
        ) {
            let mut model = Model::from(preset);
            model.parameters.thermal_resistance_k_per_w = r_t;
            model.standard_errors = error.map(|error| (Symbol::ThermalResistance, error)).into_iter().collect();
            model.by_actuator = each.map(|each| (Symbol::ColdResistance, each)).into_iter().collect();
            if let Some(error) = error.filter(|error| *error > 0.0) {
                model.measured.insert(Symbol::ThermalResistance, Measured { value: r_t, error });
                model.measured.insert(Symbol::ColdResistance, Measured { value: 0.5 * r_t, error });
            }
            if model.standard_errors.is_empty() { model.standard_errors.remove(&Symbol::CurvatureCoefficient); }
            model.provenance = Provenance { device, residual_rms_um: residual, files, ..Provenance::default() };
            prop_assert_eq!(Model::parse("m.toml", &model.to_toml()).unwrap(), model);
        }

        #[test]
        fn no_text_makes_the_reader_panic(text in ".{0,200}") {
            let _ = Model::parse("m.toml", &text);
        }
    }
}
