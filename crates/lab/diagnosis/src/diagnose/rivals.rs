//! Which effects cannot be told from the best one: by their scores, by the misfit they leave, and by what a model with them leaves of the readings.

use super::analysis::Analysis;
use super::suspects::{FAR_SMALLER, least_of};
use crate::candidate::Candidate;
use crate::confusions::{RIVAL_SHARE, confusions};
use crate::null_distribution::CONFIDENCE;
use identification::dataset::Channel;
use identification::fit::Fitted;

/// What base and effect leave when they are fitted together.
#[derive(Clone, Copy)]
struct Left {
    /// The sum of squares that the fit minimises.
    total: f64,
    /// The part of it that the displacements leave, and that of the currents. What one of them tells is lost in the sum where the noise of the
    /// other is most of it.
    of_channels: [f64; 2],
}

impl Left {
    fn is_far_less_than(&self, other: &Self) -> bool {
        self.total < FAR_SMALLER * other.total
    }

    /// The same in all, or in the displacements or the currents alone, and no more in all.
    fn refutes(&self, other: &Self) -> bool {
        let mut channels = self.of_channels.iter().zip(&other.of_channels);
        let is_far_less = channels.any(|(own, other)| *own < FAR_SMALLER * other);
        self.total < other.total && (is_far_less || self.is_far_less_than(other))
    }

    /// Whether it is as little, in the displacements and in the currents: forms that differ by so much are no evidence.
    fn is_as_little_as(&self, other: &Self) -> bool {
        let mut channels = self.of_channels.iter().zip(&other.of_channels);
        channels.all(|(own, other)| RIVAL_SHARE * own <= *other)
    }
}

/// What rivals are told by.
struct Rules<'a> {
    /// Which part of the best one's score makes a candidate a rival of it.
    share: &'a dyn Fn(&str, &str) -> f64,
    /// Whether a candidate leaves no more of the misfit than mirrors that lack nothing do.
    explains: &'a dyn Fn(&Candidate) -> bool,
    /// What it leaves at most, where it was fitted together with the base: a fit that explains less than slopes do may have stopped early.
    at_most: &'a dyn Fn(&Candidate) -> Option<Left>,
    /// The same, where that fit explains most: what it leaves speaks against it, too.
    left: &'a dyn Fn(&Candidate) -> Option<Left>,
    /// Whether a model with it follows the readings so closely that they show no discrepancy.
    is_followed_closely: &'a dyn Fn(&Candidate) -> bool,
}

impl Analysis<'_> {
    /// The best of these candidates above their thresholds, and its rivals.
    pub(super) fn rivals<'c>(&self, candidates: &[&'c Candidate]) -> Vec<&'c Candidate> {
        let rules = Rules {
            share: &|candidate, best| confusions().rival_share(self.channels(), candidate, best),
            explains: &|candidate| self.null.explains(self.misfit, candidate.score().max(0.0)),
            at_most: &|candidate| Some(self.left(&candidate.together()?.fitted)),
            left: &|candidate| Some(self.left(&candidate.refit.as_ref()?.fitted)),
            is_followed_closely: &|candidate| {
                let fitted = candidate.together().map(|refit| &refit.fitted);
                fitted.is_some_and(|fitted| self.is_followed_closely(fitted))
            },
        };
        rules.rivals(candidates)
    }

    fn left(&self, fitted: &Fitted) -> Left {
        let standardised = fitted.standardised(self.data);
        let mut of_channels = [0.0; 2];
        for (residual, read) in standardised.iter().zip(&self.data.observations) {
            let of_it = match read.channel {
                Channel::Displacement => &mut of_channels[0],
                Channel::Current(_) => &mut of_channels[1],
            };
            *of_it += residual.powi(2);
        }
        Left {
            total: fitted.cost(self.data),
            of_channels,
        }
    }

    /// Whether a model leaves less than 95 in 100 mirrors that lack nothing leave of the base: the lumped equations are this mirror's, and what scores
    /// allow for the discrepancy is not there.
    fn is_followed_closely(&self, with: &Fitted) -> bool {
        let left = self.rms(&with.standardised(self.data), self.unit());
        left.value < self.discrepancy_at(1.0 - CONFIDENCE).value
    }
}

impl Rules<'_> {
    /// The best of the candidates above their thresholds, and those that come near it, above their own thresholds or not: once it is evident that
    /// something is missing, the scores alone say what. Of those that come near it, one that leaves far more than another is none: a discrepancy of one
    /// kind, however large, costs a score little.
    ///
    /// Of the others above their thresholds, one that leaves far less than the best is a rival: what the discrepancy could explain as well
    /// may be the effect. So is one that leaves as little as a best one that leaves no room for a discrepancy: then a score is less for what is not there. Neither
    /// is, where the best explains the misfit, and it does not.
    fn rivals<'c>(&self, candidates: &[&'c Candidate]) -> Vec<&'c Candidate> {
        let mut above = candidates.iter().filter(|c| c.is_above_its_threshold());
        let Some(best) = above.next() else {
            return Vec::new();
        };
        let top = best.score();
        let is_near = |c: &Candidate| c.score() > least_of((self.share)(c.id(), best.id()), top);
        let near = candidates.iter().filter(|c| is_near(c));
        let near: Vec<Left> = near.filter_map(|c| (self.at_most)(c)).collect();
        let is_refuted = |c: &Candidate| {
            let left = (self.left)(c);
            left.is_some_and(|left| near.iter().any(|other| other.refutes(&left)))
        };
        let is_explained = (self.explains)(best);
        let of_best = (self.left)(best);
        // One that stopped early is not close.
        let of_close_best = (self.at_most)(best).filter(|_| (self.is_followed_closely)(best));
        let leaves_little = |own: Left| {
            of_best.is_some_and(|of_best| own.is_far_less_than(&of_best))
                || of_close_best.is_some_and(|of_best| own.is_as_little_as(&of_best))
        };
        let is_told_by_its_error = |c: &Candidate| {
            (self.at_most)(c).is_some_and(leaves_little)
                && c.is_above_its_threshold()
                && (!is_explained || (self.explains)(c))
        };
        let is_rival = |c: &&Candidate| (is_near(c) || is_told_by_its_error(c)) && !is_refuted(c);
        candidates.iter().copied().filter(is_rival).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::suspects::ids;
    use super::*;
    use crate::candidate::scored;

    /// What is left, all of it in the displacements.
    fn left(total: f64) -> Left {
        Left {
            total,
            of_channels: [total, 0.0],
        }
    }

    /// Who are rivals, where nothing is known but the scores.
    fn by_scores() -> Rules<'static> {
        Rules {
            share: &|_, _| RIVAL_SHARE,
            explains: &|_| true,
            at_most: &|_| None,
            left: &|_| None,
            is_followed_closely: &|_| false,
        }
    }

    fn rivals(rules: &Rules, candidates: &[Candidate]) -> Vec<String> {
        let all: Vec<_> = candidates.iter().collect();
        ids(&rules.rivals(&all))
    }

    #[test]
    fn rivals_come_near_the_best_score() {
        let candidates = [
            scored("creep", 1000.0),
            scored("hysteresis", 930.0),
            scored("resonance", 910.0),
            scored("sensor-lag", 700.0),
        ];
        assert_eq!(rivals(&by_scores(), &candidates), ["creep", "hysteresis"]);
        // What was taken for the best one is its rival from further off.
        let learned = Rules {
            share: &|candidate, best| {
                assert_eq!(best, "creep");
                if candidate == "sensor-lag" { 0.6 } else { 0.92 }
            },
            ..by_scores()
        };
        assert_eq!(
            rivals(&learned, &candidates),
            ["creep", "hysteresis", "sensor-lag"]
        );
        assert!(rivals(&by_scores(), &[]).is_empty());
    }

    #[test]
    fn who_leaves_far_less_is_a_rival_whatever_the_score() {
        let candidates = [
            scored("heat-loss-temperature", 1000.0),
            scored("radiation", 500.0),
        ];
        let count = |radiation: f64| {
            let of_radiation = |c: &Candidate| c.id() == "radiation";
            let left = |c: &Candidate| Some(left(if of_radiation(c) { radiation } else { 100.0 }));
            let rules = Rules {
                at_most: &left,
                left: &left,
                ..by_scores()
            };
            rivals(&rules, &candidates).len()
        };
        assert_eq!([count(40.0), count(60.0)], [2, 1]);
    }

    #[test]
    fn who_leaves_little_of_the_readings_and_much_of_the_misfit_is_no_rival_of_one_that_explains_it()
     {
        let candidates = [
            scored("hysteresis", 57000.0),
            scored("expansion-temperature", 18000.0),
        ];
        let count = |of_both_explain: [bool; 2]| {
            let is_hysteresis = |c: &Candidate| c.id() == "hysteresis";
            let left = |c: &Candidate| Some(left(if is_hysteresis(c) { 100.0 } else { 20.0 }));
            let rules = Rules {
                at_most: &left,
                left: &left,
                explains: &|c| of_both_explain[usize::from(!is_hysteresis(c))],
                ..by_scores()
            };
            rivals(&rules, &candidates).len()
        };
        assert_eq!(count([true, false]), 1);
        assert_eq!(count([true, true]), 2);
        assert_eq!(count([false, false]), 2);
    }

    #[test]
    fn who_leaves_as_little_where_no_discrepancy_shows_is_a_rival_whatever_the_score() {
        let candidates = [
            scored("heat-loss-temperature", 280.0),
            scored("gap-heat-loss", 146.0),
        ];
        let count = |of_gap: [f64; 2], is_close: bool| {
            let is_gap = |c: &Candidate| c.id() == "gap-heat-loss";
            let rules = Rules {
                at_most: &|c| {
                    let of_channels = if is_gap(c) { of_gap } else { [100.0, 1000.0] };
                    Some(Left {
                        total: of_channels.iter().sum(),
                        of_channels,
                    })
                },
                is_followed_closely: &|_| is_close,
                ..by_scores()
            };
            rivals(&rules, &candidates).len()
        };
        assert_eq!(count([105.0, 1000.0], true), 2);
        assert_eq!(count([105.0, 1000.0], false), 1);
        // Clearly more of the displacements, though not in all.
        assert_eq!(count([140.0, 1000.0], true), 1);
    }

    #[test]
    fn who_leaves_far_more_than_another_that_comes_as_near_is_no_rival() {
        let candidates = [
            scored("thermal-lag", 1000.0),
            scored("substrate-warming", 990.0),
            scored("creep", 980.0),
        ];
        let at_most = |c: &Candidate| match c.id() {
            "thermal-lag" => Some(left(100.0)),
            "substrate-warming" => Some(left(40.0)),
            _ => Some(left(90.0)),
        };
        // Creep's fit stopped before it explained what slopes do: nobody knows.
        let is_at_its_end = |c: &Candidate| c.id() != "creep";
        let rules = Rules {
            at_most: &at_most,
            left: &|c| at_most(c).filter(|_| is_at_its_end(c)),
            ..by_scores()
        };
        assert_eq!(rivals(&rules, &candidates), ["substrate-warming", "creep"]);
    }

    #[test]
    fn a_best_one_whose_fit_stopped_early_has_no_rival_that_leaves_less() {
        let candidates = [
            scored("end-stop", 2388.0),
            scored("sensor-nonlinearity", 1305.0),
        ];
        let is_best = |c: &Candidate| c.id() == "end-stop";
        let rules = Rules {
            at_most: &|c| Some(left(if is_best(c) { 15100.0 } else { 7206.0 })),
            ..by_scores()
        };
        assert_eq!(rivals(&rules, &candidates), ["end-stop"]);
    }

    #[test]
    fn what_displacements_refute_the_noise_of_the_currents_does_not_hide() {
        let left = |displacements, currents| Left {
            total: displacements + currents,
            of_channels: [displacements, currents],
        };
        let lag = left(22.0, 400.0);
        assert!(lag.refutes(&left(110.0, 400.0)));
        assert!(!lag.refutes(&left(40.0, 400.0)));
        // Each leaves more of something: neither refutes the other.
        assert!(!lag.refutes(&left(110.0, 300.0)));
        assert!(!left(110.0, 300.0).refutes(&lag));
    }

    #[test]
    fn what_comes_near_is_a_rival_below_its_threshold_too() {
        // 25 is the threshold of both; of what is below it nobody is the first.
        let needing_25 = |id, score| Candidate {
            threshold: 25.0,
            ..scored(id, score)
        };
        let candidates = [
            needing_25("gap-heat-loss", 27.0),
            needing_25("radiation", 24.0),
        ];
        assert_eq!(rivals(&by_scores(), &candidates).len(), 2);
        assert!(rivals(&by_scores(), &candidates[1..]).is_empty());
    }

    #[test]
    fn small_scores_are_rivals_within_a_margin() {
        // 92 % of 50 is 46, and 12 below it is 38.
        let candidates = [
            scored("creep", 50.0),
            scored("hysteresis", 39.0),
            scored("resonance", 37.0),
        ];
        assert_eq!(rivals(&by_scores(), &candidates), ["creep", "hysteresis"]);
    }
}
