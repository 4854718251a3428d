//! What the plate of a model that has effects on its motion makes of what the base leaves of the null ensemble's mirrors.
//!
//! The base's error right after a jump of the drive is where a plate on springs begins to ring: mirrors that lack nothing but what the
//! model has ring by it, too, for as long as the plate does.

use identification::dataset::{Channel, Dataset};
use identification::prediction::standard_deviation;
use mirror_model::Model;
use mirror_model::effect::{Active, Acts, Moment, Step};

use super::NullEnsemble;

impl NullEnsemble {
    /// The same mirrors, with plates that move by the effects of a model.
    pub(crate) fn moving_as(mut self, model: &Model, data: &Dataset) -> Self {
        let course = Course::of(data);
        let is_plate = |active: &&Active| active.effect.info().acts == Acts::Motion;
        for plate in model.effects.iter().filter(is_plate) {
            let still_um = course.followed(plate, &vec![0.0; data.observations.len()]);
            for mut mirror in self.residuals.column_iter_mut() {
                course.moved((plate, &still_um), mirror.as_mut_slice());
            }
        }
        self
    }
}

/// Where a session reads the displacement.
struct Course {
    /// How long each interval lasts (s), and the row that its end is read in, with that row's standard deviation (um).
    intervals: Vec<(f64, Option<(usize, f64)>)>,
}

impl Course {
    fn of(data: &Dataset) -> Self {
        let durations = data.intervals.iter().map(|interval| interval.duration_s);
        let mut intervals: Vec<_> = durations.map(|duration_s| (duration_s, None)).collect();
        for (row, observation) in data.observations.iter().enumerate() {
            if observation.channel == Channel::Displacement {
                intervals[observation.interval].1 = Some((row, standard_deviation(observation)));
            }
        }
        Self { intervals }
    }

    /// Standardised residuals of a displacement, as a plate follows it. Where it is when nothing is left does not count, and where it has no answer
    /// they stay as they are, for a user's formula may look at more than the displacement.
    fn moved(&self, (plate, still_um): (&Active, &[f64]), standardised: &mut [f64]) {
        let followed_um = self.followed(plate, standardised);
        let ends = self.intervals.iter().zip(followed_um).zip(still_um);
        for (((_, read), followed_um), still_um) in ends {
            let moved_um = followed_um - still_um;
            if let Some((row, deviation_um)) = read.filter(|_| moved_um.is_finite()) {
                standardised[row] = moved_um / deviation_um;
            }
        }
    }

    /// Where a plate is at the end of each interval (um), whose actuators go straight from one reading of these standardised residuals to the
    /// next.
    fn followed(&self, plate: &Active, standardised: &[f64]) -> Vec<f64> {
        let Active { effect, values, .. } = plate;
        let moment = Moment::default();
        let mut states = vec![0.0; effect.states()];
        let mut from = 0.0;
        let follow = |&(duration_s, read): &(f64, Option<(usize, f64)>)| {
            let to = read.map_or(from, |(row, deviation_um)| standardised[row] * deviation_um);
            if duration_s > 0.0 {
                let step = Step {
                    from,
                    to,
                    duration_s,
                    moment,
                };
                effect.advance(values, &mut states, &step);
            }
            from = to;
            effect.output(values, to, &states, &moment)
        };
        self.intervals.iter().map(follow).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_model::effect::{Formula, find};
    use mirror_model::{ACTUATORS, Interval, Preset};
    use nalgebra::DMatrix;
    use std::sync::Arc;

    /// A model whose plate rings at 1 kHz, Q 10.
    fn ringing() -> Model {
        let mut plate = Active::usual(find("resonance").expect("built in"));
        plate.values = vec![1.0, 1000.0, 10.0];
        let mut model = Model::from(Preset::Paper);
        model.effects.push(plate);
        model
    }

    /// What is left of one mirror: 1 um from the first 10 us after a jump of the drive on, read every 10 us for half a period.
    fn left() -> (NullEnsemble, Dataset) {
        let reads = (0..50).map(|_| Interval::held([2.0; ACTUATORS], 1e-5));
        let mut data = Dataset::driven([(0.0, 1.0)]);
        data.intervals.extend(reads);
        let data = data.read_at_each(&[(Channel::Displacement, 0.02)]);
        let of = |o: &identification::dataset::Observation| match o.interval {
            0 => 0.0,
            _ => 1.0 / standard_deviation(o),
        };
        let residuals = DMatrix::from_iterator(51, 1, data.observations.iter().map(of));
        let ensemble = NullEnsemble {
            residuals,
            coordinates: DMatrix::zeros(0, 1),
        };
        (ensemble, data)
    }

    #[test]
    fn what_is_left_behind_a_jump_rings_with_the_plate() {
        let (ensemble, data) = left();
        let moved = ensemble.moving_as(&ringing(), &data);
        let last = data.observations.last().expect("a reading");
        let um = moved.residuals()[(50, 0)] * standard_deviation(last);
        // Half a period after a step: 1 + exp(-pi / 2Q), less what a step that takes 10 us of 1 ms is no step, (pi / 100)^2.
        assert!(
            (um - 1.0 - (-std::f64::consts::PI / 20.0).exp()).abs() < 2e-3,
            "{um}"
        );
    }

    /// Formulas of a user's: one adds what is no error, one looks at a drive, of which nothing is known here.
    #[test]
    fn what_a_formula_adds_is_no_error_of_the_base() {
        for formula in ["x + q", "x + x * q / V"] {
            let text = format!(
                "id = \"mine\"\ntitle = \"mine\"\nstage = \"motion\"\nacts = \"motion\"\nformula = \"{formula}\"\n\
                 shows = \"\"\nseparates = \"\"\nsource = \"\"\n[[parameters]]\nsymbol = \"q\"\nunit = \"um\"\nstart = 0.3\n\
                 low = 0.0\nhigh = 1.0\n"
            );
            let mine = Formula::parse("mine.toml", &text).expect("a formula");
            let mut model = Model::from(Preset::Paper);
            model.effects.push(Active::usual(Arc::new(mine)));
            let (ensemble, data) = left();
            let before = ensemble.residuals().clone();
            let off = ensemble.moving_as(&model, &data).residuals - before;
            // Rounding of 0.3 um and a reading.
            assert!(off.amax() < 1e-12, "{formula}: {off}");
        }
    }

    #[test]
    fn without_an_effect_on_the_motion_nothing_changes() {
        let (ensemble, data) = left();
        let before = ensemble.residuals().clone();
        let moved = ensemble.moving_as(&Model::from(Preset::Paper), &data);
        assert_eq!(moved.residuals(), &before);
    }
}
