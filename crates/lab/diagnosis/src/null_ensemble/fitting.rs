//! Fits of the base to the null ensemble's mirrors.
//!
//! Of hundreds of fits to the same drives each starts from the fit to the first mirror, and takes its Jacobian over.

use crate::progress::Count;
use identification::base::{identifiable, seeds, with_own_resistances};
use identification::dataset::Dataset;
use identification::fit::{Fitted, Precision, best_fit, fit_beside};
use identification::parameter::{BaseParameter, FreeParameter};
use identification::prediction::jacobian;
use mirror_model::{Model, Preset, Runaway};
use nalgebra::DVector;

/// One mirror in so many, those that are fitted worst, is fitted anew from all starts: some of them are in a local minimum. Set by
/// what it costs and by the figures of `cargo xtask bench diagnose`.
const STUCK: usize = 8;

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
    let count = Count::of("null ensemble: mirrors fitted", mirrors.len());
    let fits = parallel::map(mirrors, |values| {
        let start = with_own_resistances(&first.model, &data.with_values(values));
        count.after(fit_beside(&slopes, &start, data, values, &base.parameters))
    });
    let mut fits = fits.into_iter().collect::<Result<Vec<Fitted>, Runaway>>()?;
    let mut worst: Vec<usize> = (0..fits.len()).collect();
    worst.sort_by(|&a, &b| fits[b].cost(data).total_cmp(&fits[a].cost(data)));
    worst.truncate(fits.len() / STUCK);
    let fresh = parallel::map(&worst, |&index| base.fitted(&mirrors[index]));
    let fresh = fresh.into_iter().collect::<Result<Vec<_>, Runaway>>()?;
    for (index, fresh) in worst.into_iter().zip(fresh) {
        if fresh.cost(data) < fits[index].cost(data) {
            fits[index] = fresh;
        }
    }
    Ok(fits.iter().map(|fitted| base.fit(fitted)).collect())
}

/// What is fitted.
struct Base<'a> {
    data: &'a Dataset,
    free: Vec<BaseParameter>,
    parameters: Vec<FreeParameter>,
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

    fn fit(&self, fitted: &Fitted) -> Fit {
        let coordinates = self.parameters.iter();
        Fit {
            left: fitted.standardised(self.data),
            coordinates: coordinates.map(|p| p.coordinate(&fitted.model)).collect(),
        }
    }

    /// The best of the fits from all starts.
    fn fitted(&self, values: &[f64]) -> Result<Fitted, Runaway> {
        let paper = Model::from(Preset::Paper);
        let starts = seeds(&paper, &self.free, &self.data.with_values(values));
        best_fit(
            &starts,
            self.data,
            values,
            &self.parameters,
            Precision::Rough,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use identification::dataset::Channel;
    use identification::prediction::{predict, standardised};
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
            // A fit ends where a step gains less than 1e-4 of the sum of squares.
            assert!(left.norm() < 1e-3 * size, "{} of {size}", left.norm());
        }
    }
}
