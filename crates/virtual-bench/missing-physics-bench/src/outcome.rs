//! What a diagnosis made of one session, beside the truth.

use crate::arguments::Instruments;
use crate::case::{Case, Hidden};
use diagnosis::residual_space::{ResidualSpace, Session};
use diagnosis::{Changed, Diagnosis, NullEnsemble, Ranked, Verdict, add, diagnose};
use identification::fit::{Fitted, fit, fit_parameters, free_parameters};
use identification::prediction::{jacobian, predict, white_noise};
use identification::{Dataset, fit_and_report};
use mirror_model::effect::{Active, find, forms};
use mirror_model::{Device, Model, Preset};
use std::error::Error;
use std::fmt::{self, Write as _};
use std::path::Path;
use std::sync::Arc;
use virtual_mirror::Effect;

/// Standard deviations of an interval that 95 of 100 lie in: of a normal distribution, two-sided.
const INTERVAL: f64 = 1.96;

/// What came of one session.
pub(crate) struct Outcome {
    pub(crate) case: Case,
    pub(crate) found: Diagnosis,
    /// Of a hidden effect, or of the lesser of two: what an effect of nature's own form would score, noise aside. Where that
    /// stays below the threshold, this session cannot show it to anyone who knows no more of the mirror than the families.
    pub(crate) shown: Option<f64>,
    /// Of a hidden effect that was found: its size.
    pub(crate) size: Option<Size>,
    /// The error after adding it, over that of the same mirror with nothing hidden.
    pub(crate) error_ratio: Option<f64>,
    /// Of two hidden effects: whether both were found in two rounds.
    pub(crate) both: Option<bool>,
    /// Of a hidden effect that was found and added: what a second round names.
    pub(crate) second: Option<Vec<String>>,
}

/// The size of an effect, in its first parameter's unit.
pub(crate) struct Size {
    reported: f64,
    standard_error: f64,
    truth: f64,
}

impl Size {
    /// How far it is off, as a share of the true one.
    pub(crate) fn off(&self) -> f64 {
        self.reported / self.truth - 1.0
    }

    /// Whether the true one lies inside the interval that is reported.
    pub(crate) fn is_inside(&self) -> bool {
        (self.reported - self.truth).abs() <= INTERVAL * self.standard_error
    }
}

/// Diagnoses a session as a user would. To learn from it, its verdict and sizes are enough.
pub(crate) fn diagnosed(
    case: &Case,
    to_learn: bool,
    cache: &Path,
) -> Result<Outcome, Box<dyn Error>> {
    let model = case.model();
    let plan = case.session(&case.config())?;
    let found = diagnose(&model, &plan, &[], Some(cache))?;
    let mut outcome = Outcome::new(case, found);
    match case.hidden {
        Hidden::Nothing => {}
        Hidden::One(effect, strength) => {
            let alone = Alone::new(case)?;
            if !to_learn {
                outcome.shown = Some(alone.shown(&plan, &model.device, cache)?);
            }
            if outcome.found.effects.iter().any(|id| id == effect.is_a()) {
                outcome.size = Some(alone.size(outcome.ranked(effect), effect)?);
                if strength == 1.0 && case.instruments == Instruments::With && !to_learn {
                    let added = add(&model, listed(effect), &plan, &[], Some(cache))?;
                    outcome.error_ratio = Some(error_ratio(case, &added)?);
                    let again = diagnose(&added.after, &plan, &[], Some(cache))?;
                    outcome.second = Some(again.effects);
                }
            }
        }
        Hidden::Two(one, other) => {
            let shown =
                |effect| Alone::new(&case.hiding(effect))?.shown(&plan, &model.device, cache);
            outcome.shown = Some(shown(one)?.min(shown(other)?));
            outcome.both = Some(both(&model, &plan, &outcome.found, one, other, cache)?);
        }
    }
    Ok(outcome)
}

/// Whether a session can show what is hidden in it, of two the lesser one.
pub(crate) fn can_show(case: &Case, cache: &Path) -> Result<bool, Box<dyn Error>> {
    let model = case.model();
    let plan = case.session(&case.config())?;
    let alone = case.hidden.effects().into_iter().map(|effect| {
        let case = match case.hidden {
            Hidden::Two(..) => case.hiding(effect),
            _ => *case,
        };
        Alone::new(&case)?.shown(&plan, &model.device, cache)
    });
    let shown = alone.collect::<Result<Vec<f64>, Box<dyn Error>>>()?;
    let outcome = Outcome {
        shown: shown.into_iter().reduce(f64::min),
        ..Outcome::new(case, diagnose(&model, &plan, &[], Some(cache))?)
    };
    Ok(outcome.can_be_found())
}

/// Whether one of two effects is found, and the other after the first was added.
fn both(
    model: &Model,
    plan: &Dataset,
    found: &Diagnosis,
    one: Effect,
    other: Effect,
    cache: &Path,
) -> Result<bool, Box<dyn Error>> {
    let most = Instruments::With.set();
    let holds = |found: &Diagnosis, effect: Effect| {
        found.effects.len() <= most && found.effects.iter().any(|id| id == effect.is_a())
    };
    let (first, second) = match (holds(found, one), holds(found, other)) {
        (true, _) => (one, other),
        (_, true) => (other, one),
        _ => return Ok(false),
    };
    let with = add(model, listed(first), plan, &[], Some(cache))?.after;
    Ok(holds(&diagnose(&with, plan, &[], Some(cache))?, second))
}

fn listed(effect: Effect) -> std::sync::Arc<dyn mirror_model::effect::Effect> {
    find(effect.is_a()).expect("a listed effect is built in")
}

/// The error after the hidden effect was added, over that of the same mirror with nothing hidden, both fitted.
fn error_ratio(case: &Case, added: &Changed) -> Result<f64, Box<dyn Error>> {
    let lacking_nothing = case.session(&case.lacking_nothing())?;
    let (_, of_nothing) = fit_and_report(&case.model(), &lacking_nothing, &[])?;
    Ok(added.edit.after.rms / of_nothing.residual_rms_um.unwrap_or(f64::NAN))
}

/// What the hidden effect alone does to a session: no noise, and no error of the model.
struct Alone {
    /// The session of the same mirror without it.
    without: Dataset,
    fitted: Fitted,
    change: Vec<f64>,
}

impl Alone {
    fn new(case: &Case) -> Result<Self, Box<dyn Error>> {
        let without_noise = |mut config: virtual_mirror::MirrorConfig| {
            config.sensor.position_noise_nm = 0.0;
            config.sensor.current_noise_ua = 0.0;
            config.sensor.current_noise_ratio = 0.0;
            case.session(&config)
        };
        let (with, without) = (
            without_noise(case.config())?,
            without_noise(case.lacking_nothing())?,
        );
        let fitted = fit(&Model::from(Preset::Paper), &without)?;
        let change = with
            .values()
            .into_iter()
            .zip(without.values())
            .map(|(with, without)| with - without)
            .collect();
        Ok(Self {
            without,
            fitted,
            change,
        })
    }

    /// What it leaves where the base is fitted anew and the discrepancy is free, in a session with the noise of `plan` of a mirror
    /// of which this much is known.
    fn shown(&self, plan: &Dataset, device: &Device, cache: &Path) -> Result<f64, Box<dyn Error>> {
        let values = self.values()?;
        let near = fit_parameters(
            &self.fitted.model,
            &self.without,
            &values,
            &self.fitted.free,
        )?;
        let from_all_starts = fit(
            &Model::from(Preset::Paper),
            &self.without.with_values(&values),
        )?;
        let ensemble = NullEnsemble::new(plan, device, Some(cache))?;
        let white = white_noise(plan);
        let discrepancy = Arc::new(ensemble.discrepancy(&white));
        let left = |refitted: &Fitted| -> Result<f64, Box<dyn Error>> {
            let slopes = jacobian(&refitted.model, plan, &refitted.free)?;
            let space = ResidualSpace::<Session>::of_all(&slopes, &discrepancy);
            Ok(space.vector(&refitted.standardised(plan)).norm_squared())
        };
        Ok(left(&near)?.min(left(&from_all_starts)?))
    }

    /// What a mirror would show that is the model but for the effect.
    fn values(&self) -> Result<Vec<f64>, Box<dyn Error>> {
        Ok(predict(&self.fitted.model, &self.without)?
            .into_iter()
            .zip(&self.change)
            .map(|(value, change)| value + change)
            .collect())
    }

    /// The size that was found, and the true one in the candidate's terms, whose form is not nature's: the strength that
    /// fits.
    fn size(&self, found: &Ranked, effect: Effect) -> Result<Size, Box<dyn Error>> {
        let plan = &self.without;
        let mut model = self.fitted.model.clone();
        let mut forms = forms(&listed(effect));
        if let Some(found) = &found.form {
            forms.retain(|form| form.form() == found.name);
        }
        let mut active = Active::usual(forms.swap_remove(0));
        let parameters = active.effect.info().parameters.clone();
        for (value, parameter) in active.values.iter_mut().zip(parameters.iter()) {
            *value = found.parameters[parameter.symbol.as_ref()].value;
        }
        model.effects.push(active);
        let fitted = fit_parameters(
            &model,
            plan,
            &self.values()?,
            &free_parameters(&model, plan),
        )?
        .model;
        let reported = &found.parameters[parameters[0].symbol.as_ref()];
        Ok(Size {
            reported: reported.value,
            standard_error: reported.standard_error.unwrap_or(0.0),
            truth: fitted.effects[0].values[0],
        })
    }
}

impl Outcome {
    /// What was found, before anything else is known of it.
    fn new(case: &Case, found: Diagnosis) -> Self {
        Self {
            case: *case,
            found,
            shown: None,
            size: None,
            error_ratio: None,
            both: None,
            second: None,
        }
    }

    fn ranked(&self, effect: Effect) -> &Ranked {
        let place = self
            .found
            .ranking
            .iter()
            .find(|ranked| ranked.effect == effect.is_a());
        place.expect("a named effect is ranked")
    }

    /// Whether the hidden effect is named, or in a set of at most so many.
    pub(crate) fn is_found(&self, most: usize) -> bool {
        let Hidden::One(effect, _) = self.case.hidden else {
            return false;
        };
        self.found.effects.len() <= most && self.found.effects.iter().any(|id| id == effect.is_a())
    }

    /// Whether an effect scores so many times its threshold.
    pub(crate) fn is_clear(&self, effect: &str, times: f64) -> bool {
        let mut ranking = self.found.ranking.iter();
        ranking.any(|r| r.effect == effect && r.score > times * r.threshold)
    }

    /// Whether a hidden effect is one that this session can show: of two, the lesser one above both thresholds.
    pub(crate) fn can_be_found(&self) -> bool {
        let hidden = self.case.hidden.effects();
        let ranking = self.found.ranking.iter();
        let own = ranking.filter(|ranked| hidden.iter().any(|e| e.is_a() == ranked.effect));
        let threshold = own.map(|ranked| ranked.threshold).reduce(f64::max);
        self.shown > Some(threshold.unwrap_or(f64::INFINITY))
    }

    /// Whether an effect is named that is not there.
    pub(crate) fn names_a_wrong_one(&self) -> bool {
        self.found.verdict == Verdict::Named && !self.holds_a_truth()
    }

    /// Whether one of the effects named or suspected is there.
    pub(crate) fn holds_a_truth(&self) -> bool {
        let hidden = self.case.hidden.effects();
        hidden
            .iter()
            .any(|effect| self.found.effects.iter().any(|id| id == effect.is_a()))
    }

    /// The best candidates with their sizes.
    pub(crate) fn rivals(&self) -> String {
        self.found
            .ranking
            .iter()
            .take(4)
            .fold(String::new(), |mut text, ranked| {
                let _ = writeln!(text, "    {ranked}");
                text
            })
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { case, found, .. } = self;
        write!(f, "{case}: {:?} {}", found.verdict, found.effects.join(" "))?;
        if let Some(left) = &found.remainder {
            let part = if left.is_the_lesser_part {
                "mostly"
            } else {
                "in part"
            };
            write!(f, " {part}")?;
        }
        if let Some(best) = found.ranking.first() {
            write!(
                f,
                " (misfit {:.2}, best {} {:.0}/{:.0})",
                found.misfit, best.effect, best.score, best.threshold
            )?;
        }
        if let Some(shown) = self.shown {
            write!(f, ", {shown:.0} shown")?;
        }
        if let Some(size) = &self.size {
            let Size {
                reported,
                standard_error,
                truth,
            } = size;
            write!(
                f,
                ", size {reported:.3e} +- {standard_error:.1e}, true {truth:.3e}"
            )?;
        }
        if let Some(ratio) = self.error_ratio {
            write!(f, ", error {ratio:.2} times that with nothing hidden")?;
        }
        match self.second.as_deref() {
            Some([]) | None => {}
            Some(second) => write!(f, ", then {} which is not there", second.join(" "))?,
        }
        match self.both {
            Some(true) => write!(f, ", then the other"),
            Some(false) => write!(f, ", not both"),
            None => Ok(()),
        }
    }
}
