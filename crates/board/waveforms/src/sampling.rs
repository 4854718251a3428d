//! Which control ticks are sampled.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Ask for telemetry: `count` samples, one every `period_ticks` control ticks.
///
/// A new request replaces the one before; `count` 0 stops. A stream always ends by itself, so a tool
/// that dies leaves no board talking.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Stream {
    /// Control ticks from one sample to the next, at least 1.
    pub period_ticks: u16,
    /// Samples to send.
    pub count: u32,
    /// Currents and sensor are the mean of so many ticks up to the sample, as far as the one before;
    /// 0 and 1 take the tick alone.
    pub mean_ticks: u16,
    /// 0 for an even pace. Otherwise every step of the setpoint is sampled at once and densely, and
    /// then ever more slowly: each sample waits for at least this part, 1/`slowing`, of the time since
    /// the step.
    pub slowing: u16,
}

/// Picks the ticks that a stream asked for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pacer {
    stream: Stream,
    samples_left: u32,
    /// Ticks until the next sample; 0 is now.
    wait: u32,
    since_step: u32,
}

/// What a tick is to a stream.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Due {
    /// It counts for the mean of the next sample.
    pub counts: bool,
    /// It is a sample.
    pub sample: bool,
}

impl Pacer {
    /// A stream whose first sample is the next tick.
    pub fn new(stream: Stream) -> Self {
        Self {
            stream,
            samples_left: stream.count,
            wait: 0,
            since_step: 0,
        }
    }

    /// Whether no sample will come any more.
    pub fn is_over(&self) -> bool {
        self.samples_left == 0
    }

    /// What this tick is. `steps`: the setpoint jumped with it.
    pub fn tick(&mut self, steps: bool) -> Due {
        if self.samples_left == 0 {
            return Due::default();
        }
        if steps && self.stream.slowing > 0 {
            self.since_step = 0;
            self.wait = 0;
        }
        let sample = self.wait == 0;
        let counts = sample || self.wait < u32::from(self.stream.mean_ticks);
        if sample {
            self.samples_left -= 1;
            let slowed = match self.stream.slowing {
                0 => 0,
                slowing => self.since_step / u32::from(slowing),
            };
            self.wait = slowed.max(u32::from(self.stream.period_ticks)).max(1);
        }
        self.wait -= 1;
        self.since_step = self.since_step.saturating_add(1);
        Due { counts, sample }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn sampled(stream: Stream, ticks: usize, steps: &[usize]) -> (Vec<usize>, usize) {
        let mut pacer = Pacer::new(stream);
        let due: Vec<Due> = (0..ticks)
            .map(|tick| pacer.tick(steps.contains(&tick)))
            .collect();
        let samples = (0..ticks).filter(|&tick| due[tick].sample).collect();
        (samples, due.iter().filter(|due| due.counts).count())
    }

    proptest! {
        #[test]
        fn an_even_stream_has_its_period_its_count_and_its_mean(
            period_ticks in 1_u16..100, count in 1_u32..50, mean_ticks in 0_u16..150,
        ) {
            let stream = Stream { period_ticks, count, mean_ticks, slowing: 0 };
            let (samples, counted) = sampled(stream, 10_000, &[17, 300]);
            prop_assert_eq!(samples.len(), count as usize);
            for (index, tick) in samples.iter().enumerate() {
                prop_assert_eq!(*tick, index * usize::from(period_ticks));
            }
            let window = usize::from(mean_ticks.clamp(1, period_ticks));
            prop_assert_eq!(counted, 1 + (count as usize - 1) * window);
        }

        #[test]
        fn a_slowing_stream_follows_every_step_densely_and_ends(
            period_ticks in 1_u16..20, slowing in 1_u16..40, step in 100_usize..5000,
        ) {
            let stream = Stream { period_ticks, count: 100_000, mean_ticks: 1, slowing };
            let (samples, _) = sampled(stream, 10_000, &[step]);
            prop_assert!(samples.contains(&step));
            let (period, slowing) = (usize::from(period_ticks), usize::from(slowing));
            for pair in samples.windows(2) {
                let since = if pair[0] >= step { pair[0] - step } else { pair[0] };
                let expected = (since / slowing).max(period);
                prop_assert!(pair[1] == pair[0] + expected || pair[1] == step);
            }
        }
    }

    #[test]
    fn no_samples_are_asked_for_by_default() {
        assert_eq!(sampled(Stream::default(), 100, &[50]).0, []);
    }
}
