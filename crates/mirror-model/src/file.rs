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
//! [provenance]
//! device = "mirror 7"
//! files = ["sweep.csv"]
//! residual_rms_um = 0.12
//! ```
//!
//! A parameter that is left out has the preset's value, or its effect's usual one. A user's own effect carries its
//! `definition`, the text of its file.

use crate::effect::{self, Active, Effect, Formula};
use crate::parameter::{Entry, TABLE};
use crate::{ACTUATORS, Model, Preset, Provenance, Symbol};
use miette::{Diagnostic, NamedSource, SourceSpan};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;
use thiserror::Error;

/// The version of the format that this crate reads and writes.
const FORMAT: u32 = 1;

/// Why a model could not be loaded.
#[derive(Debug, Error, Diagnostic)]
pub enum ModelFileError {
    /// It is neither a preset nor a file.
    #[error("there is no model called '{name}'")]
    #[diagnostic(help("use a preset ({}) or the path of a model file", preset_names()))]
    NotFound {
        /// What was asked for.
        name: String,
    },
    /// The file is there but cannot be read.
    #[error("the model file '{path}' cannot be read")]
    Unreadable {
        /// The file.
        path: String,
        /// What the system said.
        #[source]
        source: std::io::Error,
    },
    /// The file says something that no model can have.
    #[error("{message}")]
    #[diagnostic(help("{help}"))]
    Content {
        /// What is wrong.
        message: String,
        /// What to do.
        help: String,
        /// The file's text.
        #[source_code]
        text: Arc<NamedSource<String>>,
        /// Where it is wrong.
        #[label("here")]
        place: SourceSpan,
    },
}

fn preset_names() -> String {
    Preset::ALL.map(Preset::name).join(", ")
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    format: toml::Spanned<u32>,
    preset: toml::Spanned<String>,
    #[serde(default)]
    parameters: BTreeMap<toml::Spanned<String>, StoredParameter>,
    #[serde(default)]
    effects: Vec<StoredEffect>,
    #[serde(default)]
    provenance: Provenance,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredEffect {
    id: toml::Spanned<String>,
    definition: Option<toml::Spanned<String>>,
    #[serde(default)]
    parameters: BTreeMap<toml::Spanned<String>, StoredValue>,
}

/// A parameter of an effect.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredValue {
    value: toml::Spanned<f64>,
    unit: toml::Spanned<String>,
    standard_error: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredParameter {
    value: toml::Spanned<f64>,
    unit: toml::Spanned<String>,
    standard_error: Option<toml::Spanned<f64>>,
    actuators: Option<toml::Spanned<[f64; ACTUATORS]>>,
}

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
        let text =
            std::fs::read_to_string(name_or_path).map_err(|source| ModelFileError::Unreadable {
                path: name_or_path.into(),
                source,
            })?;
        Self::parse(name_or_path, &text)
    }

    /// Reads a model file's text; `name` is what errors call it.
    ///
    /// # Errors
    /// [`ModelFileError::Content`], pointing at the place.
    pub fn parse(name: &str, text: &str) -> Result<Self, ModelFileError> {
        Reader { name, text }.model()
    }

    /// The model as a file's text. [`Model::parse`] gives the same model back, to the last bit.
    pub fn to_toml(&self) -> String {
        let mut text = format!(
            "format = {FORMAT}\npreset = \"{}\"\n\n[parameters]\n",
            self.preset.name()
        );
        for entry in &TABLE {
            self.write_parameter(entry, &mut text)
                .expect("writing to a string cannot fail");
        }
        for effect in &self.effects {
            write_effect(effect, &mut text).expect("writing to a string cannot fail");
        }
        let provenance = toml::to_string(&self.provenance).expect("provenance is plain data");
        text + "\n[provenance]\n" + &provenance
    }

    fn write_parameter(&self, entry: &Entry, text: &mut String) -> std::fmt::Result {
        let value = self.parameters.get(entry.symbol);
        write!(
            text,
            "{} = {{ value = {value:?}, unit = \"{}\"",
            entry.name, entry.unit
        )?;
        if let Some(error) = self.standard_errors.get(&entry.symbol) {
            write!(text, ", standard_error = {error:?}")?;
        }
        if let Some(values) = self.by_actuator.get(&entry.symbol) {
            write!(text, ", actuators = {values:?}")?;
        }
        writeln!(text, " }} # {}", entry.meaning)
    }
}

fn write_effect(active: &Active, text: &mut String) -> std::fmt::Result {
    let info = active.effect.info();
    writeln!(
        text,
        "\n[[effects]] # {}: {}\nid = {}",
        info.title,
        info.equation,
        quoted(&info.id)
    )?;
    if let Some(definition) = active.effect.definition() {
        writeln!(text, "definition = {}", quoted(definition))?;
    }
    writeln!(text, "[effects.parameters]")?;
    for ((p, value), error) in info
        .parameters
        .iter()
        .zip(&active.values)
        .zip(&active.standard_errors)
    {
        write!(
            text,
            "{} = {{ value = {value:?}, unit = {}",
            quoted(&p.symbol),
            quoted(&p.unit)
        )?;
        if let Some(error) = error {
            write!(text, ", standard_error = {error:?}")?;
        }
        writeln!(text, " }}")?;
    }
    Ok(())
}

fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

struct Reader<'a> {
    name: &'a str,
    text: &'a str,
}

impl Reader<'_> {
    fn model(&self) -> Result<Model, ModelFileError> {
        let stored: Stored = toml::from_str(self.text).map_err(|error| {
            let help = "the format is described in docs/model.md".into();
            self.wrong(error.message().into(), help, error.span().unwrap_or(0..0))
        })?;
        if *stored.format.get_ref() != FORMAT {
            let message = format!(
                "this is format {} of model files, and only format {FORMAT} is known",
                stored.format.get_ref()
            );
            return Err(self.wrong(
                message,
                "use the version of the tool that wrote it".into(),
                stored.format.span(),
            ));
        }
        let preset = Preset::from_name(stored.preset.get_ref()).ok_or_else(|| {
            let message = format!("there is no preset called '{}'", stored.preset.get_ref());
            self.wrong(
                message,
                format!("the presets are {}", preset_names()),
                stored.preset.span(),
            )
        })?;
        let mut model = Model {
            provenance: stored.provenance,
            ..Model::from(preset)
        };
        for (name, parameter) in &stored.parameters {
            self.parameter(&mut model, name, parameter)?;
        }
        model.effects = stored
            .effects
            .iter()
            .map(|effect| self.effect(effect))
            .collect::<Result<_, _>>()?;
        Ok(model)
    }

    fn effect(&self, stored: &StoredEffect) -> Result<Active, ModelFileError> {
        let id = stored.id.get_ref();
        let effect: Arc<dyn Effect> = match &stored.definition {
            Some(text) => Arc::new(
                Formula::parse(id, text.get_ref())
                    .map_err(|error| self.wrong(error.message, error.help, text.span()))?,
            ),
            None => effect::find(id).ok_or_else(|| {
                let message = format!("there is no effect called '{id}'");
                self.wrong(
                    message,
                    "`effect list` names them; a formula of your own needs its definition".into(),
                    stored.id.span(),
                )
            })?,
        };
        let mut active = Active::usual(effect.clone());
        for (symbol, value) in &stored.parameters {
            let known = &effect.info().parameters;
            let Some(index) = known.iter().position(|p| p.symbol == *symbol.get_ref()) else {
                let names: Vec<_> = known.iter().map(|p| p.symbol.as_ref()).collect();
                let message = format!("{id} has no parameter '{}'", symbol.get_ref());
                return Err(self.wrong(
                    message,
                    format!("it has {}", names.join(", ")),
                    symbol.span(),
                ));
            };
            if known[index].unit != *value.unit.get_ref() {
                let message = format!(
                    "{symbol} is in {}, not in '{}'",
                    known[index].unit,
                    value.unit.get_ref(),
                    symbol = symbol.get_ref()
                );
                return Err(self.wrong(
                    message,
                    "convert the value and change the unit".into(),
                    value.unit.span(),
                ));
            }
            if !value.value.get_ref().is_finite() {
                let message = format!("{} must be a finite number", symbol.get_ref());
                return Err(self.wrong(
                    message,
                    format!("a usual one is {}", known[index].start),
                    value.value.span(),
                ));
            }
            active.values[index] = *value.value.get_ref();
            active.standard_errors[index] = value.standard_error;
        }
        Ok(active)
    }

    fn parameter(
        &self,
        model: &mut Model,
        name: &toml::Spanned<String>,
        stored: &StoredParameter,
    ) -> Result<(), ModelFileError> {
        let symbol = Symbol::from_name(name.get_ref()).ok_or_else(|| {
            let known: Vec<_> = TABLE.iter().map(|entry| entry.name).collect();
            let message = format!("there is no parameter called '{}'", name.get_ref());
            self.wrong(
                message,
                format!("the parameters are {}", known.join(", ")),
                name.span(),
            )
        })?;
        let entry = symbol.entry();
        if stored.unit.get_ref() != entry.unit {
            let message = format!(
                "{name} is in {}, not in '{}'",
                entry.unit,
                stored.unit.get_ref(),
                name = entry.name
            );
            return Err(self.wrong(
                message,
                "convert the value and change the unit".into(),
                stored.unit.span(),
            ));
        }
        self.check(entry, *stored.value.get_ref(), stored.value.span())?;
        model.parameters.set(symbol, *stored.value.get_ref());
        model.standard_errors.remove(&symbol);
        if let Some(error) = &stored.standard_error {
            if !(error.get_ref().is_finite() && *error.get_ref() >= 0.0) {
                let message = format!(
                    "the standard error of {} must be a number that is not negative",
                    entry.name
                );
                return Err(self.wrong(
                    message,
                    "leave it out if it is not known".into(),
                    error.span(),
                ));
            }
            model.standard_errors.insert(symbol, *error.get_ref());
        }
        if let Some(values) = &stored.actuators {
            for &value in values.get_ref() {
                self.check(entry, value, values.span())?;
            }
            model.by_actuator.insert(symbol, *values.get_ref());
        }
        Ok(())
    }

    fn check(
        &self,
        entry: &Entry,
        value: f64,
        place: std::ops::Range<usize>,
    ) -> Result<(), ModelFileError> {
        let (low, high) = entry.range;
        if (low..=high).contains(&value) {
            return Ok(());
        }
        let message = format!(
            "{} = {value} {unit} is impossible: {}",
            entry.name,
            entry.meaning,
            unit = entry.unit
        );
        Err(self.wrong(
            message,
            format!("it must lie between {low} and {high} {}", entry.unit),
            place,
        ))
    }

    fn wrong(
        &self,
        message: String,
        help: String,
        place: std::ops::Range<usize>,
    ) -> ModelFileError {
        let text = Arc::new(NamedSource::new(self.name, self.text.to_owned()));
        ModelFileError::Content {
            message,
            help,
            text,
            place: place.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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
        let own = "id = \"own's \\\"thing\\\"\"\nstage = \"shape\"\nacts = \"displacement\"\nformula = \"x * (1 + q)\"\n\
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
                "R0 = { value = 1.0, unit = \"ohm\", colour = 1 }",
                "colour",
                "colour",
            ),
        ] {
            let (said, at) = error(&format!("{head}{line}\n"));
            assert!(said.contains(message), "{said}");
            assert_eq!(at, place);
        }
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
