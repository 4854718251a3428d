//! What a model predicts of a dataset, and how that changes with free parameters.

use crate::dataset::{Channel, Dataset, Observation};
use crate::parameter::{BaseParameter, FreeParameter};
use mirror_model::{ACTUATORS, Model, Output, Runaway, simulate};
use nalgebra::{DMatrix, DVector};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Step control of the simulation, in units of the time since the last jump (see `simulate`). Each diagnosis halves it
/// once and reports what that changes (`solver_error`).
pub const RESOLUTION: f64 = 0.5;
/// Standard deviation of the model's discrepancy that every reading is weighed with, beside its noise: of a displacement (um),
/// and of a current, as a part of it. It lies below what lumped equations leave of virtual mirrors with distributed heat
/// (`diagnose` prints that, 0.3 um for a standard session) and keeps fine instruments from deciding alone; `cargo xtask bench
/// diagnose` benches the verdicts with it.
const DISCREPANCY_UM: f64 = 0.1;
const DISCREPANCY_RATIO: f64 = 3e-4;
/// Difference step of a coordinate: between the rounding of the simulation's fixed points (1e-5 K of some 100 K) and the
/// curvature of the slopes.
const DIFFERENCE: f64 = 1e-4;

/// The standard deviation of an observation about the prediction, in its unit: its white noise and the model's discrepancy.
pub fn standard_deviation(observation: &Observation) -> f64 {
    let discrepancy = match observation.channel {
        Channel::Displacement => DISCREPANCY_UM,
        Channel::Current(_) => DISCREPANCY_RATIO * observation.value.abs(),
    };
    // Of every reading in every evaluation: `hypot`, which guards against overflow, is several times as slow.
    (observation.noise * observation.noise + discrepancy * discrepancy).sqrt()
}

/// Numbers like a dataset's observations, in um and A, in standard deviations.
pub fn standardised(numbers: impl IntoIterator<Item = f64>, data: &Dataset) -> DVector<f64> {
    let rows = numbers
        .into_iter()
        .zip(&data.observations)
        .map(|(number, observation)| number / standard_deviation(observation));
    DVector::from_iterator(data.observations.len(), rows)
}

/// The white noise of a dataset's observations, as a part of their standard deviations.
pub fn white_noise(data: &Dataset) -> DVector<f64> {
    standardised(data.observations.iter().map(|o| o.noise), data)
}

/// Simulations that this process has made of datasets.
static SIMULATIONS: AtomicUsize = AtomicUsize::new(0);

/// How many simulations of a dataset this process has made: what fits and diagnoses are made of.
pub fn simulations() -> usize {
    SIMULATIONS.load(Ordering::Relaxed)
}

/// A model's predictions of a dataset's observations, in um and A.
///
/// # Errors
/// [`Runaway`] if the model has no finite answer.
pub fn predict(model: &Model, data: &Dataset) -> Result<Vec<f64>, Runaway> {
    Ok(data.read(&simulated(model, data)?))
}

fn simulated(model: &Model, data: &Dataset) -> Result<Vec<Output>, Runaway> {
    SIMULATIONS.fetch_add(1, Ordering::Relaxed);
    let outputs = simulate(model, &data.intervals, RESOLUTION);
    outputs.map_err(|runaway| Runaway {
        reading: data.first_reading_after(runaway.t_s),
        ..runaway
    })
}

/// How standardised predictions (rows) change with each parameter's coordinate (columns).
///
/// # Errors
/// [`Runaway`] if the model has no finite answer close by.
pub fn jacobian(
    model: &Model,
    data: &Dataset,
    parameters: &[FreeParameter],
) -> Result<DMatrix<f64>, Runaway> {
    slopes(model, data, parameters, &predict(model, data)?)
}

/// The same where the predictions `here` are known.
pub(crate) fn slopes(
    model: &Model,
    data: &Dataset,
    parameters: &[FreeParameter],
    here: &[f64],
) -> Result<DMatrix<f64>, Runaway> {
    let groups = groups(model, parameters);
    let apart = groups.iter().any(|group| group.len() > 1);
    let outputs = apart.then(|| simulated(model, data)).transpose()?;
    let columns = |group: &Vec<usize>| {
        let slopes = |step: f64| {
            let (moved, steps) = moved(model, group.iter().map(|&at| parameters[at]), step);
            let there = simulated(&moved, data)?;
            let read = match (&outputs, &group[..]) {
                (Some(outputs), [_, _, ..]) => group
                    .iter()
                    .map(|&at| data.read(&of_one_actuator(outputs, &there, parameters[at])))
                    .collect(),
                _ => vec![data.read(&there)],
            };
            let column = |(there, step): (Vec<f64>, f64)| {
                let slopes = there.iter().zip(here).map(|(t, h)| (t - h) / step);
                standardised(slopes, data)
            };
            Ok(read.into_iter().zip(steps).map(column).collect::<Vec<_>>())
        };
        // Next to where the model has no answer, it has one on the other side.
        slopes(DIFFERENCE).or_else(|_: Runaway| slopes(-DIFFERENCE))
    };
    let found: Result<Vec<_>, Runaway> = parallel::map(&groups, columns).into_iter().collect();
    let mut jacobian = DMatrix::zeros(here.len(), parameters.len());
    for (&at, column) in groups.iter().flatten().zip(found?.iter().flatten()) {
        jacobian.set_column(at, column);
    }
    Ok(jacobian)
}

/// The parameters by which of them one simulation moves together. Where no actuator feels another, these are all actuators' own of
/// one kind: current and displacement of each actuator tell them apart (A. Curtis, M. Powell and J. Reid, J. Inst. Maths Applics
/// 13 (1974) 117).
fn groups(model: &Model, parameters: &[FreeParameter]) -> Vec<Vec<usize>> {
    let independent = model.has_independent_actuators();
    let kind = |at: usize| match parameters[at] {
        FreeParameter::Base(BaseParameter::Own(symbol, _)) if independent => Some(symbol),
        _ => None,
    };
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for at in 0..parameters.len() {
        let same = |group: &&mut Vec<usize>| kind(at).is_some() && kind(group[0]) == kind(at);
        match groups.iter_mut().find(same) {
            Some(group) => group.push(at),
            None => groups.push(vec![at]),
        }
    }
    groups
}

/// What a mirror shows of which one actuator's own parameter is moved, where those of the others are, too.
fn of_one_actuator(here: &[Output], there: &[Output], parameter: FreeParameter) -> Vec<Output> {
    let FreeParameter::Base(BaseParameter::Own(_, actuator)) = parameter else {
        return there.to_vec();
    };
    let of_one = |(here, there): (&Output, &Output)| {
        let mut one = *here;
        let moved_um = there.actuator_z_um[actuator] - here.actuator_z_um[actuator];
        one.z_um += moved_um / ACTUATORS as f64;
        one.current_a[actuator] = there.current_a[actuator];
        one
    };
    here.iter().zip(there).map(of_one).collect()
}

/// The model with parameters moved, and by how much of the coordinate of each: the other way where its range ends.
fn moved(
    model: &Model,
    parameters: impl Iterator<Item = FreeParameter>,
    step: f64,
) -> (Model, Vec<f64>) {
    let mut moved = model.clone();
    let steps = parameters.map(|parameter| {
        let at = parameter.coordinate(model);
        let (lowest, highest) = parameter.bounds(model);
        let step = if (lowest..=highest).contains(&(at + step)) {
            step
        } else {
            -step
        };
        parameter.set(&mut moved, at + step);
        parameter.coordinate(&moved) - at
    });
    let steps = steps.collect();
    (moved, steps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_model::effect::{Active, built_in, forms};
    use mirror_model::{Interval, Preset, Symbol};

    #[test]
    fn noise_and_discrepancy_add_as_squares() {
        let data = Dataset::driven([(1.0, 1.0)])
            .reading(0, Channel::Displacement, 50.0, 0.075)
            .reading(0, Channel::Current(0), -2e-3, 8e-7);
        let of: Vec<f64> = data.observations.iter().map(standard_deviation).collect();
        // 3-4-5: 0.1 um and 0.075 um; 3e-4 of 2 mA and 0.8 uA.
        assert!(
            (of[0] - 0.125).abs() < 1e-15 && (of[1] - 1e-6).abs() < 1e-18,
            "{of:?}"
        );
        let standardised = standardised([0.25, 3e-6], &data);
        assert!((standardised - DVector::from_vec(vec![2.0, 3.0])).norm() < 1e-12);
        assert!((white_noise(&data) - DVector::from_vec(vec![0.6, 0.8])).norm() < 1e-12);
    }

    #[test]
    fn a_cold_current_falls_as_the_logarithm_of_its_resistance_rises() {
        // At 10 mV nothing warms: I = V / R, and dI / d ln R = -I.
        let data = Dataset::driven([(0.01, 1.0)]).reading(0, Channel::Current(1), 1e-5, 4e-9);
        let model = Model::from(Preset::Paper);
        let amperes = 0.01 / model.parameters.cold_resistance_ohm;
        let own = |symbol| FreeParameter::Base(BaseParameter::Own(symbol, 1));
        let other = FreeParameter::Base(BaseParameter::Own(Symbol::ColdResistance, 0));
        let parameters = [own(Symbol::ColdResistance), other];
        let slopes = jacobian(&model, &data, &parameters).expect("an answer");
        let expected = -amperes / standard_deviation(&data.observations[0]);
        // A forward difference of 1e-4 is off by half of that.
        assert!((slopes[(0, 0)] / expected - 1.0).abs() < 1e-4);
        assert_eq!(slopes[(0, 1)], 0.0, "another actuator's");
        let none = jacobian(&model, &data, &[]).expect("an answer");
        assert_eq!(none.shape(), (1, 0));
    }

    /// Four drives that differ and four that do not, read on the way to the temperature and at it.
    fn session() -> Dataset {
        let currents = (0..ACTUATORS).map(|actuator| (Channel::Current(actuator), 1e-6));
        let channels: Vec<_> = currents.chain([(Channel::Displacement, 0.02)]).collect();
        let drives = [[2.0, 0.5, 1.0, 3.0], [0.0, 3.0, 2.0, 1.0], [2.5; ACTUATORS]];
        let held = |volts| [5e-3, 0.5].map(|duration_s| Interval::held(volts, duration_s));
        let mut data = Dataset::driven([]);
        data.intervals = drives.into_iter().flat_map(held).collect();
        data.read_at_each(&channels)
    }

    #[test]
    fn actuators_moved_together_are_told_apart_with_every_effect() {
        let data = session();
        let mut own = Vec::new();
        for symbol in [Symbol::ColdResistance, Symbol::ThermalResistance] {
            own.extend((0..ACTUATORS).map(|i| FreeParameter::Base(BaseParameter::Own(symbol, i))));
        }
        for effect in built_in().iter().flat_map(forms) {
            let mut model = Model::from(Preset::Reconciled);
            model.effects.push(Active::usual(effect.clone()));
            let together = jacobian(&model, &data, &own).expect("an answer");
            for (at, &parameter) in own.iter().enumerate() {
                let alone = jacobian(&model, &data, &[parameter]).expect("an answer");
                let off = (together.column(at) - &alone).norm() / alone.norm();
                // Rounding of predictions, 1e-16, over a step of 1e-4.
                assert!(off < 1e-10, "{} {}: {off}", effect.info().id, effect.form());
            }
        }
        assert_eq!(groups(&Model::from(Preset::Paper), &own).len(), 2);
    }

    #[test]
    fn at_the_end_of_a_range_the_difference_goes_back() {
        let mut model = Model::from(Preset::Paper);
        let weight = FreeParameter::Base(BaseParameter::Shared(Symbol::MiddleWeight));
        let (_, high) = weight.range(&model);
        weight.set(&mut model, f64::INFINITY);
        assert_eq!(weight.value(&model), high);
        let (there, steps) = moved(&model, [weight].into_iter(), DIFFERENCE);
        assert!(steps[0] < 0.0 && weight.value(&there) < high);
    }
}
