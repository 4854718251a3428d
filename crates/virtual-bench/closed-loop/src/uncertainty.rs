//! Whether the intervals that the core tells hold the mirror, and whether it is there when it says so.

use std::fmt;

use calibration::PlatePose;
use control_core::{Calibration, Limits, Setpoint};
use emulated_board::{Device, Mirror};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use virtual_mirror::ConfigError;

use crate::core_pose;
use crate::surroundings::is_held_back;
use crate::{Loop, TICK_S};

/// Ordinary use: how many moves, in how many rooms, and what is drawn from.
#[derive(Clone, Copy, Debug)]
pub struct Use {
    /// Moves in each room.
    pub moves: usize,
    /// Rooms, of which the first is that of the calibration.
    pub rooms: usize,
    /// Of everything that is drawn.
    pub seed: u64,
}

/// So long the mirror stays while it comes to another room (s).
const BETWEEN_ROOMS_S: f64 = 1.0;

/// A random move, and where it ended.
#[derive(Clone, Copy, Debug)]
pub struct Move {
    /// How much warmer the room was than at calibration (K).
    pub room_k: f64,
    /// Where to (um).
    pub asked_um: f64,
    /// How far from there the mirror was in the end, in the mean of 10 ms (um).
    pub error_um: f64,
    /// Half the width of the interval that was told then (um).
    pub told_um: f64,
    /// What became of it after it was said to be settled; `None` where that was never said.
    pub settled: Option<Settled>,
}

/// A move that was said to be settled.
#[derive(Clone, Copy, Debug)]
pub struct Settled {
    /// When (s).
    pub after_s: f64,
    /// Half the width of the interval that was told then (um).
    pub told_um: f64,
    /// How far from where it ended it was then and later (um).
    pub left_um: f64,
}

impl Move {
    /// Whether the interval holds where it was.
    pub fn is_covered(&self) -> bool {
        self.error_um.abs() <= self.told_um
    }

    /// Whether it was said to be settled while it had further to go than its interval.
    pub fn is_told_too_early(&self) -> bool {
        self.settled.is_some_and(|it| it.left_um > it.told_um)
    }
}

/// What of the promises was kept.
#[derive(Clone, Copy, Debug)]
pub struct Kept {
    /// Moves that were made.
    pub moves: usize,
    /// Part of them whose interval held where they ended.
    pub covered: f64,
    /// Root mean square of the errors (um).
    pub error_rms_um: f64,
    /// The same of half the intervals' widths (um).
    pub interval_rms_um: f64,
    /// Part of them that were said to be settled too early.
    pub too_early: f64,
    /// Part of them that never were.
    pub never_settled: f64,
}

impl Kept {
    /// By these moves.
    pub fn of(moves: &[Move]) -> Self {
        let count = moves.len().max(1) as f64;
        let part = |is: fn(&Move) -> bool| moves.iter().filter(|it| is(it)).count() as f64 / count;
        let rms_um = |of: fn(&Move) -> f64| {
            let squares: f64 = moves.iter().map(|it| of(it).powi(2)).sum();
            (squares / count).sqrt()
        };
        Self {
            moves: moves.len(),
            covered: part(Move::is_covered),
            error_rms_um: rms_um(|it| it.error_um),
            interval_rms_um: rms_um(|it| it.told_um),
            too_early: part(Move::is_told_too_early),
            never_settled: part(|it| it.settled.is_none()),
        }
    }
}

impl fmt::Display for Kept {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} moves, {:.1} % within their interval; errors {:.3} um rms, intervals ± {:.3} um rms; settled too early {:.1} %, never {:.1} %",
            self.moves,
            1e2 * self.covered,
            self.error_rms_um,
            self.interval_rms_um,
            1e2 * self.too_early,
            1e2 * self.never_settled,
        )
    }
}

/// Random moves of a mirror under its calibration, of those that its bounds let it make.
///
/// # Errors
/// Where a number of `config` is out of range.
pub fn random_moves(
    calibration: &mut Calibration,
    config: &impl Device,
    use_: Use,
) -> Result<Vec<Move>, ConfigError> {
    let top_um = 0.95 * f64::from(calibration.max_position().0).min(180.0);
    let mut mirror = Loop::new(calibration, config)?;
    let mut rng = ChaCha8Rng::seed_from_u64(use_.seed);
    let mut moves = Vec::new();
    for room in 0..use_.rooms {
        // 10 to 40 degC around a laboratory's 22.
        let room_k = match room {
            0 => 0.0,
            _ => rng.random_range(-12.0..18.0),
        };
        mirror.set_ambient(room_k);
        // No room changes between one move and the next.
        mirror.hold(0.5 * top_um, BETWEEN_ROOMS_S);
        for _ in 0..use_.moves {
            let asked_um = rng.random_range(0.02..1.0) * top_um;
            let stay_s = 10.0_f64.powf(rng.random_range(-0.7..0.5));
            let (moved, limits) = go(&mut mirror, asked_um, stay_s);
            if !is_held_back(limits) {
                moves.push(Move { room_k, ..moved });
            }
        }
    }
    Ok(moves)
}

fn go(mirror: &mut Loop<'_, impl Mirror>, asked_um: f64, stay_s: f64) -> (Move, Limits) {
    const READ: usize = 100;
    let setpoint = Setpoint::Position(core_pose(&PlatePose {
        z_um: asked_um,
        ..PlatePose::default()
    }));
    let (mut limits, mut first) = (Limits::NONE, None);
    let way_um: Vec<f64> = (0..(stay_s / TICK_S) as usize)
        .map(|tick| {
            let (z_um, acting) = mirror.tick(setpoint);
            limits = acting;
            if first.is_none() && mirror.settles_in_s() == Some(0.0) {
                first = Some((tick, told_um(mirror)));
            }
            z_um
        })
        .collect();
    let end_um = way_um.iter().rev().take(READ).sum::<f64>() / READ as f64;
    let settled = first.map(|(tick, told_um)| {
        let away = way_um[tick..].iter().map(|um| (um - end_um).abs());
        Settled {
            after_s: tick as f64 * TICK_S,
            told_um,
            left_um: away.fold(0.0, f64::max),
        }
    });
    let moved = Move {
        room_k: 0.0,
        asked_um,
        error_um: end_um - asked_um,
        told_um: told_um(mirror),
        settled,
    };
    (moved, limits)
}

fn told_um(mirror: &Loop<'_, impl Mirror>) -> f64 {
    mirror.uncertainty().map_or(0.0, |told| f64::from(told.z.0))
}
