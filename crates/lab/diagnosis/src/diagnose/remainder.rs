//! An effect that takes most of the error and leaves a part of it: what is left, and from which drive on.

use super::analysis::Analysis;
use crate::candidate::Candidate;
use crate::report::{Remainder, Rms};
use identification::Unit;
use mirror_model::ACTUATORS;

/// An effect takes most of an error that falls by this part of itself or more: a choice, for people.
const MOST: f64 = 0.8;
/// Up to a drive the effect explains the readings where these are left by no more than so many standard deviations, root mean
/// square; and there are so many of them.
const LIKE_NOISE: f64 = 2.0;
const READINGS: usize = 10;

impl Analysis<'_> {
    /// What is left of an effect that takes most of the error; none where it does not.
    pub(super) fn remainder_of(&self, best: &Candidate) -> Option<Remainder> {
        let explanation = best.explanation.as_ref()?;
        let refit = best.refit.as_ref()?;
        let falls = |unit: Unit| {
            let errors = self.before_and_after(best, explanation, unit);
            errors.before == 0.0 || errors.fall() >= MOST
        };
        let takes_most = [Unit::Micrometre, Unit::Milliampere].into_iter().all(falls);
        let on_others = self.held_out(best, explanation, self.unit());
        (takes_most && on_others.fall() >= MOST).then(|| {
            let left = refit.fitted.standardised(self.data);
            let Rms { value, unit } = self.rms(&left, self.unit());
            Remainder {
                rms: Rms { value, unit },
                up_to_v: self.explained_up_to(left.as_slice()),
            }
        })
    }

    fn explained_up_to(&self, left: &[f64]) -> Option<f64> {
        let highest = |volts: [f64; ACTUATORS]| volts.into_iter().fold(0.0, f64::max);
        let drives = self.data.observations.iter().map(|o| self.data.drive(o));
        like_noise_up_to(drives.map(highest).zip(left.iter().copied()).collect())
    }
}

/// The highest drive up to which what is left is like noise, if it is not at all drives (V). Of each reading the highest drive
/// (V), and what is left of it in standard deviations.
fn like_noise_up_to(mut readings: Vec<(f64, f64)>) -> Option<f64> {
    readings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut sum, mut up_to) = (0.0, None);
    for (index, &(volts, off)) in readings.iter().enumerate() {
        sum += off * off;
        let count = (index + 1) as f64;
        let is_last_at_it = readings.get(index + 1).is_none_or(|next| next.0 > volts);
        if is_last_at_it && index + 1 >= READINGS && sum <= LIKE_NOISE.powi(2) * count {
            up_to = Some(volts);
        }
    }
    up_to.filter(|volts| readings.last().is_some_and(|last| *volts < last.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five readings at each of these drives, which leave so much.
    fn readings(left: &[(f64, f64)]) -> Vec<(f64, f64)> {
        left.iter().flat_map(|&reading| [reading; 5]).collect()
    }

    #[test]
    fn what_is_left_from_a_drive_on_is_told() {
        let left = readings(&[(3.0, 9.0), (1.0, 1.0), (2.0, -1.0)]);
        // At 3 V the mean square of all is (10 + 5 * 81) / 15, above 4.
        assert_eq!(like_noise_up_to(left), Some(2.0));
    }

    #[test]
    fn what_is_like_noise_everywhere_has_no_such_drive() {
        assert_eq!(
            like_noise_up_to(readings(&[(1.0, 1.0), (2.0, 1.0), (3.0, 1.9)])),
            None
        );
    }

    #[test]
    fn what_is_left_everywhere_has_none_either() {
        assert_eq!(
            like_noise_up_to(readings(&[(1.0, 5.0), (2.0, 5.0), (3.0, 5.0)])),
            None
        );
    }

    #[test]
    fn a_handful_of_readings_tells_nothing() {
        // Five below, where ten are asked for.
        assert_eq!(like_noise_up_to(readings(&[(1.0, 0.0), (2.0, 9.0)])), None);
        assert_eq!(like_noise_up_to(Vec::new()), None);
    }
}
