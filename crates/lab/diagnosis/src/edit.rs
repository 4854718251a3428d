//! Adding an effect to a model, or taking it away, with the errors before and after.

use crate::diagnose::with_effect;
use crate::null_improvement::{Fall, NullImprovement};
use crate::report::{BeforeAfter, WORTHWHILE};
use identification::dataset::Dataset;
use identification::fit::{Fitted, fit};
use identification::fit_report::{FitReport, report};
use identification::{Comparison, Unit, compare};
use mirror_model::effect::Effect;
use mirror_model::{ACTUATORS, Model, Runaway};
use serde::Serialize;
use std::fmt;
use std::path::Path;
use std::sync::Arc;
use thiserror::Error;

/// Why a model was not changed.
#[derive(Debug, Error, miette::Diagnostic)]
pub enum EditError {
    /// It has the effect already.
    #[error("the model has the effect '{0}' already")]
    #[diagnostic(help("refit it with `host-tool fit`, or remove it first"))]
    Present(String),
    /// It does not have it.
    #[error("the model has no effect '{id}'")]
    #[diagnostic(help("it has {}", if has.is_empty() { "none, so there is nothing to remove" } else { has }))]
    Absent {
        /// What was asked for.
        id: String,
        /// Those that it has.
        has: String,
    },
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
    /// By how much the same addition lowers the errors of mirrors that lack nothing; none where something was taken away.
    pub null_improvement: Option<NullImprovement>,
    /// Whether the change pays, in a sentence.
    pub advice: String,
}

/// A model before and after, both fitted, and what the change is worth.
pub struct Changed {
    /// The model as it was, fitted.
    pub before: Model,
    /// The changed model, fitted.
    pub after: Model,
    /// Their errors, and whether the change pays.
    pub edit: Edit,
}

/// Adds an effect and refits everything. `cache` is as in [`diagnose`](crate::diagnose()).
///
/// # Errors
/// See [`EditError`].
pub fn add(
    model: &Model,
    effect: Arc<dyn Effect>,
    data: &Dataset,
    files: &[String],
    cache: Option<&Path>,
) -> Result<Changed, EditError> {
    let id = effect.info().id.to_string();
    if model.effects.iter().any(|active| active.id() == id) {
        return Err(EditError::Present(id));
    }
    let added = with_effect(model, effect, data, cache)?;
    let fitted_numbers = added.with.free.len();
    let mut changed = change(added.without, added.with, data, files)?;
    let read = data.observations.iter();
    let driven = read.filter(|o| data.drive(o) != [0.0; ACTUATORS]).count();
    changed.edit.advice = if driven <= fitted_numbers {
        changed.edit.on_fitting_everything(&id)
    } else {
        changed.edit.on_adding(&id, &added.null_improvement)
    };
    changed.edit.null_improvement = Some(added.null_improvement);
    Ok(changed)
}

/// Takes an effect away and refits everything.
///
/// # Errors
/// See [`EditError`].
pub fn remove(
    model: &Model,
    id: &str,
    data: &Dataset,
    files: &[String],
) -> Result<Changed, EditError> {
    let mut without = model.clone();
    without.effects.retain(|active| active.id() != id);
    if without.effects.len() == model.effects.len() {
        let has: Vec<&str> = model.effects.iter().map(|active| active.id()).collect();
        return Err(EditError::Absent {
            id: id.into(),
            has: has.join(", "),
        });
    }
    let mut changed = change(fit(model, data)?, fit(&without, data)?, data, files)?;
    changed.edit.advice = changed.edit.on_removing(id);
    Ok(changed)
}

fn change(
    before: Fitted,
    after: Fitted,
    data: &Dataset,
    files: &[String],
) -> Result<Changed, EditError> {
    let (before, _) = report(before, data, files)?;
    let (after, fit) = report(after, data, files)?;
    let edit = Edit {
        before: compare(&before, data)?,
        after: compare(&after, data)?,
        fit,
        null_improvement: None,
        advice: String::new(),
    };
    Ok(Changed {
        before,
        after,
        edit,
    })
}

impl Edit {
    /// "from 0.521 to 0.202 um rms, that of the currents from ..."
    fn course(&self) -> String {
        let errors = self.errors();
        let all = format!("{} rms", from_to(&errors[0]));
        match errors.get(1) {
            Some(currents) => format!("{all}, that of the currents {}", from_to(currents)),
            None => all,
        }
    }

    /// The errors of what is compared, and of the currents beside it where both were measured.
    fn errors(&self) -> Vec<BeforeAfter> {
        let (before, after, unit) = (&self.before, &self.after, self.before.unit);
        let compared = BeforeAfter {
            before: before.rms,
            after: after.rms,
            unit,
        };
        let currents = before.current_rms_ma.zip(after.current_rms_ma);
        let beside = currents.filter(|_| unit == Unit::Micrometre);
        let beside = beside.map(|(before, after)| BeforeAfter {
            before,
            after,
            unit: Unit::Milliampere,
        });
        [Some(compared), beside].into_iter().flatten().collect()
    }

    /// "the error falls: from 0.521 to 0.202 um rms, that of the currents rises: from ...": first the one that does what is told.
    fn course_of(&self, is_told: impl Fn(&BeforeAfter) -> bool) -> String {
        let mut errors = self.errors();
        let of_currents_alone = !is_told(&errors[0]) && errors.iter().any(&is_told);
        if of_currents_alone {
            errors.reverse();
        }
        let (first, second) = match of_currents_alone {
            true => ("the error of the currents", "that of the displacement"),
            false => ("the error", "that of the currents"),
        };
        let does = verb(&errors[0]);
        let mut said = format!("{first} {does}: {} rms", from_to(&errors[0]));
        if let Some(other) = errors.get(1) {
            said += &match verb(other) {
                same if same == does => format!(", {second} {}", from_to(other)),
                differs => format!(", {second} {differs}: {}", from_to(other)),
            };
        }
        said
    }

    fn on_adding(&self, id: &str, null: &NullImprovement) -> String {
        let falls = |error: &BeforeAfter| error.fall() >= WORTHWHILE;
        let errors = self.errors();
        if !errors.iter().any(falls) {
            let course = self.course();
            return format!("{id} does not lower the error ({course}): better leave it out");
        }
        let most = |fall: Option<Fall>| fall.map_or(0.0, |fall| fall.most);
        let of_null = [null.displacement.or(null.currents), null.currents];
        let course = self.course_of(falls);
        let mut beside = errors.iter().zip(of_null);
        if beside.any(|(error, null)| error.fall() > most(null)) {
            format!("with {id} {course}")
        } else {
            format!(
                "with {id} {course}; that alone proves nothing, it falls as much where nothing is missing"
            )
        }
    }

    /// As many parameters as readings beside those at rest.
    fn on_fitting_everything(&self, id: &str) -> String {
        format!(
            "with {id} the error goes {}; that proves nothing, as many numbers are fitted as were read",
            self.course()
        )
    }

    fn on_removing(&self, id: &str) -> String {
        let rises = |error: &BeforeAfter| error.fall() < -WORTHWHILE;
        if self.errors().iter().any(rises) {
            format!("without {id} {}: better keep it", self.course_of(rises))
        } else {
            format!("without {id} the error does not rise: {}", self.course())
        }
    }
}

/// What an error does.
fn verb(error: &BeforeAfter) -> &'static str {
    match error.fall() {
        fall if fall >= WORTHWHILE => "falls",
        fall if fall < -WORTHWHILE => "rises",
        _ => "hardly changes",
    }
}

/// "from 0.521 to 0.202 um"; that of currents beside a displacement with a digit more, as in the table.
fn from_to(error: &BeforeAfter) -> String {
    let BeforeAfter {
        before,
        after,
        unit,
    } = error;
    let digits = match unit {
        Unit::Micrometre => 3,
        Unit::Milliampere => 4,
    };
    format!("from {before:.digits$} to {after:.digits$} {unit}")
}

impl fmt::Display for Edit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = self.before.unit;
        let currents = unit == Unit::Micrometre && self.before.current_rms_ma.is_some();
        let heading = if currents {
            "currents before      after   mA rms"
        } else {
            ""
        };
        writeln!(
            f,
            "  {:<14} {:>10} {:>10}   {unit} rms  {heading}",
            "experiment", "before", "after"
        )?;
        for before in &self.before.experiments {
            let mut others = self.after.experiments.iter();
            let Some(after) = others.find(|after| after.experiment == before.experiment) else {
                continue;
            };
            write!(
                f,
                "  {:<14} {:>10.3} {:>10.3}",
                before.experiment, before.rms, after.rms
            )?;
            match (before.current_rms_ma, after.current_rms_ma) {
                (Some(before), Some(after)) if currents => {
                    writeln!(f, "           {before:>15.4} {after:>10.4}")?;
                }
                _ => writeln!(f)?,
            }
        }
        writeln!(f, "  {}", self.advice)?;
        if let Some(null) = &self.null_improvement {
            writeln!(f, "  {null}")?;
        }
        write!(f, "{}", self.fit)
    }
}

#[cfg(test)]
mod tests {
    use identification::StageErrors;
    use std::collections::BTreeMap;

    use super::*;

    fn errors(rms: f64, current_rms_ma: Option<f64>) -> Comparison {
        Comparison {
            experiments: Vec::new(),
            unit: Unit::Micrometre,
            stages: StageErrors::default(),
            sentences: Vec::new(),
            rms,
            current_rms_ma,
            thinned_rows: 0,
        }
    }

    fn edit(before: (f64, Option<f64>), after: (f64, Option<f64>)) -> Edit {
        Edit {
            before: errors(before.0, before.1),
            after: errors(after.0, after.1),
            fit: FitReport {
                parameters: BTreeMap::new(),
                correlations: Vec::new(),
                inseparable: Vec::new(),
                residual_rms_um: None,
                residual_rms_ma: None,
                thinned_rows: 0,
                notes: vec![],
            },
            null_improvement: None,
            advice: String::new(),
        }
    }

    /// Mirrors that lack nothing, whose errors fall by as much in 95 of 100.
    fn null(most: f64) -> NullImprovement {
        let fall = Some(Fall { median: 0.0, most });
        NullImprovement {
            displacement: fall,
            currents: fall,
        }
    }

    #[test]
    fn an_effect_that_lowers_no_error_is_left_out() {
        // 1 % of both.
        let said = edit((0.5, Some(0.1)), (0.495, Some(0.099))).on_adding("creep", &null(0.0));
        assert!(said.contains("better leave it out"), "{said}");
    }

    #[test]
    fn a_fall_counts_beyond_what_mirrors_that_lack_nothing_show() {
        let halved = edit((0.5, Some(0.1)), (0.25, Some(0.1)));
        let said = halved.on_adding("creep", &null(0.4));
        assert_eq!(
            said,
            "with creep the error falls: from 0.500 to 0.250 um rms, that of the currents hardly changes: from 0.1000 to 0.1000 mA"
        );
        let said = halved.on_adding("creep", &null(0.6));
        assert!(said.contains("that alone proves nothing"), "{said}");
    }

    #[test]
    fn a_fall_of_the_currents_alone_counts_too() {
        let said = edit((0.799, Some(0.1)), (0.801, Some(0.05))).on_adding("aging", &null(0.4));
        assert_eq!(
            said,
            "with aging the error of the currents falls: from 0.1000 to 0.0500 mA rms, that of the displacement hardly changes: from 0.799 to 0.801 um"
        );
    }

    #[test]
    fn two_errors_that_do_the_same_are_told_by_one_verb() {
        let said = edit((0.5, Some(0.1)), (0.25, Some(0.05))).on_adding("creep", &null(0.4));
        assert_eq!(
            said,
            "with creep the error falls: from 0.500 to 0.250 um rms, that of the currents from 0.1000 to 0.0500 mA"
        );
    }

    #[test]
    fn an_effect_without_which_the_error_rises_is_kept() {
        let said = edit((0.2, None), (0.5, None)).on_removing("creep");
        assert_eq!(
            said,
            "without creep the error rises: from 0.200 to 0.500 um rms: better keep it"
        );
        let said = edit((0.2, None), (0.201, None)).on_removing("creep");
        assert!(said.contains("does not rise"), "{said}");
        let said = edit((0.2, Some(0.1)), (0.1, Some(0.2))).on_removing("creep");
        assert_eq!(
            said,
            "without creep the error of the currents rises: from 0.1000 to 0.2000 mA rms, that of the displacement falls: from 0.200 to 0.100 um: better keep it"
        );
    }
}
