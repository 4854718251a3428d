//! Strengths that end at an end of their range since nothing but their form's other parameters tells them: along such a ridge the fit goes
//! as far as it may.

use super::analysis::{Analysis, best_first};
use crate::candidate::{Candidate, Found, Refit, Strength, is_plausible, refit};
use identification::fit::Precision;
use mirror_model::effect::Active;

/// A strength that is held so far inside its range, as a part of it, is at no end.
const INSIDE: f64 = 0.1;
/// It is as good there where that costs less than this of the misfit: two standard deviations of one parameter.
const AS_GOOD: f64 = 4.0;

impl Analysis<'_> {
    /// Has candidates that end at an end of their range a tenth of it inside, where that explains as much.
    pub(super) fn take_inside(&self, candidates: &mut [Candidate]) {
        let at_an_end = candidates.iter_mut();
        let at_an_end = at_an_end.filter(|c| c.score() > c.threshold && !c.is_plausible());
        parallel::map(at_an_end, |candidate| {
            let found = self.held_inside(candidate);
            let least = candidate.score() - AS_GOOD;
            let as_good = found.filter(|(inside, _)| inside.score > least);
            if let Some((inside, refit)) = as_good {
                let change = candidate.explanation.take().map(|so_far| so_far.change);
                if let Some(change) = change {
                    candidate.take_better(inside.explanation(change), refit);
                }
            }
        });
        best_first(candidates);
    }

    /// A candidate fitted together with the base, its strength held inside.
    fn held_inside(&self, candidate: &Candidate) -> Option<(Found, Refit)> {
        let active = inside(&candidate.explanation.as_ref()?.active)?;
        let mut start = candidate.together()?.fitted.model.clone();
        start.effects.pop();
        refit(
            &active,
            Strength::Held,
            &[start],
            self.data,
            &self.session,
            self.misfit,
            Precision::Fine,
        )
    }
}

/// An effect whose strength is at an end of its range that is not zero, inside of it.
fn inside(active: &Active) -> Option<Active> {
    let strength = &active.effect.info().parameters[0];
    let value = active.values[0];
    let middle = 0.5 * (strength.low + strength.high);
    let inwards = INSIDE * (strength.high - strength.low) * (middle - value).signum();
    let mut inside = active.clone();
    inside.values[0] = value + inwards;
    (value.abs() > inwards.abs() && is_plausible(&inside)).then_some(inside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_model::effect::find;

    /// A sensor's nonlinearity, whose strength may be from -0.15 to 0.15, moved inside.
    fn moved(strength: f64) -> Option<f64> {
        let effect = find("sensor-nonlinearity").expect("an effect");
        let mut active = Active::usual(effect);
        active.values[0] = strength;
        inside(&active).map(|active| active.values[0])
    }

    #[test]
    fn a_strength_at_an_end_is_held_a_tenth_of_the_range_inside() {
        assert!((moved(-0.15).expect("an end") + 0.12).abs() < 1e-12);
        assert!((moved(0.15).expect("an end") - 0.12).abs() < 1e-12);
        assert_eq!(moved(0.0), None);
    }
}
