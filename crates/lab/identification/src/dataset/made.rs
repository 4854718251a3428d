//! Datasets made by hand, as tests do.

use super::{Channel, Dataset, Observation};
use mirror_model::{ACTUATORS, Interval};

impl Dataset {
    /// Drives of all actuators (V) held for these times (s), nothing observed.
    pub fn driven(drives: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let held = |(volts, seconds)| Interval::held([volts; ACTUATORS], seconds);
        Self {
            intervals: drives.into_iter().map(held).collect(),
            experiments: vec!["made".into()],
            ..Self::default()
        }
    }

    /// The same with this read at the end of an interval.
    ///
    /// # Panics
    /// Where there is no such interval.
    pub fn reading(mut self, interval: usize, channel: Channel, value: f64, noise: f64) -> Self {
        let t_s = self.intervals[..=interval].iter().map(|i| i.duration_s);
        self.observations.push(Observation {
            interval,
            channel,
            value,
            noise,
            experiment: 0,
            t_s: t_s.sum(),
        });
        self
    }

    /// The same with these channels read at the end of every interval, with this noise; they read 0.
    pub fn read_at_each(self, channels: &[(Channel, f64)]) -> Self {
        let intervals = 0..self.intervals.len();
        let readings =
            intervals.flat_map(|interval| channels.iter().map(move |&of| (interval, of)));
        readings.fold(self, |data, (interval, (channel, noise))| {
            data.reading(interval, channel, 0.0, noise)
        })
    }

    /// One heater, held for a second at each of these powers (W), at which it has these resistances (ohm).
    pub fn of_a_heater(points: &[(f64, f64)], noise_a: f64) -> Self {
        let volts = points.iter().map(|(watt, ohm)| (watt * ohm).sqrt());
        let data = Self::driven(volts.map(|v| (v, 1.0)));
        points
            .iter()
            .enumerate()
            .fold(data, |data, (index, (watt, ohm))| {
                data.reading(index, Channel::Current(0), (watt / ohm).sqrt(), noise_a)
            })
    }
}
