//! How far measurements have come, and how much is left, in the board's time: it is known beforehand, whatever takes how
//! many samples, and is the wall's in front of a real board.

use std::fmt::Write;

use experiments::Experiment;
use indicatif::{ProgressBar, ProgressState, ProgressStyle};

use crate::verbosity::{note, say};
use crate::working::bar;

/// A bar for one experiment after the other, or for all of a plan.
pub(super) struct Progress {
    /// In milliseconds of the board's time.
    bar: ProgressBar,
    /// What is still to come of the plan, and when the present experiment began and will end in it.
    planned_ms: u64,
    began_ms: u64,
    end_ms: u64,
}

impl Progress {
    pub(super) fn new(quiet: bool) -> Self {
        let bar = bar(0, quiet);
        let style = ProgressStyle::with_template("{msg:<12} {wide_bar} {percent:>3} % {left}");
        let left = |state: &ProgressState, out: &mut dyn Write| {
            let left_ms = state.len().unwrap_or_default().saturating_sub(state.pos());
            let _ = out.write_str(&left_words(left_ms));
        };
        bar.set_style(style.expect("a fixed template").with_key("left", left));
        Self {
            bar,
            planned_ms: 0,
            began_ms: 0,
            end_ms: 0,
        }
    }

    /// These experiments are to come: the bar is for all of them.
    pub(super) fn plan(&mut self, experiments: &[Experiment]) {
        self.planned_ms = experiments.iter().map(duration_ms).sum();
        self.start(self.planned_ms);
    }

    /// An experiment begins: the next of the plan, or one for itself.
    pub(super) fn begin(&mut self, experiment: &Experiment) {
        let duration_ms = duration_ms(experiment);
        if self.planned_ms < duration_ms {
            self.planned_ms = duration_ms;
            self.start(duration_ms);
        }
        self.planned_ms -= duration_ms;
        self.began_ms = self.end_ms;
        self.end_ms += duration_ms;
        self.bar.set_position(self.began_ms);
        self.bar.set_message(experiment.name.clone());
    }

    fn start(&mut self, length_ms: u64) {
        self.end_ms = 0;
        self.bar.reset();
        self.bar.set_length(length_ms);
    }

    /// The present experiment has come so far (s).
    pub(super) fn reach(&self, passed_s: f64) {
        let now_ms = self.began_ms + milliseconds(passed_s);
        self.bar.set_position(now_ms.min(self.end_ms));
    }

    /// Prints something above the bar.
    pub(super) fn say(&self, words: &str) {
        self.bar.suspend(|| note(words));
    }

    /// Prints something above the bar that is said in any case.
    pub(super) fn warn(&self, words: &str) {
        self.bar.suspend(|| say(words));
    }

    /// The bar disappears until the next experiment.
    pub(super) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

fn duration_ms(experiment: &Experiment) -> u64 {
    milliseconds(experiment.duration_s())
}

fn milliseconds(s: f64) -> u64 {
    (1e3 * s).round() as u64
}

/// Seconds, or minutes and seconds, rounded up.
fn left_words(left_ms: u64) -> String {
    let s = left_ms.div_ceil(1000);
    match s / 60 {
        0 => format!("{s} s left"),
        min => format!("{min} min {} s left", s % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn where_it_is(progress: &Progress) -> (u64, Option<u64>) {
        (progress.bar.position(), progress.bar.length())
    }

    #[test]
    fn an_experiment_for_itself_goes_from_its_start_to_its_end() {
        let mut progress = Progress::new(true);
        for _ in 0..2 {
            // 8 s of few samples, after 2 s of rest.
            let sine = Experiment::sine(1.0, 0.5, 0.125, 1).after(2.0);
            let whole_ms = milliseconds(sine.duration_s());
            progress.begin(&sine);
            assert_eq!(where_it_is(&progress), (0, Some(whole_ms)));
            progress.reach(2.0);
            assert_eq!(where_it_is(&progress), (2000, Some(whole_ms)));
            progress.reach(1e3);
            assert_eq!(where_it_is(&progress), (whole_ms, Some(whole_ms)));
        }
    }

    #[test]
    fn a_plan_is_gone_through_once() {
        let mut progress = Progress::new(true);
        let steps = [1.0, 2.0, 3.0].map(|hold_s| Experiment::step(2.0, hold_s, 1e3).after(0.5));
        let [first_ms, second_ms, third_ms] = steps.each_ref().map(duration_ms);
        let whole_ms = first_ms + second_ms + third_ms;
        progress.plan(&steps);
        assert_eq!(where_it_is(&progress), (0, Some(whole_ms)));
        let mut before_ms = 0;
        for (step, ms) in steps.iter().zip([first_ms, second_ms, third_ms]) {
            progress.begin(step);
            assert_eq!(where_it_is(&progress), (before_ms, Some(whole_ms)));
            progress.reach(0.25);
            assert_eq!(where_it_is(&progress), (before_ms + 250, Some(whole_ms)));
            before_ms += ms;
        }
        progress.begin(&steps[0]);
        assert_eq!(
            where_it_is(&progress),
            (0, Some(first_ms)),
            "one beyond the plan"
        );
    }

    #[test]
    fn what_is_left_is_told_in_minutes_and_seconds() {
        assert_eq!(left_words(0), "0 s left");
        assert_eq!(left_words(7_001), "8 s left");
        assert_eq!(left_words(60_000), "1 min 0 s left");
        assert_eq!(left_words(312_000), "5 min 12 s left");
    }
}
