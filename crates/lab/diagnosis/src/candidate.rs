//! Effects as candidates: what each changes in the base's predictions, and how much of a misfit that explains.
//!
//! A candidate is scanned (its strength is linear, its form is tried at several starts), refined (all its parameters, the
//! base linear) and refitted (base and effect together, nothing linear), each step for those only that the one before found
//! worth it.

mod direction;
mod explanation;
mod refine;
mod refit;
mod scan;

pub(crate) use direction::{Direction, Operating, from_all_starts};
pub(crate) use explanation::{Explanation, PRICE};
pub(crate) use refine::refine;
pub(crate) use refit::{Found, Refit, Strength, refit};
use scan::LEAST_WEIGHT;
pub(crate) use scan::Scan;

use crate::null_distribution::MARGIN;
use crate::quantile::{below, quantile, sorted};
use crate::residual_space::{Kind, OtherFamilies, ResidualSpace, Session, Vector};
use mirror_model::effect::{Active, Effect};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A change of the readings whose square is below this is none: rounding.
const UNSEEN: f64 = 1e-6;
/// A strength nearer to an end of its range than this part of the range is at the end; nearer to 0 than this part of its usual
/// size, at none.
const AT_THE_END: f64 = 1e-3;

/// An effect, and what became of it.
pub(crate) struct Candidate {
    pub(crate) effect: Arc<dyn Effect>,
    /// What it would change, one a start of each of its forms.
    pub(crate) directions: Vec<Direction<Session>>,
    /// The score that the null ensemble stays below.
    pub(crate) threshold: f64,
    /// Its scores in the mirrors of the null ensemble.
    pub(crate) null_scores: Vec<f64>,
    /// How it explains the session's residual best, where it changes any reading.
    pub(crate) explanation: Option<Explanation<Session>>,
    /// What is left when base and effect are fitted together, where that was done.
    pub(crate) refit: Option<Refit>,
    /// Such a fit where slopes beside the discrepancy explain more: the score is theirs, but what a model with the effect leaves, only this tells.
    pub(crate) lesser_refit: Option<Refit>,
    /// The same in the other ones of its forms, once they were fitted.
    pub(crate) other_forms: Option<Vec<InForm>>,
}

/// An effect in one of its forms, and what is left when it and the base are fitted together, where that explains more.
pub(crate) struct InForm {
    pub(crate) explanation: Explanation<Session>,
    pub(crate) refit: Option<Refit>,
    pub(crate) lesser_refit: Option<Refit>,
}

impl Candidate {
    /// An effect that nothing is known of but what it would change.
    pub(crate) fn new(effect: Arc<dyn Effect>, directions: Vec<Direction<Session>>) -> Self {
        Self {
            effect,
            directions,
            threshold: f64::INFINITY,
            null_scores: Vec::new(),
            explanation: None,
            refit: None,
            lesser_refit: None,
            other_forms: None,
        }
    }

    pub(crate) fn id(&self) -> &str {
        &self.effect.info().id
    }

    /// Takes one of its forms.
    pub(crate) fn take(&mut self, form: InForm) {
        let InForm {
            explanation,
            refit,
            lesser_refit,
        } = form;
        self.explanation = Some(explanation);
        self.refit = refit;
        self.lesser_refit = lesser_refit;
    }

    /// Base and effect fitted together, be it that slopes explain more.
    pub(crate) fn together(&self) -> Option<&Refit> {
        self.refit.as_ref().or(self.lesser_refit.as_ref())
    }

    /// Takes a fit that explains more than anything so far.
    pub(crate) fn take_better(&mut self, explanation: Explanation<Session>, refit: Refit) {
        self.explanation = Some(explanation);
        self.refit = Some(refit);
        self.lesser_refit = None;
    }

    /// Keeps a fit that explains less than slopes do, if it is the one of least `cost` of them.
    pub(crate) fn keep_lesser(&mut self, refit: Refit, cost: impl Fn(&Refit) -> f64) {
        let so_far = self.lesser_refit.as_ref().map_or(f64::INFINITY, &cost);
        if self.refit.is_none() && cost(&refit) < so_far {
            self.lesser_refit = Some(refit);
        }
    }

    /// Its score, 0 where it explains nothing.
    pub(crate) fn score(&self) -> f64 {
        self.explanation.as_ref().map_or(0.0, |e| e.score)
    }

    /// Whether its strength lies inside its plausible range, and at no end of it.
    pub(crate) fn is_plausible(&self) -> bool {
        self.explanation
            .as_ref()
            .is_some_and(|e| is_plausible(&e.active))
    }

    /// Whether the null ensemble would not show as much, at a strength that is plausible.
    pub(crate) fn is_above_its_threshold(&self) -> bool {
        self.score() > self.threshold && self.is_plausible()
    }

    /// Whether the model runs away with it, whatever its form.
    pub(crate) fn is_infeasible(&self) -> bool {
        self.directions.is_empty()
    }

    /// Whether it changes any reading at all, be it in a way that base parameters can take up.
    pub(crate) fn shows(&self) -> bool {
        self.directions.iter().any(|d| d.change.size() > UNSEEN)
    }

    /// The largest misfit that the first of its forms makes at its usual strength.
    pub(crate) fn strongest(&self) -> f64 {
        let sizes = self
            .directions_of(self.effect.form())
            .map(|d| d.change.norm_squared());
        sizes.fold(0.0, f64::max)
    }

    /// What it would change in one of its forms.
    pub(crate) fn directions_of(&self, form: &str) -> impl Iterator<Item = &Direction<Session>> {
        let of_form = move |d: &&Direction<Session>| d.active.effect.form() == form;
        self.directions.iter().filter(of_form)
    }

    /// The strength above which it would be seen in 95 of 100 cases, in its unit, at half of the time constants, frequencies and places that it
    /// may have; in the form that shows least, of those that count in this unit. `None` where no plausible one is.
    pub(crate) fn detection_limit(&self) -> Option<f64> {
        let strength = &self.effect.info().parameters[0];
        let amplitude = self.threshold.max(0.0).sqrt() + MARGIN;
        let mut of_forms: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for direction in &self.directions {
            let Active { effect, values, .. } = &direction.active;
            if effect.info().parameters[0].unit == strength.unit {
                let weight = direction.change.norm_squared().max(0.0);
                let limit = if weight > LEAST_WEIGHT {
                    amplitude / weight.sqrt() * values[0].abs()
                } else {
                    f64::MAX
                };
                of_forms.entry(effect.form()).or_default().push(limit);
            }
        }
        let medians = of_forms
            .into_values()
            .map(|limits| quantile(&sorted(limits), 0.5));
        let limit = medians.reduce(f64::max)?;
        (limit <= strength.high.max(-strength.low)).then_some(limit)
    }

    /// How likely a session is to show it at its usual strength: its amplitude there is off by one standard deviation of the
    /// normal distribution, and is to exceed that of the threshold.
    pub(crate) fn probability_shown(&self) -> f64 {
        let amplitude = self.strongest().max(0.0).sqrt();
        below(amplitude - self.threshold.max(0.0).sqrt())
    }

    /// How well it explains a residual of a space with the session's covariance.
    pub(crate) fn scanned<L>(
        &self,
        residual: &Vector<L>,
        space: &ResidualSpace<L>,
    ) -> Option<Explanation<L>>
    where
        L: Kind<Rows = <Session as Kind>::Rows>,
    {
        let directions: Vec<_> = self.directions.iter().map(|d| d.seen_in(space)).collect();
        Scan::new(&directions).explanation(residual)
    }

    /// Its scores for residuals of mirrors of a family that spans none of the discrepancy.
    pub(crate) fn scores(
        &self,
        residuals: &[Vector<OtherFamilies>],
        space: &ResidualSpace<OtherFamilies>,
    ) -> Vec<f64> {
        let directions: Vec<_> = self.directions.iter().map(|d| d.seen_in(space)).collect();
        let scan = Scan::new(&directions);
        residuals
            .iter()
            .map(|residual| scan.score(residual))
            .collect()
    }
}

/// Whether a strength lies inside its plausible range, and at no end of it.
pub(crate) fn is_plausible(active: &Active) -> bool {
    let (p, value) = (&active.effect.info().parameters[0], active.values[0]);
    let margin = AT_THE_END * (p.high - p.low);
    let is_some = value.abs() > AT_THE_END * p.start.abs();
    let is_below = p.high == 0.0 || value < p.high - margin;
    is_some && is_below && (p.low == 0.0 || value > p.low + margin)
}

#[cfg(test)]
mod tests;
#[cfg(test)]
pub(crate) use tests::scored;
