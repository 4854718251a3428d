//! An effect that takes most of the error and leaves a part of it: what is left, and from which drive on.

use super::analysis::Analysis;
use super::suspects::FAR_SMALLER;
use crate::candidate::Candidate;
use crate::report::Remainder;
use identification::Unit;
use identification::fit::Precision;
use mirror_model::ACTUATORS;

/// An effect takes most of an error that falls by this part of itself or more: a choice, for people.
const MOST: f64 = 0.75;
/// Up to a drive the effect explains the readings where these are left by no more than so many standard deviations, root mean
/// square; and there are so many of them.
const LIKE_NOISE: f64 = 2.0;
const READINGS: usize = 10;

impl Analysis<'_> {
    /// Whether an effect, fitted together with the base, takes most of every error, on readings held out too.
    pub(super) fn takes_most(&self, effect: &Candidate) -> bool {
        let Some(explanation) = effect
            .explanation
            .as_ref()
            .filter(|_| effect.refit.is_some())
        else {
            return false;
        };
        let falls = |unit: Unit| {
            let errors = self.before_and_after(effect, explanation, unit);
            errors.before == 0.0 || errors.fall() >= MOST
        };
        let takes_most = [Unit::Micrometre, Unit::Milliampere].into_iter().all(falls);
        takes_most && self.held_out(effect, explanation, self.unit()).fall() >= MOST
    }

    /// Which of these effects takes most of the error, where none of the others leaves about as little. Of several effects at once one
    /// that the discrepancy cannot hold scores most, be it small, and not the one that the error is of. So scores do not tell, and
    /// neither do slopes, which miss what a strong effect does to the base. An error that mirrors that lack nothing have, too, is the
    /// discrepancy's, of which some effect takes most in many of them.
    pub(super) fn the_one_that_takes_most(&self, evident: &[&Candidate]) -> Option<String> {
        if !self.errs_more_than_its_discrepancy() {
            return None;
        }
        let fitted = parallel::filter_map(evident, |effect| self.fitted_anew(effect));
        let left = fitted.iter().filter_map(|effect| effect.refit.as_ref());
        let left: Vec<f64> = left.map(|refit| refit.fitted.cost(self.data)).collect();
        let one = &fitted[far_below_the_others(&left)?];
        (self.follows_with(one) && self.takes_most(one)).then(|| one.id().to_owned())
    }

    /// The same effect fitted together with the base, whatever slopes explain.
    fn fitted_anew(&self, effect: &Candidate) -> Option<Candidate> {
        let explanation = effect.explanation.clone()?;
        let start = std::slice::from_ref(&self.fitted.model);
        let (_, refit) = self.refitted(&explanation.active, start, Precision::Fine)?;
        Some(Candidate {
            explanation: Some(explanation),
            refit: Some(refit),
            ..Candidate::new(effect.effect.clone(), Vec::new())
        })
    }

    /// What an effect that takes most of the error leaves of it; or one that is named for its score, where that is more than 95 in 100 mirrors
    /// leave that lack nothing, or where it explains the misfit with a second one only.
    pub(super) fn left_of(&self, effect: &Candidate, takes_most: bool) -> Option<Remainder> {
        let standardised = effect.refit.as_ref()?.fitted.standardised(self.data);
        let left = Remainder {
            rms: self.rms(&standardised, self.unit()),
            is_the_lesser_part: takes_most,
            up_to_v: self.explained_up_to(standardised.as_slice()),
        };
        let is_much = left.rms.value > (1.0 - MOST) * self.error().value
            && left.rms.value > self.large_discrepancy().value;
        let needs_a_second = !self.null.explains(self.misfit, effect.score());
        (takes_most || is_much || needs_a_second).then_some(left)
    }

    fn explained_up_to(&self, left: &[f64]) -> Option<f64> {
        let highest = |volts: [f64; ACTUATORS]| volts.into_iter().fold(0.0, f64::max);
        let drives = self.data.observations.iter().map(|o| self.data.drive(o));
        like_noise_up_to(drives.map(highest).zip(left.iter().copied()).collect())
    }
}

/// Which of these sums of squares is far below all others, if any is.
fn far_below_the_others(left: &[f64]) -> Option<usize> {
    let (least, lowest) = left.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1))?;
    let is_above = |(index, &other): (usize, &f64)| index == least || *lowest < FAR_SMALLER * other;
    left.iter().enumerate().all(is_above).then_some(least)
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
    fn one_takes_most_where_no_other_leaves_about_as_little() {
        assert_eq!(far_below_the_others(&[10.0, 3.0, 7.0]), Some(1));
        assert_eq!(far_below_the_others(&[10.0, 3.0, 5.0]), None);
        assert_eq!(far_below_the_others(&[10.0]), Some(0));
        assert_eq!(far_below_the_others(&[]), None);
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
