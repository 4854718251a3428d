//! A coordinate of the plate that rings.

use std::f64::consts::TAU;

/// A mass on a spring with some damping.
#[derive(Clone, Debug)]
pub struct Ringing {
    /// Angular frequency (rad/s) and rate of decay (1/s).
    omega: f64,
    decay: f64,
    at: f64,
    /// Per second.
    speed: f64,
}

impl Ringing {
    /// At rest at zero. `quality`: above 1/2.
    pub fn new(hz: f64, quality: f64) -> Self {
        let omega = TAU * hz;
        Self {
            omega,
            decay: omega / (2.0 * quality.max(0.51)),
            at: 0.0,
            speed: 0.0,
        }
    }

    /// So many seconds while its spring is held at `rest`, by the free vibration's own solution; returns where it is.
    pub fn follow(&mut self, rest: f64, seconds: f64) -> f64 {
        let turning = (self.omega * self.omega - self.decay * self.decay).sqrt();
        let (sine, cosine) = (turning * seconds).sin_cos();
        let left = (-self.decay * seconds).exp();
        let away = self.at - rest;
        let drift = (self.speed + self.decay * away) / turning;
        self.at = rest + left * (away * cosine + drift * sine);
        self.speed = left
            * (self.speed * cosine
                - (self.decay * self.speed + self.omega * self.omega * away) / turning * sine);
        self.at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_rings_at_its_frequency_and_dies_with_its_quality() {
        let mut ringing = Ringing::new(350.0, 12.0);
        let course: Vec<f64> = (0..2000).map(|_| ringing.follow(1.0, 1e-5)).collect();
        let peaks: Vec<usize> = (1..course.len() - 1)
            .filter(|&i| course[i] > course[i - 1] && course[i] >= course[i + 1])
            .collect();
        let periods = (peaks[5] - peaks[0]) as f64 * 1e-5 * 350.0;
        // Both peaks are known to a step of 10 us: 0.7 % of a period, and a damped one is 0.1 % longer.
        assert!((periods - 5.0).abs() < 0.02, "{periods}");
        let fell = (course[peaks[0]] - 1.0) / (course[peaks[1]] - 1.0);
        // The logarithmic decrement of a quality of 12 is pi / 12.
        assert!(
            (fell.ln() - std::f64::consts::PI / 12.0).abs() < 1e-3,
            "{fell}"
        );
    }
}
