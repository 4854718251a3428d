//! What a mirror is built from.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A mirror, but for what is drawn from its seed.
#[derive(Clone, Debug, PartialEq)]
pub struct ForeignConfig {
    /// What it is called.
    pub name: String,
    /// What its scatter and its times of creep are drawn from.
    pub seed: u64,
    /// Standard deviation of resistance, loss and bend from actuator to actuator, as a part.
    pub scatter: f64,
    /// Part by which the weakest actuator bends less.
    pub weakness: f64,
    /// How many times slower than usual heaters and beams are; 10 ms is usual.
    pub slowness: f64,
    /// Width of the loop that friction makes, as a part of the span.
    pub friction: f64,
    /// Weight of each of the three terms of creep.
    pub creep: f64,
    /// Where the piston rings (Hz).
    pub resonance_hz: f64,
    /// Quality of that, above 1/2.
    pub quality: f64,
    /// Leads to each heater (ohm).
    pub lead_ohm: f64,
}

/// What differs from actuator to actuator, as factors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Factors {
    pub(crate) ohm: f64,
    pub(crate) loss: f64,
    pub(crate) bend: f64,
}

impl ForeignConfig {
    /// The usual one: 1.5 % of friction, three terms of 1 % of creep, a resonance at 350 Hz, leads of 10 ohm.
    pub fn new(seed: u64) -> Self {
        Self {
            name: format!("foreign, seed {seed}"),
            seed,
            scatter: 0.02,
            weakness: 0.0,
            slowness: 1.0,
            friction: 0.015,
            creep: 0.01,
            resonance_hz: 350.0,
            quality: 12.0,
            lead_ohm: 10.0,
        }
    }

    /// The factors of the four actuators, and the times of the three terms of creep (s).
    pub(crate) fn drawn(&self) -> ([Factors; 4], [f64; 3]) {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        // Uniform, of the deviation that is asked for.
        let half_width = 3.0_f64.sqrt() * self.scatter;
        let mut factor = || 1.0 + rng.random_range(-1.0..=1.0) * half_width;
        let mut actuators = [(); 4].map(|()| Factors {
            ohm: factor(),
            loss: factor(),
            bend: factor(),
        });
        actuators[rng.random_range(0..4)].bend *= 1.0 - self.weakness;
        let creep_s = [(0.2, 0.6), (2.0, 6.0), (15.0, 40.0)]
            .map(|(least, most): (f64, f64)| rng.random_range(least..most));
        (actuators, creep_s)
    }
}
