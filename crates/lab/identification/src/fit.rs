//! Least squares of a model's parameters to a session.

use crate::base::{identifiable, seeds};
use crate::dataset::{Dataset, Observation, rms};
use crate::heater;
use crate::parameter::{BaseParameter, FreeParameter, misfit_of_measured};
use crate::prediction::{jacobian, predict, slopes, standard_deviation, standardised};
use least_squares::{Bounds, JacobianUpdates, Options, Prior, Problem, minimise};
use mirror_model::{Model, Runaway, Symbol};
use nalgebra::{DMatrix, DVector};

/// Standard deviation of the prior of every coordinate, about the start: a factor of 20 for a base parameter. It keeps what the
/// data do not determine where it was, and weighs nothing against hundreds of readings.
const PRIOR: f64 = 3.0;
/// Steps between two computations of the Jacobian, which takes as many simulations as there are parameters.
const REFRESH: usize = 6;
/// A fit evaluates its model so often at most, times one more than its parameters: what has not ended by then creeps along a
/// valley that the data do not determine.
const EVALUATIONS: usize = 12;
/// Where every start runs away, parts of its heating that fits start from: three decades, a choice.
const COOLER: [f64; 3] = [0.1, 0.01, 1e-3];
/// A time constant is not known to a factor of e where all standardised residuals together change by less than this with its
/// logarithm: its standard error is above 1.
const IDLE: f64 = 1.0;

/// How closely a fit approaches the least sum of squares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// Enough to tell which of several starts, or of several effects, leads furthest.
    Rough,
    /// What is printed repeats to four digits.
    Fine,
}

impl Precision {
    /// A fit ends where a step lowers the sum of squares, or moves, by no more than this share.
    fn tolerance(self) -> f64 {
        match self {
            Self::Rough => 1e-4,
            Self::Fine => 1e-6,
        }
    }
}

/// The parameters that a session can identify in a model, with those of its effects. A time constant of 0 is none.
pub fn free_parameters(model: &Model, data: &Dataset) -> Vec<FreeParameter> {
    let base = identifiable(data)
        .into_iter()
        .filter(|parameter| parameter.get(model) > 0.0)
        .map(FreeParameter::Base);
    let effects =
        model.effects.iter().enumerate().flat_map(|(e, active)| {
            (0..active.values.len()).map(move |p| FreeParameter::Effect(e, p))
        });
    base.chain(effects).collect()
}

/// A fitted model.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The model with the best values.
    pub model: Model,
    /// What was fitted.
    pub free: Vec<FreeParameter>,
    /// Measured less predicted, in um and A.
    pub residuals: Vec<f64>,
}

impl Fitted {
    /// The standardised residuals: each in units of its standard deviation about the prediction.
    pub fn standardised(&self, data: &Dataset) -> DVector<f64> {
        standardised(self.residuals.iter().copied(), data)
    }

    /// Root mean square of the displacements' residuals (um), if any was measured.
    pub fn displacement_rms_um(&self, data: &Dataset) -> Option<f64> {
        rms(self.of(data), true)
    }

    /// Root mean square of the currents' residuals (mA), if any was measured.
    pub fn current_rms_ma(&self, data: &Dataset) -> Option<f64> {
        rms(self.of(data), false).map(|amperes| 1e3 * amperes)
    }

    fn of<'d>(&self, data: &'d Dataset) -> impl Iterator<Item = (f64, &'d Observation)> {
        self.residuals.iter().copied().zip(&data.observations)
    }

    /// The sum of squares of the standardised residuals, and of how far the fitted parameters are off what was measured of them.
    pub fn cost(&self, data: &Dataset) -> f64 {
        let of_measured = misfit_of_measured(&self.model, self.free.iter().copied());
        self.standardised(data).norm_squared() + of_measured
    }
}

/// Numbers in the place of a dataset's own, and a model to fit to them.
struct FittedReadings<'a> {
    start: &'a Model,
    data: &'a Dataset,
    values: &'a [f64],
    parameters: &'a [FreeParameter],
}

impl FittedReadings<'_> {
    fn model(&self, coordinates: &DVector<f64>) -> Model {
        let mut model = self.start.clone();
        for (parameter, &coordinate) in self.parameters.iter().zip(coordinates.iter()) {
            parameter.set(&mut model, coordinate);
        }
        model
    }

    fn bounds(&self) -> Bounds {
        let bounds = |parameter: &FreeParameter| parameter.bounds(self.start);
        Bounds::new(self.parameters.iter().map(bounds))
    }

    /// What was measured of a parameter; of the others, that they are about where the fit starts.
    fn prior(&self, first: &DVector<f64>) -> Prior {
        let known = self.parameters.iter().zip(first.iter());
        let (mean, deviation): (Vec<f64>, Vec<f64>) = known
            .map(|(parameter, &at)| parameter.measured(self.start).unwrap_or((at, PRIOR)))
            .unzip();
        Prior {
            mean: mean.into(),
            standard_deviation: deviation.into(),
        }
    }

    fn coordinates(&self) -> DVector<f64> {
        let coordinate = |parameter: &FreeParameter| parameter.coordinate(self.start);
        DVector::from_iterator(
            self.parameters.len(),
            self.parameters.iter().map(coordinate),
        )
    }
}

impl Problem for FittedReadings<'_> {
    fn residuals(&self, at: &DVector<f64>) -> Option<DVector<f64>> {
        let predicted = predict(&self.model(at), self.data).ok()?;
        let residuals = predicted.iter().zip(self.values).map(|(p, v)| p - v);
        Some(standardised(residuals, self.data))
    }

    fn jacobian(&self, at: &DVector<f64>, here: &DVector<f64>, _: &Bounds) -> Option<DMatrix<f64>> {
        let rows = here.iter().zip(self.values).zip(&self.data.observations);
        let predicted: Vec<f64> = rows
            .map(|((residual, value), o)| value + residual * standard_deviation(o))
            .collect();
        slopes(&self.model(at), self.data, self.parameters, &predicted).ok()
    }
}

/// Fits a model to a dataset's observations, from several starts. Where all of these run away, from cooler ones.
///
/// # Errors
/// [`Runaway`] if no start has a finite answer; it says which reading is the first without one.
pub fn fit(model: &Model, data: &Dataset) -> Result<Fitted, Runaway> {
    let model = heater::suited(model, data);
    let starts = seeds(&model, &identifiable(data), data);
    let parameters = free_parameters(&starts[0], data);
    let fitted = best_fit(&starts, data, &data.values(), &parameters, Precision::Fine).or_else(
        |runaway| {
            let cooler: Vec<Model> = starts.iter().flat_map(cooler).collect();
            best_fit(&cooler, data, &data.values(), &parameters, Precision::Fine)
                .map_err(|_| runaway)
        },
    )?;
    without_idle_time(fitted, &model, data)
}

/// The model with less heating, and with none of what its effects add.
fn cooler(start: &Model) -> [Model; COOLER.len()] {
    COOLER.map(|share| {
        let mut cool = start.clone();
        let shared = BaseParameter::Shared(Symbol::ThermalResistance);
        shared.set(&mut cool, share * shared.get(start));
        for active in &mut cool.effects {
            active.values[0] = 0.0;
        }
        cool
    })
}

/// The fit without the time constant that none of a heater's readings depends on, which stays where the model has it.
fn without_idle_time(mut fitted: Fitted, model: &Model, data: &Dataset) -> Result<Fitted, Runaway> {
    let time = BaseParameter::Shared(Symbol::FastTime);
    let parameter = FreeParameter::Base(time);
    if !data.is_of_heaters() || !fitted.free.contains(&parameter) {
        return Ok(fitted);
    }
    let slopes = jacobian(&fitted.model, data, &[parameter])?;
    if slopes.norm() < IDLE {
        time.set(&mut fitted.model, time.get(model));
        fitted.free.retain(|other| *other != parameter);
    }
    Ok(fitted)
}

/// The best of the fits from several starts: all of them roughly, the best one as closely as is asked for.
///
/// # Errors
/// As [`fit`], if no start leads anywhere.
pub fn best_fit(
    starts: &[Model],
    data: &Dataset,
    values: &[f64],
    parameters: &[FreeParameter],
    precision: Precision,
) -> Result<Fitted, Runaway> {
    if let [start] = starts {
        return minimised(start, data, values, parameters, precision);
    }
    let fits = parallel::map(starts, |start| {
        minimised(start, data, values, parameters, Precision::Rough)
    });
    let cost = |fit: &Result<Fitted, Runaway>| {
        fit.as_ref()
            .map_or(f64::INFINITY, |fitted| fitted.cost(data))
    };
    let best = fits.into_iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
    let best = best.expect("a fit has at least one start")?;
    match precision {
        Precision::Rough => Ok(best),
        Precision::Fine => minimised(&best.model, data, values, parameters, precision),
    }
}

/// Fits chosen parameters of a model to numbers in the place of a dataset's own, from one start.
///
/// # Errors
/// As [`fit`].
pub fn fit_parameters(
    start: &Model,
    data: &Dataset,
    values: &[f64],
    parameters: &[FreeParameter],
) -> Result<Fitted, Runaway> {
    minimised(start, data, values, parameters, Precision::Fine)
}

fn minimised(
    start: &Model,
    data: &Dataset,
    values: &[f64],
    parameters: &[FreeParameter],
    precision: Precision,
) -> Result<Fitted, Runaway> {
    minimised_beside(None, start, data, values, parameters, precision)
}

/// Roughly the same as [`fit_parameters`] of one start, where derivatives of standardised predictions are known from a model close
/// by, as of many fits to the same drives. It ends where the derivatives of its own model lead no further.
///
/// # Errors
/// As [`fit`].
pub fn fit_beside(
    jacobian: &DMatrix<f64>,
    start: &Model,
    data: &Dataset,
    values: &[f64],
    parameters: &[FreeParameter],
) -> Result<Fitted, Runaway> {
    let jacobian = Some(jacobian.clone());
    minimised_beside(jacobian, start, data, values, parameters, Precision::Rough)
}

fn minimised_beside(
    first_jacobian: Option<DMatrix<f64>>,
    start: &Model,
    data: &Dataset,
    values: &[f64],
    parameters: &[FreeParameter],
    precision: Precision,
) -> Result<Fitted, Runaway> {
    let readings = FittedReadings {
        start,
        data,
        values,
        parameters,
    };
    let bounds = readings.bounds();
    let first = bounds.clamp(&readings.coordinates());
    let options = Options {
        prior: Some(readings.prior(&first)),
        bounds: Some(bounds),
        updates: JacobianUpdates::Secant { refresh: REFRESH },
        first_jacobian,
        cost_tolerance: precision.tolerance(),
        step_tolerance: precision.tolerance(),
        max_evaluations: EVALUATIONS * (parameters.len() + 1),
        ..Options::default()
    };
    // Where the start has no answer, or nothing around it, it stays the best model; the first is an error below.
    let best = minimise(&readings, &first, &options).map_or(first, |solution| solution.parameters);
    let model = readings.model(&best);
    let predicted = predict(&model, data)?;
    Ok(Fitted {
        model,
        free: parameters.to_vec(),
        residuals: values.iter().zip(predicted).map(|(v, p)| v - p).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::Channel;
    use mirror_model::Preset;
    use mirror_model::effect::{Active, find};

    const COLD: FreeParameter = FreeParameter::Base(BaseParameter::Own(Symbol::ColdResistance, 0));

    #[test]
    fn a_cold_resistance_is_that_of_the_mean_current() {
        // At 10 mV nothing warms. Equal weights: the least squares of V / R is the mean of the readings.
        let readings = [1.0e-5, 1.2e-5, 1.4e-5];
        let data = readings.iter().enumerate().fold(
            Dataset::driven([(0.01, 1.0); 3]),
            |data, (index, amperes)| data.reading(index, Channel::Current(0), *amperes, 1e-6),
        );
        let start = Model::from(Preset::Paper);
        let fitted = fit_parameters(&start, &data, &readings, &[COLD]).expect("an answer");
        let ohm = COLD.value(&fitted.model);
        // The prior weighs 1/9 against three times 12 squared: it holds 3e-4 of the way from the start, 0.8 in the logarithm.
        assert!((ohm / (0.01 / 1.2e-5) - 1.0).abs() < 2e-3, "{ohm}");
        let left_ma = fitted.current_rms_ma(&data).expect("currents");
        // Deviations of -0.2, 0 and 0.2.
        assert!((left_ma / (0.2e-2 * (2.0_f64 / 3.0).sqrt()) - 1.0).abs() < 1e-3);
        assert_eq!(fitted.displacement_rms_um(&data), None);
        let cost: f64 = data
            .observations
            .iter()
            .map(standard_deviation)
            .map(|s| (1e-3 * left_ma / s).powi(2))
            .sum();
        // The readings' standard deviations differ a little, as each is in part a share of the reading.
        assert!((fitted.cost(&data) / cost - 1.0).abs() < 1e-2);
    }

    #[test]
    fn a_parameter_beyond_its_range_ends_on_the_bound() {
        let mut model = Model::from(Preset::Reconciled);
        model
            .effects
            .push(Active::usual(find("sensor-gain").expect("an effect")));
        let gain = FreeParameter::Effect(0, 0);
        let (_, high) = gain.range(&model);
        let data = Dataset::driven([(2.0, 1.0), (3.0, 1.0)])
            .reading(0, Channel::Displacement, 0.0, 0.02)
            .reading(1, Channel::Displacement, 0.0, 0.02);
        let twice: Vec<f64> = predict(&model, &data)
            .expect("an answer")
            .iter()
            .map(|z| 2.0 * z)
            .collect();
        let fitted = fit_parameters(&model, &data, &twice, &[gain]).expect("an answer");
        // But for the rounding of a coordinate.
        assert!((gain.value(&fitted.model) / high - 1.0).abs() < 1e-12);
        assert!(gain.is_at_its_limit(&fitted.model));
    }

    #[test]
    fn a_start_that_runs_away_is_an_error_and_one_beside_another_is_not() {
        let cold = Model::from(Preset::Paper);
        let mut melts = cold.clone();
        melts.parameters.set(Symbol::ThermalResistance, 1e12);
        let data = Dataset::driven([(3.0, 1.0)]).reading(0, Channel::Current(0), 8e-3, 1e-6);
        let values = data.values();
        assert!(predict(&melts, &data).is_err(), "it melts");
        assert!(fit_parameters(&melts, &data, &values, &[COLD]).is_err());
        let fitted =
            best_fit(&[melts, cold], &data, &values, &[COLD], Precision::Fine).expect("the other");
        assert!(fitted.model.parameters.thermal_resistance_k_per_w < 1e12);
    }

    #[test]
    fn no_free_parameter_leaves_the_model_as_it_is() {
        let model = Model::from(Preset::Paper);
        let data = Dataset::driven([(1.0, 1.0)]).reading(0, Channel::Displacement, 3.0, 0.02);
        let fitted = fit_parameters(&model, &data, &[3.0], &[]).expect("an answer");
        assert_eq!(fitted.model, model);
        let predicted = predict(&model, &data).expect("an answer");
        assert_eq!(fitted.residuals, [3.0 - predicted[0]]);
    }

    #[test]
    fn effects_are_free_and_time_constants_of_0_are_not() {
        let mut model = Model::from(Preset::Paper);
        model
            .effects
            .push(Active::usual(find("creep").expect("an effect")));
        let data = (0..60).fold(Dataset::driven([(1.0, 1e-3)]), |data, _| {
            data.reading(0, Channel::Displacement, 1.0, 0.02)
        });
        let count = model.effects[0].values.len();
        let names = |model: &Model| -> Vec<String> {
            let free = free_parameters(model, &data);
            free.iter().map(|parameter| parameter.name(model)).collect()
        };
        assert_eq!(names(&model).len(), 1 + count, "{:?}", names(&model));
        model.parameters.set(Symbol::FastTime, 1e-3);
        assert_eq!(names(&model).len(), 2 + count, "{:?}", names(&model));
    }
}
