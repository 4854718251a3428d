//! The samples of a stream: currents and a position sensor, or their means over some ticks.

use crate::mean::Mean;
use crate::sampling::{Pacer, Stream};

/// What a tick reads.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Current of each channel (A).
    pub current_a: [f32; 4],
    /// A position sensor (um), where it read anything.
    pub sensor_z_um: Option<f32>,
}

/// Makes the samples that a stream asked for.
///
/// Where a sample is the mean of three ticks or more, a reading of the sensor that stands alone bears no weight in it: each
/// is the median of three that follow each other (Tukey's running median).
#[derive(Clone, Copy, Debug, Default)]
pub struct Sampler {
    pacer: Pacer,
    is_robust: bool,
    mean: Mean<5>,
    /// The sensor's last readings since the last sample, the newest at the end.
    lately_um: [Option<f32>; MEDIAN_OF],
}

/// Readings of which the median is taken.
const MEDIAN_OF: usize = 3;

impl Sampler {
    /// The first sample is the next tick.
    pub fn new(stream: Stream) -> Self {
        Self {
            pacer: Pacer::new(stream),
            is_robust: usize::from(stream.mean_ticks.min(stream.period_ticks)) >= MEDIAN_OF,
            ..Self::default()
        }
    }

    /// Whether no sample will come any more.
    pub fn is_over(&self) -> bool {
        self.pacer.is_over()
    }

    /// Takes what a tick read; the sample, where it is one. `steps`: the setpoint jumped with it.
    pub fn tick(&mut self, reading: Reading, steps: bool) -> Option<Reading> {
        let due = self.pacer.tick(steps);
        if due.counts {
            let [a, b, c, d] = reading.current_a.map(Some);
            let sensor_z_um = match self.is_robust {
                true => self.median_with(reading.sensor_z_um),
                false => reading.sensor_z_um,
            };
            self.mean.add([a, b, c, d, sensor_z_um]);
        }
        if !due.sample {
            return None;
        }
        self.lately_um = Default::default();
        let [a, b, c, d, sensor_z_um] = self.mean.take();
        Some(Reading {
            current_a: [a, b, c, d].map(Option::unwrap_or_default),
            // The first sample has nothing to be held against.
            sensor_z_um: sensor_z_um.or(reading.sensor_z_um),
        })
    }

    /// The median of this reading and those before it; `None` before there are enough, or where nothing was read.
    fn median_with(&mut self, read_um: Option<f32>) -> Option<f32> {
        read_um?;
        let [_, before, last] = self.lately_um;
        self.lately_um = [before, last, read_um];
        let (a, b, c) = (before?, last?, read_um?);
        Some(a.min(b).max(a.max(b).min(c)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const MEAN_OF_200: Stream = Stream {
        period_ticks: 1000,
        count: 3,
        mean_ticks: 200,
        slowing: 0,
    };

    /// The sensor's samples of a stream, where it reads this in each tick.
    fn samples(
        stream: Stream,
        ticks: u32,
        read_um: impl Fn(u32) -> Option<f32>,
    ) -> Vec<Option<f32>> {
        let mut sampler = Sampler::new(stream);
        (0..ticks)
            .filter_map(|tick| {
                let reading = Reading {
                    current_a: [1e-3; 4],
                    sensor_z_um: read_um(tick),
                };
                let sample = sampler.tick(reading, false)?;
                // Two hundred roundings of a sum in f32, 6e-8 of it each.
                assert!(
                    sample
                        .current_a
                        .iter()
                        .all(|current_a| (current_a - 1e-3).abs() < 1e-8)
                );
                Some(sample.sensor_z_um)
            })
            .collect()
    }

    proptest! {
        #[test]
        fn what_is_lost_or_stands_alone_bears_no_weight_in_a_mean(
            lost in 801_u32..1000, off in 801_u32..1000, by_um in -1e3_f32..1e3,
        ) {
            prop_assume!(lost.abs_diff(off) > 1);
            let z_um = samples(MEAN_OF_200, 1001, |tick| match tick {
                _ if tick == lost => None,
                // Far away from the mean that is taken: the position before a jump.
                0..=800 => Some(50.0),
                _ if tick == off => Some(10.0 + by_um),
                _ => Some(10.0),
            });
            prop_assert_eq!(z_um[0], Some(50.0));
            prop_assert!((z_um[1].unwrap() - 10.0).abs() < 1e-4, "{:?}", z_um);
        }
    }

    #[test]
    fn a_sample_of_a_tick_is_that_tick() {
        let dense = Stream {
            period_ticks: 1,
            count: 4,
            mean_ticks: 1,
            slowing: 0,
        };
        let read = [Some(1.0), None, Some(50.0), Some(2.0)];
        assert_eq!(samples(dense, 4, |tick| read[tick as usize]), read);
    }

    #[test]
    fn a_sensor_that_reads_nothing_has_no_mean() {
        assert_eq!(samples(MEAN_OF_200, 2001, |_| None), [None; 3]);
    }
}
