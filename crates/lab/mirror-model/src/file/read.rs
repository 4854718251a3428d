//! From the text of a file to a model. Every error points at its place.

use super::error::{FORMAT, ModelFileError, preset_names};
use super::read_device::StoredDevice;
use super::reader::ModelReader;
use crate::effect::{self, Active, Effect, Formula};
use crate::parameter::{Entry, TABLE};
use crate::{ACTUATORS, Measured, Model, Preset, Provenance, Symbol};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::Arc;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredModel {
    format: toml::Spanned<u32>,
    preset: toml::Spanned<String>,
    #[serde(default)]
    parameters: BTreeMap<toml::Spanned<String>, StoredNumber>,
    #[serde(default)]
    effects: Vec<StoredEffect>,
    #[serde(default)]
    device: StoredDevice,
    #[serde(default)]
    provenance: Provenance,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredEffect {
    id: toml::Spanned<String>,
    definition: Option<toml::Spanned<String>>,
    form: Option<toml::Spanned<String>>,
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
struct StoredNumber {
    value: toml::Spanned<f64>,
    unit: toml::Spanned<String>,
    standard_error: Option<toml::Spanned<f64>>,
    measured: Option<toml::Spanned<StoredMeasured>>,
    actuators: Option<toml::Spanned<[f64; ACTUATORS]>>,
}

/// The error of a measurement of which `value` is the outcome, or outcome and error.
#[derive(Deserialize)]
#[serde(untagged, deny_unknown_fields)]
enum StoredMeasured {
    Error(f64),
    Of { value: f64, error: f64 },
}

impl ModelReader<'_> {
    pub(super) fn model(&self) -> Result<Model, ModelFileError> {
        let stored: StoredModel = toml::from_str(self.text).map_err(|error| {
            let help = "the format is described in docs/reference/model-files.md".into();
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
        self.check_weights(&model, &stored.parameters)?;
        for effect in &stored.effects {
            let active = self.effect(effect)?;
            if model
                .effects
                .iter()
                .any(|other| other.effect.info().id == active.effect.info().id)
            {
                let message = format!("{} is there twice", effect.id.get_ref());
                let help = "a model has each effect once".into();
                return Err(self.wrong(message, help, effect.id.span()));
            }
            model.effects.push(active);
        }
        model.device = self.device(&stored.device, &model)?;
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
        let effect = self.in_form(effect, stored.form.as_ref())?;
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
            self.check_sign(&known[index], &value.value)?;
            active.values[index] = *value.value.get_ref();
            active.standard_errors[index] = value.standard_error;
        }
        Ok(active)
    }

    /// Whether a parameter of an effect has a sign that it can have: no time constant, radius or quality is zero or below where none is plausible.
    fn check_sign(
        &self,
        known: &effect::Parameter,
        value: &toml::Spanned<f64>,
    ) -> Result<(), ModelFileError> {
        let found = *value.get_ref();
        let is_possible = known.low < 0.0 || found > 0.0 || found == known.low;
        if is_possible {
            return Ok(());
        }
        let unit = &known.unit;
        let message = format!("{} = {found} {unit} is impossible", known.symbol);
        let help = format!("plausible is {} to {} {unit}", known.low, known.high);
        Err(self.wrong(message, help, value.span()))
    }

    /// The effect in the form that a file asks for.
    fn in_form(
        &self,
        effect: Arc<dyn Effect>,
        form: Option<&toml::Spanned<String>>,
    ) -> Result<Arc<dyn Effect>, ModelFileError> {
        let Some(form) = form else { return Ok(effect) };
        let forms = effect::forms(&effect);
        let is_it = |known: &&Arc<dyn Effect>| known.form() == form.get_ref().as_str();
        forms.iter().find(is_it).cloned().ok_or_else(|| {
            let names: Vec<_> = forms.iter().map(|known| known.form()).collect();
            let message = format!(
                "{} has no form called '{}'",
                effect.info().id,
                form.get_ref()
            );
            let help = match names[..] {
                [_] => "it has one form only: leave `form` out".into(),
                _ => format!("its forms are {}", names.join(", ")),
            };
            self.wrong(message, help, form.span())
        })
    }

    fn parameter(
        &self,
        model: &mut Model,
        name: &toml::Spanned<String>,
        stored: &StoredNumber,
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
        if let Some(stored_measured) = &stored.measured {
            let measured = match *stored_measured.get_ref() {
                StoredMeasured::Error(error) => Measured {
                    value: *stored.value.get_ref(),
                    error,
                },
                StoredMeasured::Of { value, error } => Measured { value, error },
            };
            let is_known = |number: f64| number.is_finite() && number > 0.0;
            if !(is_known(measured.value) && is_known(measured.error)) {
                let message = format!("{} cannot have been measured so", entry.name);
                return Err(self.wrong(
                    message,
                    "write measured = 0.004 for one standard deviation of the value, both above 0"
                        .into(),
                    stored_measured.span(),
                ));
            }
            model.measured.insert(symbol, measured);
        }
        if let Some(values) = &stored.actuators {
            for &value in values.get_ref() {
                self.check(entry, value, values.span())?;
            }
            model.by_actuator.insert(symbol, *values.get_ref());
        }
        Ok(())
    }

    /// Whether the weights of the thermal poles leave one for the fast pole.
    fn check_weights(
        &self,
        model: &Model,
        stored: &BTreeMap<toml::Spanned<String>, StoredNumber>,
    ) -> Result<(), ModelFileError> {
        let weights = [Symbol::MiddleWeight, Symbol::SlowWeight];
        let names = weights.map(|symbol| symbol.entry().name);
        let is_weight = |name: &toml::Spanned<String>| names.contains(&name.get_ref().as_str());
        let Some((_, last)) = stored.iter().rfind(|(name, _)| is_weight(name)) else {
            return Ok(());
        };
        let sum = |actuator| -> f64 {
            let parameters = model.actuator(actuator).parameters;
            weights.map(|symbol| parameters.get(symbol)).iter().sum()
        };
        match (0..ACTUATORS).map(sum).find(|sum| *sum >= 1.0) {
            None => Ok(()),
            Some(sum) => Err(self.wrong(
                format!("{} come to {sum}", names.join(" and ")),
                "with the fast pole's, weights add up to 1: leave it some".into(),
                last.value.span(),
            )),
        }
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
}
