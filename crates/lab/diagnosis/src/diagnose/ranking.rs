//! Every effect's place: its score, its size, what it is worth on rows held out and where nothing is hidden.

use super::{Bench, HANDFUL, is_plausible, rms_of};
use crate::candidate::Explanation;
use crate::confusions::{Channels, confusions};
use crate::placebo::{Placebo, placebo};
use crate::plan::Plan;
use crate::report::{BeforeAfter, Ranked};
use identification::Estimate;
use nalgebra::DVector;

impl Bench<'_> {
    /// An effect's place in the ranking.
    pub(super) fn ranked<'e>(
        &self,
        index: usize,
        e: &Explanation,
        above: &[usize],
        all: &impl Fn(usize) -> &'e Explanation,
    ) -> Ranked {
        let info = e.active.effect.info();
        let displacement = self.plan.has_displacement();
        let mut widening = (self.space.product(&self.residual, &self.residual) - e.score).max(0.0)
            / self.calm.misfit(0.5);
        widening = widening.sqrt().max(1.0);
        let weight = |score: f64| (0.5 * (score - e.score) / widening).exp();
        let total: f64 = above.iter().map(|&i| weight(all(i).score)).sum();
        let strongest = self.effects[index]
            .1
            .iter()
            .map(|d| self.space.product(&d.change, &d.change))
            .fold(0.0, f64::max);
        let limit = (self.calm.thresholds[index].max(0.0).sqrt() + 1.64) / strongest.sqrt()
            * info.parameters[0].start.abs();
        let form = confusions().form(Channels::of(self.plan), &info.id);
        let parameters = info.parameters.iter().enumerate().map(|(i, p)| {
            let of_form = form * e.active.values[i].abs();
            let standard_error = (i == 0).then_some(of_form.hypot(e.strength_error * widening));
            (
                p.symbol.to_string(),
                Estimate {
                    value: e.active.values[i],
                    standard_error,
                    unit: p.unit.to_string(),
                },
            )
        });
        let look_alikes: Vec<_> = above
            .iter()
            .filter(|&&i| {
                i != index && all(i).score > 0.5 * e.score && all(i).score < 2.0 * e.score
            })
            .map(|&i| self.id(i))
            .collect();
        Ranked {
            effect: self.id(index),
            score: e.score,
            threshold: self.calm.thresholds[index],
            probability: if above.contains(&index) {
                1.0 / total
            } else {
                0.0
            },
            detection_limit: (strongest > 1e-3
                && limit <= info.parameters[0].high.max(-info.parameters[0].low))
            .then_some(limit),
            held_out_rms_um: self.held_out_rms(e),
            error_rms_um: self.before_and_after(e, displacement),
            current_rms_ma: (displacement && self.plan.has_current())
                .then(|| self.before_and_after(e, false)),
            placebo: above.contains(&index).then(|| self.placebo(index)),
            plausible: is_plausible(&e.active),
            parameters: parameters.collect(),
            why: self.why(index, e, &look_alikes),
            look_alikes,
        }
    }

    fn why(&self, index: usize, e: &Explanation, look_alikes: &[String]) -> String {
        let info = e.active.effect.info();
        let misfit = self.space.product(&self.residual, &self.residual);
        let share = 100.0 * (e.score / (misfit - self.calm.misfit(0.5)).max(1.0)).clamp(0.0, 1.0);
        let seen = if e.score > self.calm.thresholds[index] {
            format!(
                "it explains {share:.0} % of what mirrors with nothing hidden would not show; {}",
                info.shows
            )
        } else if is_plausible(&e.active) {
            "mirrors with nothing hidden look as much like it".to_owned()
        } else {
            "what is left looks no more like it at any size that such mirrors can have".to_owned()
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

    /// Strength, base and approximation from the rows that are kept; the error on the rows held out.
    fn held_out_rms(&self, e: &Explanation) -> f64 {
        let (residual, change) = (
            self.space.unscaled(&self.residual),
            self.space.unscaled(&e.change),
        );
        let (r, g) = (self.kept.vector(&residual), self.kept.vector(&change));
        let weight = self.kept.product(&g, &g);
        let times = if weight > 0.0 {
            self.kept.product(&g, &r) / weight
        } else {
            0.0
        };
        let left = self.kept.remainder(&(&r - &(&g * times)));
        let judged = held_out_rows(self.plan);
        let squares = left
            .iter()
            .zip(&self.plan.observations)
            .zip(judged.iter())
            .filter(|(_, held_out)| **held_out);
        let displacement = self.plan.has_displacement();
        rms_of(squares.map(|((value, o), _)| (*value, o)), displacement)
    }

    /// Errors of the displacement (um) or of the currents (mA) without an effect, and with it and all parameters fitted
    /// together; where that was not worth a fit, as far as slopes tell, with up to the size that fits best beyond the
    /// approximation.
    fn before_and_after(&self, e: &Explanation, displacement: bool) -> BeforeAfter {
        let before = self.fitted.scaled(self.plan);
        let after = match &e.refit {
            Some(refit) => refit.fitted.scaled(self.plan),
            None => {
                let left = |v: &DVector<f64>| self.plain.remainder(&self.plain.vector(v));
                let (residual, change) = (left(&before), left(&self.space.unscaled(&e.change)));
                let times = change.dot(&residual) / change.norm_squared().max(f64::MIN_POSITIVE);
                residual - change * times.clamp(0.0, 1.0)
            }
        };
        let size = |left: &DVector<f64>| {
            rms_of(
                left.iter().copied().zip(&self.plan.observations),
                displacement,
            )
        };
        BeforeAfter {
            before: size(&before),
            after: size(&after),
        }
    }

    fn placebo(&self, index: usize) -> Placebo {
        let directions = self.effects[index].1.iter();
        let seen: Vec<_> = directions
            .map(|d| d.weighed_by(&self.space, &self.plain))
            .collect();
        placebo(&seen, &self.mirrors, &self.plain, self.plan)
    }
}

/// Every other handful of readings is held out, so that what is held out lies between what is kept.
pub(super) fn held_out_rows(plan: &Plan) -> DVector<bool> {
    DVector::from_iterator(
        plan.observations.len(),
        plan.observations
            .iter()
            .map(|o| o.interval / HANDFUL % 2 == 1),
    )
}
