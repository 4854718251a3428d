//! What an effect changes in the base's predictions, at chosen values of its form.

use crate::residual_space::{Kind, ResidualSpace, Vector};
use identification::dataset::Dataset;
use identification::prediction::{predict, standardised};
use mirror_model::effect::{Active, Effect, Moment, Parameter, Timing, constant};
use mirror_model::{Model, Runaway};
use nalgebra::DVector;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Starts of the first parameter of an effect's form, between its bounds. Further parameters start at their usual values.
/// Set by the figures of `cargo xtask bench diagnose`.
const STARTS: usize = 8;
/// Starts of a frequency, denser: what rings is only found from within its line. From 60 Hz to 2.5 kHz they are 8 % apart.
const STARTS_OF_A_FREQUENCY: usize = 48;
/// Starts of a length, denser too: what a stop holds back from one height on is found from near it.
const STARTS_OF_A_LENGTH: usize = 24;
/// Starts of a moment, evenly over the session.
const STARTS_OF_AN_ONSET: usize = 32;
/// Starts of a period: half a cycle of the whole session apart, as far as its lines are from each other, and so many at most,
/// from the longest on.
const STARTS_OF_A_PERIOD: usize = 48;

/// Where effects are tried: a fitted model, and what it predicts.
#[derive(Clone, Copy)]
pub(crate) struct Operating<'a> {
    pub(crate) model: &'a Model,
    pub(crate) data: &'a Dataset,
    /// Predictions of the base (um, A).
    pub(crate) base: &'a [f64],
}

/// An effect at chosen values of its form, with the change that its usual strength makes.
#[derive(Clone)]
pub(crate) struct Direction<K: Kind> {
    /// The effect at its usual strength.
    pub(crate) active: Active,
    /// Predictions with it less those without.
    pub(crate) change: Vector<K>,
}

impl<K: Kind> Direction<K> {
    /// The same direction in another space with the same covariance.
    pub(crate) fn seen_in<L: Kind<Rows = K::Rows>>(
        &self,
        space: &ResidualSpace<L>,
    ) -> Direction<L> {
        Direction {
            change: space.import(&self.change),
            active: self.active.clone(),
        }
    }

    /// The same direction in a space that weighs rows in its own way.
    pub(crate) fn weighed_by<L: Kind>(
        &self,
        own: &ResidualSpace<K>,
        other: &ResidualSpace<L>,
    ) -> Direction<L> {
        Direction {
            change: other.vector(&own.standardised(&self.change)),
            active: self.active.clone(),
        }
    }
}

impl Operating<'_> {
    /// The directions of an effect, one a start of its form.
    pub(crate) fn directions<K: Kind>(
        &self,
        effect: &Arc<dyn Effect>,
        space: &ResidualSpace<K>,
    ) -> Vec<Direction<K>>
    where
        Direction<K>: Send,
        ResidualSpace<K>: Sync,
    {
        let slow = self.slow(effect);
        let starts = from_all_starts(effect, Some(self.data.lasts_s()));
        parallel::filter_map(starts, |active| {
            let change = match &slow {
                Some(slow) => slow.change(&active),
                None => self.change(&active).ok()?,
            };
            let change = space.vector(&change);
            Some(Direction { active, change })
        })
    }

    /// How readings follow an effect that follows the clock alone. `None` of other effects, and where displacements are compared about a mean.
    pub(super) fn slow(&self, effect: &Arc<dyn Effect>) -> Option<Slow> {
        if !effect.is_course() || !self.data.own_zeros.is_empty() {
            return None;
        }
        let ends_s: Vec<f64> = self.data.ends_s().collect();
        let read = self.data.observations.iter();
        let of_a_constant = self.change(&Active::usual(constant(effect.info().acts)));
        Some(Slow {
            of_a_constant: of_a_constant.ok()?,
            read_s: read.map(|o| ends_s[o.interval]).collect(),
        })
    }

    /// What an effect adds to the base's predictions, standardised.
    pub(crate) fn change(&self, active: &Active) -> Result<DVector<f64>, Runaway> {
        let mut with = self.model.clone();
        with.effects.push(active.clone());
        let predicted = predict(&with, self.data)?;
        let added = predicted
            .iter()
            .zip(self.base)
            .map(|(with, without)| with - without);
        Ok(standardised(added, self.data))
    }
}

/// What follows the clock is slow beside the mirror, so each reading changes by what the course is then.
pub(super) struct Slow {
    /// What a constant in the place of the effect changes, standardised.
    of_a_constant: DVector<f64>,
    /// When each reading is made (s).
    read_s: Vec<f64>,
}

impl Slow {
    /// What an effect adds to the base's predictions, standardised.
    pub(super) fn change(&self, active: &Active) -> DVector<f64> {
        let course = self.read_s.iter().map(|&t_s| {
            let moment = Moment {
                t_s,
                ..Moment::default()
            };
            active.effect.output(&active.values, 0.0, &[], &moment)
        });
        DVector::from_iterator(self.read_s.len(), course).component_mul(&self.of_a_constant)
    }
}

/// The usual strength with every combination of starts of the other parameters. Of what a session's time has all that a session of
/// `lasts_s` tells from each other; `None`: as many as of any other parameter.
pub(crate) fn from_all_starts(effect: &Arc<dyn Effect>, lasts_s: Option<f64>) -> Vec<Active> {
    let timing = effect.timing().zip(lasts_s);
    let parameters = effect.info().parameters.clone();
    let mut forms = vec![Active::usual(effect.clone())];
    for (index, parameter) in parameters.iter().enumerate().skip(1) {
        let starts = match (index, timing) {
            (1, Some((Timing::Period, lasts_s))) => periods(parameter, lasts_s),
            (2, Some((Timing::Period, _))) => vec![0.0, FRAC_PI_2],
            (1, Some((Timing::Onset, lasts_s))) => onsets(parameter, lasts_s),
            _ => starts(index, parameter),
        };
        forms = forms
            .iter()
            .flat_map(|form| {
                starts.iter().map(|&value| {
                    let mut form = form.clone();
                    form.values[index] = value;
                    form
                })
            })
            .collect();
    }
    if effect.definition().is_some() {
        forms.push(Active::usual(effect.clone()));
    }
    forms
}

/// Moments over a session, within the bounds.
fn onsets(parameter: &Parameter, lasts_s: f64) -> Vec<f64> {
    let spread = |step: usize| lasts_s * (step as f64 + 0.5) / STARTS_OF_AN_ONSET as f64;
    let within = |t_s: f64| t_s.clamp(parameter.low, parameter.high);
    (0..STARTS_OF_AN_ONSET).map(spread).map(within).collect()
}

/// The periods that a session tells from each other, within the bounds.
fn periods(parameter: &Parameter, lasts_s: f64) -> Vec<f64> {
    let of_half_cycles = (1..=STARTS_OF_A_PERIOD).map(|halves| 2.0 * lasts_s / halves as f64);
    let periods = of_half_cycles.map(|period| period.min(parameter.high));
    let mut periods: Vec<f64> = periods
        .take_while(|period| *period >= parameter.low)
        .collect();
    periods.dedup();
    if periods.is_empty() {
        periods.push(parameter.low);
    }
    periods
}

/// Evenly spread between the bounds; in ratios where these are positive.
fn starts(index: usize, parameter: &Parameter) -> Vec<f64> {
    let count = match index {
        1 if parameter.unit == "Hz" => STARTS_OF_A_FREQUENCY,
        1 if parameter.unit == "um" => STARTS_OF_A_LENGTH,
        1 => STARTS,
        _ => return vec![parameter.start],
    };
    let spread = |step: usize| {
        let share = (step as f64 + 0.5) / count as f64;
        if parameter.low > 0.0 {
            parameter.low * (parameter.high / parameter.low).powf(share)
        } else {
            parameter.low + share * (parameter.high - parameter.low)
        }
    };
    (0..count).map(spread).collect()
}
