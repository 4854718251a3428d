//! What a fact of the mirror would be worth that its model file does not state, and what another measurement: the session is
//! looked at with the null ensemble of a mirror of which it is known, or of a session that goes on with it.

use super::analysis::Analysis;
use crate::apart::apart;
use crate::candidate::Candidate;
use crate::menu::{Offer, offers};
use crate::null_ensemble::NullEnsemble;
use crate::null_ensemble::unknowns::{Unknown, unknowns};
use crate::proposal::SESSION_IS_TO_TELL;
use crate::quantile::below;
use crate::report::{Asked, ExpectedGain, ExpectedGains, Means, Right, Shown};
use crate::residual_space::Session;
use identification::dataset::Dataset;
use identification::fit::{Fitted, fit};
use identification::prediction::predict;
use mirror_model::effect::{Active, Effect};
use mirror_model::{Device, Model, Runaway};
use std::path::Path;
use std::sync::Arc;

/// The part to which the strength falls that shows an effect, where it is said to be shown better.
const HALF: f64 = 0.5;

/// A diagnosis that has been made, and what it was made of.
pub(super) struct Now<'a> {
    pub(super) analysis: &'a Analysis<'a>,
    pub(super) effects: &'a [Arc<dyn Effect>],
    pub(super) candidates: &'a [Candidate],
    /// The effects that the session suspects.
    pub(super) named: &'a [String],
    /// As in [`diagnose`](crate::diagnose()).
    pub(super) cache: Option<&'a Path>,
}

impl Now<'_> {
    /// What is asked for. A heater on a bench is no mirror: of what is stated only its leads count, and no usual means tells
    /// those; and of settled readings nobody knows what was driven in between.
    pub(super) fn gains(&self, asked: Asked) -> Result<ExpectedGains, Runaway> {
        let data = self.analysis.data;
        let facts = asked.facts.then(|| match data.is_of_heaters() {
            true => Ok(Vec::new()),
            false => self.of_facts(),
        });
        let measurements =
            asked
                .measurements
                .then(|| match data.is_of_heaters() || data.is_steady {
                    true => Ok(Vec::new()),
                    false => self.of_measurements(),
                });
        Ok(ExpectedGains {
            facts: facts.transpose()?,
            measurements: measurements.transpose()?,
        })
    }

    /// What is gained by everything that could still be stated of the mirror, the most first.
    fn of_facts(&self) -> Result<Vec<ExpectedGain>, Runaway> {
        let unknowns = unknowns(&self.analysis.fitted.model.device).into_iter();
        let gain = |unknown: Unknown| {
            let means = Means::Fact(unknown.key.to_owned());
            self.gain(means, unknown.what, self.analysis.data, &unknown.device)
        };
        unknowns.map(gain).collect::<Result<_, _>>().map(sorted)
    }

    /// What is gained by every measurement that the board and its bench can make after this session, the most first.
    fn of_measurements(&self) -> Result<Vec<ExpectedGain>, Runaway> {
        let model = &self.analysis.fitted.model;
        let gain = |offer: Offer| {
            let longer = foretold(model, offer.after(self.analysis.data))?;
            let is_untold = self.analysis.data.first_ambient_c.is_none();
            let what = match offer.proposal.ambient_c {
                Some(_) if is_untold => format!("{} ({SESSION_IS_TO_TELL})", offer.what),
                _ => offer.what.to_owned(),
            };
            let means = Means::Measurement(offer.proposal);
            self.gain(means, what, &longer, &model.device)
        };
        let offers = offers(self.analysis.data).into_iter();
        offers.map(gain).collect::<Result<_, _>>().map(sorted)
    }

    /// What is gained where this is the session, and this is known of the mirror.
    fn gain(
        &self,
        means: Means,
        what: String,
        data: &Dataset,
        device: &Device,
    ) -> Result<ExpectedGain, Runaway> {
        let ensemble = NullEnsemble::new(data, device, self.cache)?;
        let fitted = fit(&self.analysis.fitted.model, data)?;
        let (known, then) = Analysis::new(data, fitted, &ensemble, self.effects)?;
        let apart = |analysis| least_difference(analysis, &self.suspects());
        let (now, after) = (apart(self.analysis), apart(&known));
        let both = now.as_ref().zip(after.as_ref());
        let tells_apart =
            both.map(|(now, then)| then.deviations / now.deviations.max(f64::MIN_POSITIVE));
        let right = match both {
            Some((now, after)) => Right {
                between: Some(after.between.clone()),
                now: now.probability_told(),
                then: after.probability_told(),
            },
            None => Right {
                between: None,
                now: probability_shown(self.candidates),
                then: probability_shown(&then),
            },
        };
        Ok(ExpectedGain {
            means,
            what,
            shows: shown(self.candidates, &then),
            tells_apart,
            right,
        })
    }

    /// The suspects as the session sizes them.
    fn suspects(&self) -> Vec<Active> {
        let is_named = |candidate: &&Candidate| self.named.iter().any(|id| id == candidate.id());
        let named = self.candidates.iter().filter(is_named);
        named
            .filter_map(|candidate| Some(candidate.explanation.as_ref()?.active.clone()))
            .collect()
    }
}

/// A session that goes on as its model foretells; what was read stays.
fn foretold(model: &Model, (mut data, read): (Dataset, usize)) -> Result<Dataset, Runaway> {
    let predicted = predict(model, &data)?;
    let new = data.observations.iter_mut().zip(predicted).skip(read);
    new.for_each(|(observation, value)| observation.value = value);
    Ok(data)
}

fn sorted(mut gains: Vec<ExpectedGain>) -> Vec<ExpectedGain> {
    gains.sort_by(|a, b| b.rank().total_cmp(&a.rank()));
    gains
}

/// Two effects, and how far their predictions differ as an analysis sees it, in standard deviations.
struct Difference {
    between: [String; 2],
    deviations: f64,
}

impl Difference {
    /// How likely the one that is nature's fits better: readings lie one standard deviation of the normal distribution off along the
    /// difference, and nature's fits better until they are beyond its middle.
    fn probability_told(&self) -> f64 {
        below(0.5 * self.deviations)
    }
}

/// The least difference between two of these effects, whatever base and effects are fitted to.
fn least_difference(analysis: &Analysis<'_>, suspects: &[Active]) -> Option<Difference> {
    let Fitted { model, free, .. } = &analysis.fitted;
    let pairs = suspects.iter().enumerate().flat_map(|(index, one)| {
        let others = suspects[index + 1..].iter();
        others.map(move |other| [one, other])
    });
    let differences = pairs.filter_map(|pair| {
        let around = |slopes: &_| analysis.session.around::<Session>(slopes);
        Some(Difference {
            between: pair.map(|active| active.id().to_owned()),
            deviations: apart(model, analysis.data, free, pair, around).ok()?,
        })
    });
    differences.min_by(|a, b| a.deviations.total_cmp(&b.deviations))
}

/// How likely a session is to show an effect of usual size, in the mean over these.
fn probability_shown(candidates: &[Candidate]) -> f64 {
    let sum: f64 = candidates.iter().map(Candidate::probability_shown).sum();
    sum / candidates.len().max(1) as f64
}

/// Effects that are not seen at their usual strength now, and then are, or at [`HALF`] of the strength that it takes now.
fn shown(now: &[Candidate], then: &[Candidate]) -> Vec<Shown> {
    let shown = now.iter().filter_map(|now| {
        let then = then.iter().find(|then| then.id() == now.id())?;
        let strength = &now.effect.info().parameters[0];
        let usual = strength.start.abs();
        let (was, limit) = (now.detection_limit(), then.detection_limit()?);
        let before = was.unwrap_or(f64::INFINITY);
        let is_shown = before > usual && limit <= usual.max(HALF * before);
        is_shown.then(|| Shown {
            effect: now.id().to_owned(),
            symbol: strength.symbol.to_string(),
            unit: strength.unit.to_string(),
            now: was,
            then: limit,
        })
    });
    shown.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::candidate::{Direction, scored};
    use crate::residual_space::{ModelDiscrepancy, ResidualSpace, Session};
    use nalgebra::{DMatrix, DVector};

    /// The one-sided 95 % quantile of a normal distribution.
    const QUANTILE: f64 = 1.644_854;

    /// Softening that at its usual strength changes the only reading by so many standard deviations; it must score 25.
    fn showing(deviations: f64) -> Candidate {
        let none = DMatrix::zeros(1, 0);
        let discrepancy = Arc::new(ModelDiscrepancy::new(&none, &DVector::repeat(1, 1.0)));
        let space: ResidualSpace<Session> = ResidualSpace::of_all(&none, &discrepancy);
        let candidate = scored("softening", 0.0);
        let direction = Direction {
            active: Active::usual(candidate.effect.clone()),
            change: space.vector(&DVector::repeat(1, deviations)),
        };
        Candidate {
            directions: vec![direction],
            threshold: 25.0,
            ..candidate
        }
    }

    #[test]
    fn the_nearer_two_effects_are_the_less_surely_the_right_one_fits_better() {
        let told = |deviations| {
            let difference = Difference {
                between: ["creep".into(), "hysteresis".into()],
                deviations,
            };
            difference.probability_told()
        };
        assert_eq!(told(0.0), 0.5);
        // The quantile's digits.
        assert!((told(2.0 * QUANTILE) - 0.95).abs() < 1e-6);
    }

    #[test]
    fn an_effect_as_large_as_its_threshold_is_shown_in_half_of_all_cases() {
        let effects = [showing(5.0), showing(5.0 + QUANTILE)];
        // The quantile's digits.
        assert!((probability_shown(&effects[..1]) - 0.5).abs() < 1e-6);
        assert!((probability_shown(&effects) - 0.5 * (0.5 + 0.95)).abs() < 1e-6);
        assert_eq!(probability_shown(&[]), 0.0);
    }

    #[test]
    fn what_is_seen_at_its_usual_strength_then_and_not_now_is_shown() {
        let usual = showing(1.0).effect.info().parameters[0].start.abs();
        let gained = |now, then| shown(&[showing(now)], &[showing(then)]);
        let [gain] = &gained(6.0, 7.0)[..] else {
            panic!("it is shown");
        };
        assert_eq!(gain.effect, "softening");
        // An amplitude of 5 and its margin of 1.64, at 7 for the usual strength.
        assert!(
            (gain.then / usual - 6.64 / 7.0).abs() < 1e-9,
            "{}",
            gain.then
        );
        assert!(gained(7.0, 9.0).is_empty(), "it is seen now, too");
        assert!(gained(5.0, 6.0).is_empty(), "it is not seen then either");
        assert_eq!(gained(3.0, 6.5).len(), 1, "half of what it takes now");
    }
}
