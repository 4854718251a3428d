//! Rows that are held out of the fit of a strength, to tell what an effect is worth where it was not fitted.

use crate::quantile::TOLD;
use identification::Unit;
use identification::dataset::{Channel, Dataset, Observation, rms};
use identification::fit::{Fitted, fit_parameters};
use identification::prediction::predict;
use nalgebra::DVector;

/// Readings are held out by so many in a row, every other handful, so that what is held out lies between what is kept.
const HANDFUL: usize = 5;
/// Rows held out get their noise times this, so that they weigh nothing: 1e-12 of what they would.
const WEIGHTLESS: f64 = 1e6;

/// Whether each row is held out.
pub(crate) fn held_out_rows(data: &Dataset) -> Vec<bool> {
    let rows = data.observations.iter();
    rows.map(|o| o.interval / HANDFUL % 2 == 1).collect()
}

/// The least fall of an error on the rows held out, in parts of itself, that is no chance: two standard errors of a root mean square, which
/// of n readings is known to 1 / sqrt(2 n).
pub(crate) fn told_on_held_out(data: &Dataset, unit: Unit) -> f64 {
    let rows = data.observations.iter().zip(held_out_rows(data));
    let of_unit =
        |o: &Observation| (o.channel == Channel::Displacement) == (unit == Unit::Micrometre);
    let count = rows
        .filter(|(o, is_held_out)| *is_held_out && of_unit(o))
        .count();
    TOLD / (2.0 * count as f64).sqrt()
}

/// Root mean squares on the rows held out, 0 where nothing was measured in a unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeldOut {
    micrometres: f64,
    milliamperes: f64,
}

impl HeldOut {
    /// Where a fit is repeated, from where it ended, on the other rows; none where it has no answer.
    pub(crate) fn of(fitted: &Fitted, data: &Dataset) -> Option<Self> {
        let part = |wanted: bool| {
            let mut part = data.clone();
            let mut is_held_out = held_out_rows(data).into_iter();
            part.observations
                .retain(|_| is_held_out.next() == Some(wanted));
            part
        };
        let (kept, rest) = (part(false), part(true));
        let again = fit_parameters(&fitted.model, &kept, &kept.values(), &fitted.free).ok()?;
        let predicted = predict(&again.model, &rest).ok()?;
        let read = rest.observations.iter();
        let left = || read.clone().zip(&predicted).map(|(o, p)| (o.value - p, o));
        Some(Self {
            micrometres: rms(left(), true).unwrap_or(0.0),
            milliamperes: 1e3 * rms(left(), false).unwrap_or(0.0),
        })
    }

    pub(crate) fn rms(self, unit: Unit) -> f64 {
        match unit {
            Unit::Micrometre => self.micrometres,
            Unit::Milliampere => self.milliamperes,
        }
    }
}

/// The noise of each row where those held out weigh nothing.
pub(crate) fn training_noise(data: &Dataset, white_noise: &DVector<f64>) -> DVector<f64> {
    let mut noise = white_noise.clone();
    for (deviation, is_held_out) in noise.iter_mut().zip(held_out_rows(data)) {
        if is_held_out {
            *deviation *= WEIGHTLESS;
        }
    }
    noise
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two readings at the end of each of twelve intervals.
    fn data() -> Dataset {
        Dataset::driven([(1.0, 1.0); 12]).read_at_each(&[(Channel::Displacement, 0.01); 2])
    }

    #[test]
    fn every_other_handful_of_rows_is_held_out_with_all_its_readings() {
        let held_out = held_out_rows(&data());
        let rows: Vec<usize> = (0..24).filter(|&index| held_out[index]).collect();
        assert_eq!(rows, (10..20).collect::<Vec<_>>());
    }

    #[test]
    fn what_ten_held_out_readings_tell_is_two_of_their_standard_errors() {
        let told = told_on_held_out(&data(), Unit::Micrometre);
        assert!((told - 2.0 / 20.0_f64.sqrt()).abs() < 1e-12, "{told}");
        // Where none are of that unit, nothing tells anything.
        assert_eq!(told_on_held_out(&data(), Unit::Milliampere), f64::INFINITY);
    }

    #[test]
    fn what_is_held_out_weighs_nothing_and_the_rest_as_before() {
        let noise = training_noise(&data(), &DVector::repeat(24, 0.5));
        assert_eq!(
            (noise[9], noise[10], noise[19], noise[20]),
            (0.5, 5e5, 5e5, 0.5)
        );
    }
}
