//! The core's f32 arithmetic against the chain in f64, along a long random course.

use std::f64::consts::TAU;

use control_core::{Calibration, Micrometre, PwmCode, Setpoint};
use emulated_board::Device;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use virtual_mirror::ConfigError;

use crate::double::Chain;
use crate::{Loop, TICK_S};

/// How far apart the core and the chain in f64 were at most, in any actuator at any tick (um).
#[derive(Clone, Copy, Debug, Default)]
pub struct Precision {
    /// Where the two drives have taken the mirror through its thermal poles.
    pub mirror_um: f64,
    /// Where the two drives of a tick would hold it: their difference by the tables' slope. The inverse of a slow pole
    /// multiplies roundings, and the pole divides them again.
    pub drive_um: f64,
}

/// A piece of the course.
#[derive(Clone, Copy, Debug)]
enum Piece {
    /// To a position, and there.
    To(f64),
    /// A sine about a position: middle, amplitude, angle a tick.
    Sine(f64, f64, f64),
}

impl Piece {
    fn draw(rng: &mut ChaCha8Rng, top_um: f64) -> Self {
        let middle = rng.random_range(0.0..=top_um);
        if rng.random_bool(0.7) {
            return Self::To(middle);
        }
        let amplitude = middle.min(top_um - middle) * rng.random_range(0.0..1.0);
        // 0.1 to 100 Hz.
        let hz = 10.0_f64.powf(rng.random_range(-1.0..2.0));
        Self::Sine(middle, amplitude, TAU * hz * TICK_S)
    }

    fn setpoint(self, tick: usize) -> Setpoint {
        match self {
            Self::To(z) => Setpoint::position(Micrometre(z as f32)),
            Self::Sine(middle, amplitude, angle) => {
                let z = middle + amplitude * (angle * tick as f64).sin();
                Setpoint::track(Micrometre(z as f32))
            }
        }
    }
}

/// Core and chain along `seconds` of random moves, rests and sines, both told what the board with the mirror of `config`
/// senses. A piece lasts 2 ms to 5 s, so that moves begin in the midst of others.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn precision(
    calibration: &mut Calibration,
    config: &impl Device,
    seconds: f64,
    seed: u64,
) -> Result<Precision, ConfigError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut chain = Chain::new(calibration);
    let top_um = f64::from(calibration.max_position().0);
    let mut mirror = Loop::new(calibration, config)?;
    // The chain in f64 knows no surroundings.
    mirror.compensate_surroundings(false);
    let mut worst = Precision::default();
    let mut left = (seconds / TICK_S) as usize;
    while left > 0 {
        let piece = Piece::draw(&mut rng, top_um);
        let lasts_s = 10.0_f64.powf(rng.random_range(-2.7..0.7));
        let ticks = ((lasts_s / TICK_S) as usize).min(left);
        for tick in 0..ticks {
            let sensed = (mirror.applied.map(PwmCode::drive), mirror.currents);
            let setpoint = piece.setpoint(tick);
            mirror.tick(setpoint);
            let apart = chain.step(setpoint, sensed, mirror.drives);
            worst.drive_um = worst.drive_um.max(apart.drive_um);
            worst.mirror_um = worst.mirror_um.max(apart.mirror_um);
        }
        left -= ticks;
    }
    Ok(worst)
}
