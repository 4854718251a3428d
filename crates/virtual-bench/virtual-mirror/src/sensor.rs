//! What instruments read of a mirror: its state with noise. Kept apart from the mirror so that a driver board with its
//! own electronics can take the noiseless state.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::config::{MirrorConfig, SensorConfig};
use crate::effects::reading::Errors;
use crate::state::State;

/// One reading of the instruments.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Displacement of the plate's centre from rest, positive towards the substrate (um).
    pub z_um: f64,
    /// Tilt about the x axis (deg).
    pub tilt_x_deg: f64,
    /// Tilt about the y axis (deg).
    pub tilt_y_deg: f64,
    /// Current of each actuator (A).
    pub current_a: [f64; 4],
}

/// A displacement sensor and four current senses, with their noise.
#[derive(Clone, Debug)]
pub struct Sensor {
    config: SensorConfig,
    errors: Errors,
    rng: ChaCha8Rng,
    gain: [f64; 4],
    /// The wander, in its own standard deviations.
    wander: f64,
}

impl Sensor {
    /// The instruments of a mirror; the same seed gives the same noise.
    pub fn new(config: &MirrorConfig) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(config.seed ^ 0x5e45_0e00_0000_0001);
        let gain =
            std::array::from_fn(|_| 1.0 + config.sensor.current_gain_ratio * normal(&mut rng));
        let wander = normal(&mut rng);
        Self {
            config: config.sensor,
            errors: Errors::new(&config.effects),
            rng,
            gain,
            wander,
        }
    }

    /// Reads `state`, `elapsed_s` seconds (0 or more) after the reading before.
    pub fn read(&mut self, state: &State, elapsed_s: f64) -> Reading {
        let keep = (-elapsed_s.max(0.0) / self.config.wander_s).exp();
        self.wander = keep * self.wander + (1.0 - keep * keep).sqrt() * self.normal();
        let position_nm =
            self.config.position_noise_nm * self.normal() + self.config.wander_nm * self.wander;
        let tilt = self.config.tilt_noise_mdeg * 1e-3;
        Reading {
            z_um: self.errors.read(state) + 1e-3 * position_nm,
            tilt_x_deg: state.tilt_x_deg + tilt * self.normal(),
            tilt_y_deg: state.tilt_y_deg + tilt * self.normal(),
            current_a: std::array::from_fn(|i| self.read_current(state.current_a[i], self.gain[i])),
        }
    }

    fn read_current(&mut self, current: f64, gain: f64) -> f64 {
        let noise = self.config.current_noise_ua * 1e-6 * self.normal();
        gain * current * (1.0 + self.config.current_noise_ratio * self.normal()) + noise
    }

    fn normal(&mut self) -> f64 {
        normal(&mut self.rng)
    }
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}
