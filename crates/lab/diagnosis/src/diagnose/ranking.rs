//! Every effect's place: its score, its size, what it is worth on rows held out and where nothing is missing.

use super::analysis::{Analysis, rms};
use crate::candidate::{Candidate, Explanation};
use crate::confusions::confusions;
use crate::held_out::{HeldOut, held_out_rows, told_on_held_out};
use crate::null_improvement::{NullImprovement, null_improvement};
use crate::report::{BeforeAfter, Form, Ranked, WORTHWHILE};
use crate::residual_space::{Session, Training, Vector};
use identification::{Estimate, Unit};
use nalgebra::DVector;
use std::collections::BTreeMap;

/// Effects whose scores are within this factor of each other are look-alikes, for people: a choice.
const LOOK_ALIKE: f64 = 2.0;

const UNITS: [Unit; 2] = [Unit::Micrometre, Unit::Milliampere];

impl Analysis<'_> {
    /// An effect's place, if it changes a reading. `evident` are the effects above their thresholds and the rivals of the best of them.
    pub(super) fn ranked(
        &self,
        candidate: &Candidate,
        form: Option<Form>,
        evident: &[&Candidate],
    ) -> Option<Ranked> {
        let explanation = candidate.explanation.as_ref()?;
        let widening = self.widening(explanation);
        let is_evident = evident.iter().any(|other| other.id() == candidate.id());
        let scores = evident.iter().map(|other| other.score());
        let look_alikes = look_alikes(candidate, evident);
        Some(Ranked {
            effect: candidate.id().to_owned(),
            form,
            score: explanation.score,
            threshold: candidate.threshold,
            null_scores: candidate.null_scores.clone(),
            weight: if is_evident {
                akaike_weight(explanation.score, scores, widening)
            } else {
                0.0
            },
            detection_limit: candidate.detection_limit(),
            held_out_rms: self.held_out(candidate, explanation, self.unit()),
            error_rms: self.before_and_after(candidate, explanation, self.unit()),
            current_rms: self.currents_before_and_after(candidate, explanation),
            null_improvement: is_evident.then(|| self.null_improvement(candidate)),
            plausible: candidate.is_plausible(),
            parameters: self.estimates(explanation, widening),
            why: self.why(candidate, &look_alikes),
            look_alikes,
        })
    }

    /// Whether there is something to name: a strength that is not zero, an error that it lowers, and none that it doubles. Where much of an error
    /// is the model's discrepancy, what is left beside that on rows held out tells.
    pub(super) fn has_an_effect(&self, candidate: &Candidate) -> bool {
        let Some(explanation) = &candidate.explanation else {
            return false;
        };
        let lowers = |unit| {
            let fall = self.before_and_after(candidate, explanation, unit).fall();
            let told = || told_on_held_out(self.data, unit);
            fall >= WORTHWHILE
                || fall > -WORTHWHILE
                    && self.held_out(candidate, explanation, unit).fall() >= told()
        };
        let doubles = |unit| self.before_and_after(candidate, explanation, unit).fall() <= -1.0;
        explanation.is_told_from_zero(self.widening(explanation))
            && UNITS.into_iter().any(lowers)
            && !UNITS.into_iter().any(doubles)
    }

    /// Whether it lowers an error on rows held out too.
    pub(super) fn is_shown_on_others(&self, candidate: &Candidate) -> bool {
        let Some(explanation) = &candidate.explanation else {
            return false;
        };
        let falls = |unit| self.held_out(candidate, explanation, unit).fall() > 0.0;
        UNITS.into_iter().any(falls)
    }

    /// How many times larger than the median null mirror's the amplitude is that an effect leaves, 1 or more: its standard
    /// errors are as much wider (quasi-likelihood: Burnham and Anderson (2002), section 2.5).
    fn widening(&self, explanation: &Explanation<Session>) -> f64 {
        let left = (self.misfit - explanation.score).max(0.0);
        (left / self.null.median()).sqrt().max(1.0)
    }

    /// The values that fit best. The strength's standard error holds what the form may be off by, too.
    fn estimates(
        &self,
        explanation: &Explanation<Session>,
        widening: f64,
    ) -> BTreeMap<String, Estimate> {
        let info = explanation.active.effect.info();
        let form = confusions().form(self.channels(), &info.id);
        let values = info.parameters.iter().zip(&explanation.active.values);
        let estimates = values.enumerate().map(|(index, (parameter, &value))| {
            let of_form = form * value.abs();
            let error = of_form.hypot(explanation.strength_error(widening));
            let estimate = Estimate {
                value,
                standard_error: (index == 0).then_some(error),
                unit: parameter.unit.to_string(),
            };
            (parameter.symbol.to_string(), estimate)
        });
        estimates.collect()
    }

    fn why(&self, candidate: &Candidate, look_alikes: &[String]) -> String {
        let info = candidate.effect.info();
        let score = candidate.score();
        let seen = if score > candidate.threshold {
            let explained = explained(score, self.misfit - self.null.median());
            format!("{explained}; {}", info.shows)
        } else if candidate.is_plausible() {
            "mirrors that lack nothing look as much like it".to_owned()
        } else {
            "what is left looks no more like it at any plausible strength".to_owned()
        };
        match look_alikes {
            [] => seen,
            alike => format!(
                "{seen}; nearly as well as {}, told apart by: {}",
                alike.join(", "),
                info.separates
            ),
        }
    }

    /// Errors on the rows held out, without the effect and with it. Where base and effect were fitted together, from such fits to
    /// the other rows; else as far as slopes tell, with the discrepancy free.
    pub(super) fn held_out(
        &self,
        candidate: &Candidate,
        explanation: &Explanation<Session>,
        unit: Unit,
    ) -> BeforeAfter {
        let fitted = candidate.refit.as_ref().and_then(|refit| {
            let [before, after] = [
                (&self.held_out, &self.fitted),
                (&refit.held_out, &refit.fitted),
            ]
            .map(|(known, fitted)| *known.get_or_init(|| HeldOut::of(fitted, self.data)));
            Some(BeforeAfter {
                before: before?.rms(unit),
                after: after?.rms(unit),
                unit,
            })
        });
        fitted.unwrap_or_else(|| self.held_out_by_slopes(explanation, unit))
    }

    /// Strength, base and discrepancy from the rows that are kept; the errors on the rows held out.
    fn held_out_by_slopes(&self, explanation: &Explanation<Session>, unit: Unit) -> BeforeAfter {
        let [residual, change] = [&self.residual, &explanation.change]
            .map(|vector| self.training.vector(&self.session.standardised(vector)));
        let weight = change.norm_squared();
        let times = if weight > 0.0 {
            change.dot(&residual) / weight
        } else {
            0.0
        };
        let left_on_them = |residual: &Vector<Training>| {
            let left = self.training.remainder(residual);
            let rows = left.iter().copied().zip(&self.data.observations);
            let held_out = rows
                .zip(held_out_rows(self.data))
                .filter_map(|(row, is_held_out)| is_held_out.then_some(row));
            rms(held_out, unit).value
        };
        BeforeAfter {
            before: left_on_them(&residual),
            after: left_on_them(&(&residual - &(&change * times))),
            unit,
        }
    }

    /// Errors of the currents without an effect, and with it and everything fitted together, where displacement and currents were measured.
    pub(super) fn currents_before_and_after(
        &self,
        candidate: &Candidate,
        explanation: &Explanation<Session>,
    ) -> Option<BeforeAfter> {
        (self.data.has_displacement() && self.data.has_current())
            .then(|| self.before_and_after(candidate, explanation, Unit::Milliampere))
    }

    /// Errors without an effect, and with it and all parameters fitted together; where that was not worth a fit, as far as
    /// slopes tell, with up to the size that fits best beyond the discrepancy.
    pub(super) fn before_and_after(
        &self,
        candidate: &Candidate,
        explanation: &Explanation<Session>,
        unit: Unit,
    ) -> BeforeAfter {
        let before = self.fitted.standardised(self.data);
        let after = match candidate.together() {
            Some(refit) => refit.fitted.standardised(self.data),
            None => {
                let left = |residual: &DVector<f64>| {
                    self.base_only.remainder(&self.base_only.vector(residual))
                };
                let residual = left(&before);
                let change = left(&self.session.standardised(&explanation.change));
                let times = change.dot(&residual) / change.norm_squared().max(f64::MIN_POSITIVE);
                residual - change * times.clamp(0.0, 1.0)
            }
        };
        BeforeAfter {
            before: self.rms(&before, unit).value,
            after: self.rms(&after, unit).value,
            unit,
        }
    }

    pub(super) fn null_improvement(&self, candidate: &Candidate) -> NullImprovement {
        let directions = candidate.directions.iter();
        let directions: Vec<_> = directions
            .map(|direction| direction.weighed_by(&self.session, &self.base_only))
            .collect();
        let residuals = self.ensemble.residuals();
        null_improvement(&directions, residuals, &self.base_only, self.data)
    }
}

/// How much of what is left `beyond` the median mirror that lacks nothing a score explains.
fn explained(score: f64, beyond: f64) -> String {
    if beyond <= 0.0 {
        return "it explains more than in mirrors that lack nothing, which leave as much"
            .to_owned();
    }
    let percent = 100.0 * (score / beyond).clamp(0.0, 1.0);
    format!("it explains {percent:.0} % of what mirrors that lack nothing would not show")
}

/// The Akaike weight of a score among others (Burnham and Anderson (2002), section 2.9), which include it. Differences count
/// in units of the widening.
fn akaike_weight(score: f64, scores: impl Iterator<Item = f64>, widening: f64) -> f64 {
    let likelihood = |other: f64| (0.5 * (other - score) / widening).exp();
    1.0 / scores.map(likelihood).sum::<f64>()
}

/// The other effects that explain about as much.
fn look_alikes(candidate: &Candidate, evident: &[&Candidate]) -> Vec<String> {
    let score = candidate.score();
    let is_alike = |other: &&&Candidate| {
        other.id() != candidate.id()
            && other.score() > score / LOOK_ALIKE
            && other.score() < score * LOOK_ALIKE
    };
    let alike = evident.iter().filter(is_alike);
    alike.map(|other| other.id().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::candidate::scored;

    #[test]
    fn weights_are_akaikes() {
        let scores = [30.0, 28.0, 20.0];
        let weight = |score| akaike_weight(score, scores.into_iter(), 1.0);
        let sum = 1.0 + (-1.0_f64).exp() + (-5.0_f64).exp();
        assert!((weight(30.0) - 1.0 / sum).abs() < 1e-12);
        assert!((weight(28.0) - (-1.0_f64).exp() / sum).abs() < 1e-12);
        let all: f64 = scores.into_iter().map(weight).sum();
        assert!((all - 1.0).abs() < 1e-12);
        // Where much is left unexplained, differences tell less.
        assert!(akaike_weight(30.0, scores.into_iter(), 4.0) < weight(30.0));
    }

    #[test]
    fn an_effect_is_no_share_of_nothing() {
        let whole = "it explains 50 % of what mirrors that lack nothing would not show";
        assert_eq!(explained(100.0, 200.0), whole);
        assert!(explained(100.0, 50.0).contains(" 100 % "));
        assert!(!explained(100.0, -50.0).contains('%'));
    }

    #[test]
    fn look_alikes_are_within_a_factor_of_two() {
        let all = [
            scored("creep", 100.0),
            scored("hysteresis", 51.0),
            scored("resonance", 49.0),
        ];
        let above: Vec<_> = all.iter().collect();
        assert_eq!(look_alikes(&all[0], &above), ["hysteresis"]);
        assert_eq!(look_alikes(&all[1], &above), ["creep", "resonance"]);
    }
}
