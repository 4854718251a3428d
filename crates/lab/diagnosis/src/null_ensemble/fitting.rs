//! Fits of the base to the null ensemble's mirrors.
//!
//! Of hundreds of fits to the same drives each starts from the fit to the first mirror, and takes its Jacobian over: damped
//! steps with Broyden's rank-one updates (C. G. Broyden, Math. Comp. 19 (1965) 577-593), and a new Jacobian only now and
//! then. That is a third of the price of a fit of its own from the paper's parameters.

use crate::progress::Count;
use identification::base::{identifiable, seeds, with_own_resistances};
use identification::dataset::Dataset;
use identification::parameter::{BaseParameter, FreeParameter};
use identification::prediction::{jacobian, predict, standardised};
use mirror_model::{Model, Preset, Runaway};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Steps of a fit, which ends earlier where nothing is gained. This and the next two were set by what they cost and by the
/// figures of `cargo xtask bench diagnose`.
const STEPS: usize = 20;
/// Steps between two computations of the Jacobian.
const REFRESHED: usize = 5;
/// One mirror in so many, those that are fitted worst, is fitted anew from all starts: some of them are in a local minimum.
const STUCK: usize = 8;
/// A step that lowers the sum of squares by less than this part of it ends a fit with a fresh Jacobian.
const GAIN: f64 = 1e-3;
/// Damping of the first step in parts of the normal matrix's diagonal, and how it changes after a good and a bad step.
const DAMPING: f64 = 1e-3;
const EASED: f64 = 0.2;
const TIGHTENED: f64 = 10.0;
/// A ridge for a parameter that no reading depends on.
const RIDGE: f64 = 1e-6;
/// The longest step of a parameter's logarithm: a factor of 2.
const LONGEST: f64 = 0.7;

/// The base fitted to one mirror.
pub(super) struct Fit {
    /// What it leaves, standardised as the data are.
    pub(super) left: DVector<f64>,
    /// The coordinates of its parameters, in the order of [`identifiable`].
    pub(super) coordinates: Vec<f64>,
}

/// The base fitted to each mirror.
///
/// # Errors
/// [`Runaway`] if no start has an answer.
pub(super) fn fits(data: &Dataset, mirrors: &[Vec<f64>]) -> Result<Vec<Fit>, Runaway> {
    let base = Base::of(data);
    let first = base.fitted(&mirrors[0])?;
    let slopes = jacobian(&first.model, data, &base.parameters)?;
    let fitted = Count::of("null ensemble: mirrors fitted", mirrors.len());
    let mut fits: Vec<_> = mirrors
        .par_iter()
        .map(|values| {
            let start = Start {
                model: with_own_resistances(&first.model, &data.with_values(values)),
                slopes: slopes.clone(),
            };
            fitted.after(base.followed(start, values))
        })
        .collect();
    let mut worst: Vec<usize> = (0..fits.len()).collect();
    worst.sort_by(|&a, &b| {
        let cost = |index: usize| fits[index].left.norm_squared();
        cost(b).total_cmp(&cost(a))
    });
    worst.truncate(fits.len() / STUCK);
    let fresh: Result<Vec<_>, Runaway> = worst
        .par_iter()
        .map(|&index| base.fitted(&mirrors[index]))
        .collect();
    for (index, fresh) in worst.into_iter().zip(fresh?) {
        if fresh.left.norm_squared() < fits[index].left.norm_squared() {
            fits[index] = fresh;
        }
    }
    Ok(fits.into_iter().map(|fit| base.fit(fit)).collect())
}

/// What is fitted.
struct Base<'a> {
    data: &'a Dataset,
    free: Vec<BaseParameter>,
    parameters: Vec<FreeParameter>,
}

/// A model to fit from, and the derivatives of its standardised predictions.
struct Start {
    model: Model,
    slopes: DMatrix<f64>,
}

/// A model fitted to a virtual mirror, and what it leaves, standardised.
struct Followed {
    model: Model,
    left: DVector<f64>,
}

impl<'a> Base<'a> {
    fn of(data: &'a Dataset) -> Self {
        let free = identifiable(data);
        Self {
            data,
            parameters: free.iter().copied().map(FreeParameter::Base).collect(),
            free,
        }
    }

    fn fit(&self, Followed { model, left }: Followed) -> Fit {
        let coordinates = self.parameters.iter().map(|p| p.coordinate(&model));
        Fit {
            left,
            coordinates: coordinates.collect(),
        }
    }

    fn left(&self, model: &Model, values: &[f64]) -> Option<DVector<f64>> {
        let predicted = predict(model, self.data).ok()?;
        let left = values.iter().zip(predicted).map(|(v, p)| v - p);
        Some(standardised(left, self.data))
    }

    /// The best of the fits from all starts.
    fn fitted(&self, values: &[f64]) -> Result<Followed, Runaway> {
        let paper = Model::from(Preset::Paper);
        let starts = seeds(&paper, &self.free, &self.data.with_values(values));
        let fits: Result<Vec<_>, Runaway> = starts
            .into_par_iter()
            .map(|model| {
                let slopes = jacobian(&model, self.data, &self.parameters)?;
                Ok(self.followed(Start { model, slopes }, values))
            })
            .collect();
        let best = fits?
            .into_iter()
            .min_by(|a, b| a.left.norm_squared().total_cmp(&b.left.norm_squared()));
        Ok(best.expect("a fit has at least one start"))
    }

    fn followed(&self, start: Start, values: &[f64]) -> Followed {
        let Start {
            mut model,
            mut slopes,
        } = start;
        let left = self.left(&model, values);
        let mut left = left.expect("the fit that it starts from has an answer");
        let mut damping = DAMPING;
        for round in 1..=STEPS {
            let Some(step) = step(&slopes, &left, damping) else {
                break;
            };
            let mut moved = model.clone();
            for (parameter, s) in self.parameters.iter().zip(step.iter()) {
                parameter.shift(&mut moved, *s);
            }
            let Some(next) = self.left(&moved, values) else {
                break;
            };
            let surprise = (&left - &next) - &slopes * &step;
            slopes += surprise * step.transpose() / step.norm_squared().max(1e-18);
            let gain = 1.0 - next.norm_squared() / left.norm_squared();
            if gain > 0.0 {
                (model, left, damping) = (moved, next, EASED * damping);
            } else {
                damping *= TIGHTENED;
            }
            let is_stuck = gain < GAIN;
            if is_stuck && round > REFRESHED {
                break;
            }
            if (round % REFRESHED == 0 || is_stuck) && round < STEPS {
                match jacobian(&model, self.data, &self.parameters) {
                    Ok(fresh) => slopes = fresh,
                    Err(_) => break,
                }
            }
        }
        Followed { model, left }
    }
}

/// A damped Gauss-Newton step of the parameters' logarithms.
fn step(slopes: &DMatrix<f64>, left: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
    let normal = slopes.tr_mul(slopes);
    let added = normal.diagonal().map(|d| damping * d + RIDGE);
    let factor = (normal + DMatrix::from_diagonal(&added)).cholesky()?;
    let step = factor.solve(&slopes.tr_mul(left));
    Some(step.map(|s| s.clamp(-LONGEST, LONGEST)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use identification::dataset::Channel;
    use mirror_model::{ACTUATORS, Symbol};

    /// Displacement and currents at eight levels.
    fn data() -> Dataset {
        let currents = (0..ACTUATORS).map(|actuator| (Channel::Current(actuator), 2e-6));
        let channels: Vec<_> = currents.chain([(Channel::Displacement, 0.02)]).collect();
        let levels = (0..8).map(|level| (0.5 * f64::from(level), 1.0));
        Dataset::driven(levels).read_at_each(&channels)
    }

    #[test]
    fn mirrors_that_the_base_can_be_leave_nothing() {
        let data = data();
        let mirrors: Vec<_> = [1.0, 1.3, 0.8]
            .map(|factor| {
                let mut model = Model::from(Preset::Paper);
                for symbol in [Symbol::ThermalResistance, Symbol::CurvatureCoefficient] {
                    model
                        .parameters
                        .set(symbol, factor * model.parameters.get(symbol));
                }
                predict(&model, &data).unwrap()
            })
            .into();
        for (values, fit) in mirrors.iter().zip(fits(&data, &mirrors).unwrap()) {
            let left = fit.left;
            let size = standardised(values.iter().copied(), &data).norm();
            // A fit ends where a step gains less than a thousandth of the sum of squares.
            assert!(left.norm() < 1e-3 * size, "{} of {size}", left.norm());
        }
    }

    #[test]
    fn a_step_solves_a_linear_problem_at_once() {
        let slopes = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 0.0, 2.0, 1.0, 1.0]);
        let shift = DVector::from_vec(vec![0.3, -0.2]);
        let found = step(&slopes, &(&slopes * &shift), 0.0).unwrap();
        // The ridge is 1e-6 of an eigenvalue of about 1.
        assert!((&found - shift).norm() < 1e-6, "{found}");
        let far = step(
            &slopes,
            &(&slopes * DVector::from_vec(vec![5.0, -5.0])),
            0.0,
        );
        assert_eq!(far.unwrap().as_slice(), [LONGEST, -LONGEST]);
    }
}
