//! A session evaluated for a page: diagnosed, and fitted without and with what is missing.

use std::path::Path;
use std::sync::Arc;

use control_core::Calibration;
use diagnosis::{Diagnosis, EditError, ExpectedGains, add, diagnose};
use identification::{Comparison, Dataset, compare, fit_and_report};
use lab_view::{Chosen, Opening};
use mirror_model::effect::{Effect, Formula, find};
use mirror_model::{Model, Runaway};
use serde_json::{Value, json};

use super::inside::{FittedModel, Inside};
use crate::commands::Diagnosed;
use crate::error::{ToolError, UnusableInput};
use crate::tried::Tried;

/// A model is fitted with each of so many effects that may be missing, the best ones.
const RIVALS: usize = 3;

/// A model that was fitted to the session.
pub(super) struct Fit {
    /// What it is called in the page.
    pub(super) name: String,
    pub(super) model: Model,
    pub(super) compared: Comparison,
}

/// A session evaluated for a page.
pub(crate) struct Run {
    /// What the page carries.
    pub(crate) inside: Inside,
    pub(super) found: Diagnosis,
    pub(super) fits: Vec<Fit>,
    pub(super) own: Vec<Arc<dyn Effect>>,
    pub(super) data: Dataset,
    /// A sentence for each file that is not whole.
    pub(crate) flaws: Vec<String>,
    /// That of the trial.
    pub(super) calibration: Option<Calibration>,
}

/// Why a session cannot be evaluated.
pub(crate) enum RunError {
    /// What it is opened with is not whole.
    Opening(String),
    /// As in the commands that do the same one by one.
    Tool(Box<ToolError>),
}

impl RunError {
    /// Of this page.
    pub(crate) fn of(self, path: &Path) -> ToolError {
        match self {
            Self::Opening(reason) => ToolError::from(UnusableInput::NotAReport {
                path: path.to_owned(),
                reason,
            }),
            Self::Tool(error) => *error,
        }
    }
}

impl From<Runaway> for RunError {
    fn from(error: Runaway) -> Self {
        Self::Tool(Box::new(error.into()))
    }
}

impl From<EditError> for RunError {
    fn from(error: EditError) -> Self {
        Self::Tool(Box::new(error.into()))
    }
}

impl Run {
    /// Evaluates a session, and a trial beside it. `cache` is as in [`diagnose`].
    pub(crate) fn carry_out(
        opening: Opening,
        rows_left_out: usize,
        tried: Option<Tried>,
        cache: &Path,
    ) -> Result<Self, RunError> {
        let session = opening.session().map_err(RunError::Opening)?;
        let calibration = tried.as_ref().map(Tried::calibration).transpose();
        let calibration = calibration.map_err(RunError::Opening)?;
        let model = Model::parse("model", &opening.model);
        let model = model.map_err(|error| RunError::Opening(error.to_string()))?;
        let own = opening.own_effects.iter().map(|text| {
            let effect = Formula::parse("own effect", text);
            effect.map(|effect| Arc::new(effect) as Arc<dyn Effect>)
        });
        let own: Vec<_> = own
            .collect::<Result<_, _>>()
            .map_err(|error| RunError::Opening(error.to_string()))?;
        let names: Vec<String> = opening.files.iter().map(|file| file.name.clone()).collect();
        let data = Dataset::new(&session);
        let found = diagnose(&model, &data, &own, Some(cache))?;
        let fits = fits(&model, &data, &found, &own, &names, cache)?;
        let results = results(&found, &fits, tried.as_ref());
        let models = fits.iter().map(Fit::carried).collect();
        Ok(Self {
            inside: Inside::new(opening, rows_left_out, tried, models, results),
            found,
            fits,
            own,
            data,
            flaws: session.flaws(),
            calibration,
        })
    }

    /// The verdict in words.
    pub(crate) fn verdict(&self) -> String {
        let said = self.found.to_string();
        said.lines().next().unwrap_or_default().to_owned()
    }
}

/// The model fitted as it is, and with each effect that may be missing.
fn fits(
    model: &Model,
    data: &Dataset,
    found: &Diagnosis,
    own: &[Arc<dyn Effect>],
    names: &[String],
    cache: &Path,
) -> Result<Vec<Fit>, RunError> {
    let of_own = |id: &String| own.iter().find(|effect| effect.info().id == *id).cloned();
    let mut without = None;
    let mut with = Vec::new();
    for id in found.effects.iter().take(RIVALS) {
        let Some(effect) = find(id).or_else(|| of_own(id)) else {
            continue;
        };
        let changed = add(model, effect, data, names, Some(cache))?;
        with.push(Fit {
            name: format!("fitted with {id}"),
            model: changed.after,
            compared: changed.edit.after,
        });
        without.get_or_insert((changed.before, changed.edit.before));
    }
    let (model, compared) = match without {
        Some(fitted) => fitted,
        None => {
            let (model, _) = fit_and_report(model, data, names)?;
            let compared = compare(&model, data)?;
            (model, compared)
        }
    };
    let name = "fitted".to_owned();
    let mut fits = vec![Fit {
        name,
        model,
        compared,
    }];
    fits.append(&mut with);
    Ok(fits)
}

impl Fit {
    fn carried(&self) -> FittedModel {
        let chosen = |active: &mirror_model::effect::Active| Chosen {
            id: active.id().to_owned(),
            form: active.effect.form().to_owned(),
            values: active.values.clone(),
        };
        FittedModel {
            name: self.name.clone(),
            toml: self.model.to_toml(),
            effects: self.model.effects.iter().map(chosen).collect(),
        }
    }
}

/// The numbers as they are read back from a page.
fn results(found: &Diagnosis, fits: &[Fit], tried: Option<&Tried>) -> Value {
    let compared = fits
        .iter()
        .map(|fit| (fit.name.clone(), json!(fit.compared)));
    let compared: serde_json::Map<_, _> = compared.collect();
    let mut results = json!({ "diagnosis": Diagnosed::new(found, ExpectedGains::default()), "comparisons": compared });
    if let Some(Tried { before, after, .. }) = tried {
        results["trial"] = json!({ "before": before.figures(), "after": after.figures() });
    }
    serde_json::from_str(&results.to_string()).expect("what was written is read")
}
