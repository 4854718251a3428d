//! The zeros of the current meters: what they read where nothing is driven.
//!
//! A current sense's amplifier has an offset that its readings share. At small drives it is a part of the reading, and looks like
//! a resistance that bends; where nothing is driven nothing else is there.

use super::{Channel, Dataset, Observation};
use mirror_model::ACTUATORS;

/// A zero is told from none where the mean is so many standard errors away from it: 1 of 370 by chance (normal distribution).
const TOLD: f64 = 3.0;

impl Dataset {
    /// Takes the meters' zeros from all currents, where readings without drive tell them.
    pub(super) fn take_meter_zeros(&mut self) {
        let zeros: [f64; ACTUATORS] = std::array::from_fn(|actuator| {
            let idle = self
                .observations
                .iter()
                .filter(|o| self.is_idle(actuator, o));
            told_mean(idle)
        });
        for observation in &mut self.observations {
            if let Channel::Current(actuator) = observation.channel {
                observation.value -= zeros[actuator];
            }
        }
    }

    /// Whether an observation is of this actuator's current while nothing drives it.
    fn is_idle(&self, actuator: usize, observation: &Observation) -> bool {
        let interval = &self.intervals[observation.interval];
        observation.channel == Channel::Current(actuator)
            && interval.from_v[actuator] == 0.0
            && interval.to_v[actuator] == 0.0
    }
}

/// The mean of readings, weighed by their noise; 0 where noise alone could make it.
fn told_mean<'o>(readings: impl Iterator<Item = &'o Observation>) -> f64 {
    let (weight, sum) = readings.fold((0.0, 0.0), |(weight, sum), o| {
        let own = o.noise.powi(-2);
        (weight + own, sum + own * o.value)
    });
    if sum * sum > TOLD * TOLD * weight {
        sum / weight
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Readings of the second actuator's current at 0 V, and one at 1 V (A).
    fn session(idle_a: &[f64], driven_a: f64) -> Dataset {
        let volts = idle_a.iter().map(|_| 0.0).chain([1.0]);
        let data = Dataset::driven(volts.map(|volts| (volts, 1.0)));
        let read = idle_a.iter().copied().chain([driven_a]).enumerate();
        let mut data = read.fold(data, |data, (interval, amperes)| {
            data.reading(interval, Channel::Current(1), amperes, 2e-6)
        });
        data.take_meter_zeros();
        data
    }

    #[test]
    fn a_meter_s_zero_is_in_no_reading() {
        let data = session(&[5e-6, 3e-6, 4e-6, 4e-6], 2.004e-3);
        // The mean is 4 uA, four standard errors of 1 uA.
        let values: Vec<f64> = data.values();
        assert!((values[4] - 2e-3).abs() < 1e-12, "{values:?}");
        assert!((values[0] - 1e-6).abs() < 1e-12, "{values:?}");
    }

    #[test]
    fn noise_is_no_zero() {
        // The mean of 2 uA is two standard errors.
        let idle = [2e-6, 2e-6, 1e-6, 3e-6];
        assert_eq!(session(&idle, 2e-3).values()[..4], idle);
        assert_eq!(session(&[], 2e-3).values(), [2e-3], "nothing at 0 V");
    }

    #[test]
    fn a_noiseless_reading_at_rest_is_its_zero() {
        let data = Dataset::driven([(0.0, 1.0)]).reading(0, Channel::Current(1), 0.0, 0.0);
        let mut taken = data.clone();
        taken.take_meter_zeros();
        assert_eq!(taken.values(), data.values());
    }
}
