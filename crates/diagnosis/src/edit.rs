//! Adding an effect to a model, or taking it away, with the errors before and after.

use crate::compare::{Comparison, compare};
use crate::fit_report::{FitReport, fit_and_report};
use crate::plan::Plan;
use mirror_model::effect::{Active, Effect};
use mirror_model::{Model, Runaway};
use serde::Serialize;
use std::fmt;
use std::sync::Arc;
use thiserror::Error;

/// An error that falls by less than this share of itself has not fallen.
const WORTHWHILE: f64 = 0.02;

/// Why a model was not changed.
#[derive(Debug, Error, miette::Diagnostic)]
pub enum EditError {
    /// It has the effect already.
    #[error("the model has the effect '{0}' already")]
    #[diagnostic(help("refit it with `host-tool fit`, or remove it first"))]
    Present(String),
    /// It does not have it.
    #[error("the model has no effect '{0}'")]
    Absent(String),
    /// The changed model has no finite answer.
    #[error(transparent)]
    Runaway(#[from] Runaway),
}

/// A changed model's errors beside those of the model before, both fitted.
#[derive(Clone, Debug, Serialize)]
pub struct Edit {
    /// Errors of the model as it was, fitted.
    pub before: Comparison,
    /// Errors of the changed model, fitted.
    pub after: Comparison,
    /// What the fit of the changed model found.
    pub fit: FitReport,
    /// Whether the change pays, in a sentence.
    pub advice: String,
}

/// Adds an effect and refits everything.
///
/// # Errors
/// See [`EditError`].
pub fn add(
    model: &Model,
    effect: Arc<dyn Effect>,
    plan: &Plan,
    files: &[String],
) -> Result<(Model, Edit), EditError> {
    let id = effect.info().id.to_string();
    if model.effects.iter().any(|active| active.id() == id) {
        return Err(EditError::Present(id));
    }
    let mut with = model.clone();
    with.effects.push(Active::usual(effect));
    change(model, &with, plan, files, |before, after| {
        if after < (1.0 - WORTHWHILE) * before {
            format!("with {id} the error falls from {before:.3} to {after:.3} um rms")
        } else {
            format!(
                "{id} does not lower the error ({before:.3} to {after:.3} um rms): better leave it out"
            )
        }
    })
}

/// Takes an effect away and refits everything.
///
/// # Errors
/// See [`EditError`].
pub fn remove(
    model: &Model,
    id: &str,
    plan: &Plan,
    files: &[String],
) -> Result<(Model, Edit), EditError> {
    let mut without = model.clone();
    without.effects.retain(|active| active.id() != id);
    if without.effects.len() == model.effects.len() {
        return Err(EditError::Absent(id.into()));
    }
    change(model, &without, plan, files, |before, after| {
        if after > (1.0 + WORTHWHILE) * before {
            format!(
                "without {id} the error rises from {before:.3} to {after:.3} um rms: better keep it"
            )
        } else {
            format!("without {id} the error stays ({before:.3} to {after:.3} um rms)")
        }
    })
}

fn change(
    old: &Model,
    new: &Model,
    plan: &Plan,
    files: &[String],
    advice: impl Fn(f64, f64) -> String,
) -> Result<(Model, Edit), EditError> {
    let (old, _) = fit_and_report(old, plan, files)?;
    let (new, fit) = fit_and_report(new, plan, files)?;
    let (before, after) = (compare(&old, plan)?, compare(&new, plan)?);
    let advice = advice(before.rms, after.rms);
    Ok((
        new,
        Edit {
            before,
            after,
            fit,
            advice,
        },
    ))
}

impl fmt::Display for Edit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "  {:<14} {:>10} {:>10}   um rms",
            "experiment", "before", "after"
        )?;
        for before in &self.before.experiments {
            let after = self
                .after
                .experiments
                .iter()
                .find(|after| after.experiment == before.experiment);
            writeln!(
                f,
                "  {:<14} {:>10.3} {:>10.3}",
                before.experiment,
                before.rms,
                after.map_or(f64::NAN, |after| after.rms)
            )?;
        }
        writeln!(f, "  {}", self.advice)?;
        write!(f, "{}", self.fit)
    }
}
