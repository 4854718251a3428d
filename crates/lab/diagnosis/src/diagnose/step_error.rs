//! How exact the simulation is that everything rests on.

use identification::dataset::Dataset;
use identification::prediction::standard_deviation;
use mirror_model::{Model, Runaway, simulate};

/// How far halving the simulation's step moves any prediction, at most, in standard deviations of its reading.
///
/// # Errors
/// [`Runaway`] if the model has no finite answer.
pub(super) fn step_error(model: &Model, data: &Dataset, resolution: f64) -> Result<f64, Runaway> {
    let coarse = data.read(&simulate(model, &data.intervals, resolution)?);
    let fine = data.read(&simulate(model, &data.intervals, resolution / 2.0)?);
    let moved = coarse
        .iter()
        .zip(&fine)
        .zip(&data.observations)
        .map(|((c, f), o)| (c - f).abs() / standard_deviation(o));
    Ok(moved.fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use identification::dataset::Channel;
    use mirror_model::Preset;

    use super::*;

    /// Held drives, each read at its end.
    fn data(drives_v: &[f64]) -> Dataset {
        let held = drives_v.iter().map(|&volts| (volts, 0.01));
        Dataset::driven(held).read_at_each(&[(Channel::Displacement, 0.01)])
    }

    fn error(drives_v: &[f64], resolution: f64) -> f64 {
        let mut model = Model::from(Preset::Paper);
        // The paper's poles are at rest at once.
        (model.parameters.fast_s, model.parameters.middle_s) = (1e-3, 0.035);
        model.parameters.middle_weight = 0.3;
        step_error(&model, &data(drives_v), resolution).expect("a finite answer")
    }

    #[test]
    fn a_mirror_at_rest_is_simulated_exactly() {
        assert_eq!(error(&[0.0; 4], 1.0), 0.0);
    }

    #[test]
    fn a_finer_step_is_more_exact() {
        let steps = [0.0, 2.0, 0.5, 3.0];
        let (coarse, fine) = (error(&steps, 1.0), error(&steps, 0.25));
        assert!(coarse > fine && fine >= 0.0, "{coarse} and {fine}");
    }
}
