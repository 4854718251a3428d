//! The smallest formula that does what a free-form function does: symbolic regression over an enumerated grammar (J. Koza,
//! "Genetic Programming" (1992), chapter 10, names the task; so few formulas need no evolution).
//!
//! A quantity `x` becomes `x + q u` or `x (1 + q u)`, where `u` is a dimensionless law of one driver or of a state that is driven
//! by it. Dimensions hold by construction. A law is judged by its values at the knots of the place's basis, without a simulation;
//! it costs a price for each parameter and each operator.

mod text;

pub(crate) use text::{effect, id, sentence};

use crate::candidate::PRICE;
use crate::null_distribution::NullDistribution;
use crate::whereabouts::{Basis, Driver, Place, Reach, Searched};
use nalgebra::DVector;

/// Exponents, thresholds and widths from which a law starts, in parts of the driver's range: as close as a fit finds the way
/// between them.
const EXPONENTS: [f64; 4] = [0.5, 1.5, 3.0, 5.0];
const THRESHOLDS: [f64; 7] = [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
const WIDTHS: [f64; 3] = [0.08, 0.16, 0.32];
/// How sharp a step is, in parts of the driver's range: sharper than any session's readings tell.
pub(crate) const STEP: f64 = 0.02;
/// A past that fades faster than this (s) is no state that a formula's integration follows, whose steps are seconds where a
/// drive is held.
const SHORTEST_S: f64 = 0.6;
/// So many of the best formulas are fitted, no more than so many of one place.
const FITTED: usize = 4;
const OF_ONE_PLACE: usize = 2;

/// A law of a driver `d` that reaches `D`, with the values it starts from: thresholds and widths in the driver's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Law {
    /// `d / D`.
    Linear,
    /// `(d / D)^2`.
    Square,
    /// `(d / D)^p`.
    Power { p: f64 },
    /// `(d - a) / D` above `a`, and 0 below.
    Above { a: f64 },
    /// `((d - a) / D)^p` above `a`, and 0 below.
    PowerAbove { a: f64, p: f64 },
    /// From 0 to 1 at `a`, within a narrow range.
    Step { a: f64 },
    /// `exp((d - D) / w)`.
    Exponential { w: f64 },
    /// What fades over `tau` takes the quantity's place.
    Fading { tau_s: f64 },
}

impl Law {
    /// Its parameters beside the strength.
    pub(crate) fn parameters(self) -> usize {
        match self {
            Self::Linear | Self::Square => 0,
            Self::Power { .. }
            | Self::Above { .. }
            | Self::Step { .. }
            | Self::Exponential { .. }
            | Self::Fading { .. } => 1,
            Self::PowerAbove { .. } => 2,
        }
    }

    /// Its operators: powers, thresholds, functions, states.
    pub(crate) fn operators(self) -> usize {
        match self {
            Self::Linear => 0,
            Self::Square
            | Self::Power { .. }
            | Self::Above { .. }
            | Self::Exponential { .. }
            | Self::Fading { .. } => 1,
            Self::PowerAbove { .. } | Self::Step { .. } => 2,
        }
    }

    /// Its value where a driver of a range is at `d`.
    fn at(self, d: f64, range: f64) -> f64 {
        let positive = |d: f64| d.max(0.0) / range;
        match self {
            Self::Linear => d / range,
            Self::Square => (d / range).powi(2),
            Self::Power { p } => positive(d).powf(p),
            Self::Above { a } => positive(d - a),
            Self::PowerAbove { a, p } => positive(d - a).powf(p),
            Self::Step { a } => 1.0 / (1.0 + ((a - d) / (STEP * range)).exp()),
            Self::Exponential { w } => ((d - range) / w).exp(),
            Self::Fading { .. } => 0.0,
        }
    }

    /// Those of a driver of this range.
    fn all(range: f64) -> Vec<Self> {
        let at = THRESHOLDS.map(|part| part * range);
        let mut laws = vec![Self::Linear, Self::Square];
        laws.extend(EXPONENTS.map(|p| Self::Power { p }));
        laws.extend(at.map(|a| Self::Above { a }));
        laws.extend(at.map(|a| Self::PowerAbove { a, p: 2.0 }));
        laws.extend(at.map(|a| Self::Step { a }));
        laws.extend(WIDTHS.map(|part| Self::Exponential { w: part * range }));
        laws
    }
}

/// A formula that may be proposed.
#[derive(Clone, Debug)]
pub(crate) struct Draft {
    pub(crate) place: Place,
    pub(crate) law: Law,
    /// The driver's range.
    pub(crate) range: f64,
    /// Amplitude of the law (in the quantity's unit, or as a part of it) that fits best.
    pub(crate) strength: f64,
    pub(crate) score: f64,
}

/// The best formulas for a session, and the score that the best formula of mirrors that lack nothing stays below in 95 of 100.
pub(crate) fn drafts(
    searched: &[Searched],
    reach: &Reach,
    null: &NullDistribution,
) -> (Vec<Draft>, f64) {
    let tried: Vec<(&Searched, Law, DVector<f64>)> = searched
        .iter()
        .flat_map(|searched| {
            laws(searched, reach)
                .into_iter()
                .map(move |(law, proportions)| (searched, law, proportions))
        })
        .collect();
    let price = |law: Law| PRICE * (1 + law.parameters() + law.operators()) as f64;
    let mirrors = searched.first().map_or(0, |searched| searched.null.len());
    let largest = |mirror: usize| {
        let scores = tried.iter().map(|(searched, law, proportions)| {
            searched.null[mirror].drop_along(proportions) - price(*law)
        });
        scores.fold(0.0, f64::max)
    };
    let largest = parallel::map(0..mirrors, largest);
    let threshold = null.thresholds(&[largest])[0];
    let mut drafts: Vec<Draft> = tried
        .into_iter()
        .map(|(searched, law, proportions)| {
            let place = searched.located.place;
            let amplitude = searched.session.amplitude_along(&proportions);
            Draft {
                place,
                law,
                range: reach.of_driver(place.driver),
                strength: amplitude * reach.of_probe(place),
                score: searched.session.drop_along(&proportions) - price(law),
            }
        })
        .filter(|draft| draft.score > threshold)
        .collect();
    drafts.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut chosen: Vec<Draft> = Vec::new();
    for draft in drafts {
        let of_place = chosen.iter().filter(|other| other.place == draft.place);
        if chosen.len() < FITTED && of_place.count() < OF_ONE_PLACE {
            chosen.push(draft);
        }
    }
    (chosen, threshold)
}

/// The laws of a place's driver, each with the amplitudes of the place's basis that amount to it.
fn laws(searched: &Searched, reach: &Reach) -> Vec<(Law, DVector<f64>)> {
    let driver = searched.located.place.driver;
    let range = reach.of_driver(driver);
    let bases = &searched.bases;
    match driver {
        Driver::Turning | Driver::Rate => Vec::new(),
        Driver::Lag => bases
            .iter()
            .enumerate()
            .filter_map(|(index, basis)| match *basis {
                Basis::Fading { tau_s } if tau_s >= SHORTEST_S => {
                    let mut one = DVector::zeros(bases.len());
                    one[index] = 1.0;
                    Some((Law::Fading { tau_s }, one))
                }
                _ => None,
            })
            .collect(),
        _ => Law::all(range)
            .into_iter()
            .map(|law| (law, proportions(bases, |d| law.at(d, range))))
            .collect(),
    }
}

/// The amplitudes of a basis that amount to a function of the driver: its values at knots; of exposures, the changes of its slope.
fn proportions(bases: &[Basis], at: impl Fn(f64) -> f64) -> DVector<f64> {
    let thresholds: Vec<f64> = bases
        .iter()
        .filter_map(|basis| match basis {
            Basis::Exposed { above_k, .. } => Some(*above_k),
            _ => None,
        })
        .collect();
    let amplitude = |(index, basis): (usize, &Basis)| match *basis {
        Basis::Hat { knot, .. } => at(knot) - at(0.0),
        Basis::Exposed { above_k, top_k, .. } => {
            let slope = |from: f64, to: f64| (at(to) - at(from)) / (to - from);
            let next = thresholds.get(index + 1).copied().unwrap_or(top_k);
            let before = match index {
                0 => 0.0,
                _ => slope(thresholds[index - 1], above_k),
            };
            top_k * (slope(above_k, next) - before)
        }
        Basis::Fading { .. } | Basis::Damped { .. } | Basis::Following { .. } => 0.0,
    };
    DVector::from_iterator(bases.len(), bases.iter().enumerate().map(amplitude))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_law_costs_something_that_a_simpler_one_does_not() {
        for law in Law::all(100.0) {
            assert!((0.0..=1.0).contains(&law.at(100.0, 100.0)), "{law:?}");
            let parts = law.parameters() + law.operators();
            assert_eq!(law == Law::Linear, parts == 0, "{law:?}");
        }
    }

    #[test]
    fn an_exposure_above_a_threshold_is_one_of_the_basis() {
        let exposed = [0.0, 50.0, 80.0].map(|above_k| Basis::Exposed {
            above_k,
            top_k: 100.0,
            duration_s: 10.0,
        });
        let found = proportions(&exposed, |d| Law::Above { a: 50.0 }.at(d, 100.0));
        assert!((found - DVector::from_row_slice(&[0.0, 1.0, 0.0])).norm() < 1e-12);
    }
}
