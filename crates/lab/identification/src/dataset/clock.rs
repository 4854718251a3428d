//! Which files of a session share a clock, and what that means for the displacement's zero.

use super::observation::{Channel, Observation};
use measurement::MeasurementFile;
use std::ops::Range;

/// Rest at 0 V assumed between files that share no clock (s; `docs/reference/measurement-files.md`): longer than all that the base
/// remembers.
const REST_S: f64 = 60.0;
/// What is shorter is a clock's rounding, in hundredths of a second at the coarsest: no pause between two rows (s). Files whose times
/// overlap by more share no clock, whatever they say: one mirror is in one experiment at a time.
pub(super) const ROUNDING_S: f64 = 0.02;

/// The clock of a session's files, as they are added one after the other.
#[derive(Default)]
pub(super) struct Clock<'a> {
    before: Option<&'a MeasurementFile>,
    /// End of the file before, and where the present clock's 0 lies, since the dataset's start.
    pub(super) end_s: f64,
    pub(super) origin_s: f64,
    /// The present clock's first experiment, and whether anything but the drive moved the mirror on it.
    pub(super) first: usize,
    pub(super) moved: bool,
}

impl<'a> Clock<'a> {
    /// When a file begins, and whether it begins another clock.
    pub(super) fn start(&mut self, file: &'a MeasurementFile) -> (f64, bool) {
        let row = file.rows[0];
        let on_clock = row.t_global_s.map(|global| global - row.t_s.max(0.0));
        let continues = self.before.is_none_or(|before| file.shares_clock(before));
        let before = self.before.replace(file);
        match on_clock.map(|start| self.origin_s + start) {
            Some(start) if continues && start > self.end_s - ROUNDING_S => (start, false),
            _ => {
                let start = self.end_s + REST_S;
                self.origin_s = start - on_clock.unwrap_or(0.0);
                (start, before.is_some())
            }
        }
    }
}

/// Experiments on a clock that is not the session's first one, in other surroundings or with the target moved by a stage.
/// Between the clocks nobody knows where the sensor stood: they are compared about their mean.
#[derive(Clone, Debug)]
pub struct OwnZero {
    experiments: Range<usize>,
    /// The mean of what was measured.
    pub(super) measured_um: f64,
}

impl OwnZero {
    /// Of these experiments, from the numbers that were measured in them.
    pub fn new(experiments: Range<usize>, observations: &[Observation]) -> Self {
        let mut zero = Self {
            experiments,
            measured_um: 0.0,
        };
        let measured: Vec<f64> = observations.iter().map(|o| o.value).collect();
        zero.measured_um = zero.mean_um(&measured, observations);
        zero
    }

    /// The same experiments, as if every displacement had read 0.
    pub fn unread(&self) -> Self {
        Self {
            experiments: self.experiments.clone(),
            measured_um: 0.0,
        }
    }

    /// Whether this observation counts from it.
    pub fn is_of(&self, o: &Observation) -> bool {
        o.channel == Channel::Displacement && self.experiments.contains(&o.experiment)
    }

    /// The mean of its share of numbers like the observations.
    pub(super) fn mean_um(&self, numbers: &[f64], observations: &[Observation]) -> f64 {
        let own = numbers
            .iter()
            .zip(observations)
            .filter(|(_, o)| self.is_of(o));
        let (sum, count) = own.fold((0.0, 0usize), |(sum, count), (number, _)| {
            (sum + number, count + 1)
        });
        sum / count.max(1) as f64
    }
}
