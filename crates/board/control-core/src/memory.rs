//! The stage `memory` inverted: the displacement that the shape must give, so that with hysteresis and
//! creep the mirror is where it is asked to be.
//!
//! What is asked is piston motion, the same for all four actuators, so one memory serves them.

use crate::calibration::{LAGS, Memory as MemoryCalibration, PLAYS};
use crate::lag::{SlowLag, SlowState, TURNS, rate};
use crate::units::Micrometre;

/// A play operator of the inverse.
#[derive(Clone, Copy, Debug, Default)]
struct InversePlay {
    radius: f32,
    weight: f32,
}

/// The numbers of the inverse.
#[derive(Clone, Debug)]
pub(crate) struct MemoryInverse {
    gain: f32,
    plays: [InversePlay; PLAYS],
    /// Part of what it holds back that a play operator lets go of from turn to turn.
    release: f32,
    creep: [SlowLag; LAGS],
}

/// What the mirror remembers.
#[derive(Clone, Debug, Default)]
pub(crate) struct MemoryState {
    plays: [f32; PLAYS],
    creep: [SlowState; LAGS],
    turn: usize,
}

impl MemoryInverse {
    /// The exact inverse of a Prandtl-Ishlinskii operator is another one (Kuhnen 2003), here with the
    /// weights of the play operators alone and what is left of 1 for the part without memory.
    pub(crate) fn new(memory: &MemoryCalibration) -> Self {
        let mut slope = 1.0 - memory.plays.iter().map(|play| play.weight).sum::<f32>();
        let gain = 1.0 / slope;
        let mut plays = [InversePlay::default(); PLAYS];
        let mut output = 0.0;
        let mut radius = 0.0;
        for (inverse, play) in plays.iter_mut().zip(&memory.plays) {
            // Along the virgin curve: where the input reaches this radius the output is here.
            output += slope * (play.radius.0 - radius);
            radius = play.radius.0;
            let steeper = slope + play.weight;
            *inverse = InversePlay {
                radius: output,
                weight: 1.0 / steeper - 1.0 / slope,
            };
            slope = steeper;
        }
        Self {
            gain,
            plays,
            release: if memory.release.0 > 0.0 {
                rate(memory.release, TURNS)
            } else {
                0.0
            },
            creep: memory.creep.each_ref().map(SlowLag::new),
        }
    }

    /// Whether nothing is left that fades by itself: less than this far (um). What plays hold they hold for ever, unless they
    /// let it go.
    pub(crate) fn is_at_rest(&self, state: &MemoryState, least: f32) -> bool {
        let lets_go = self.release > 0.0;
        let creep = state.creep.iter().map(|lag| lag.value);
        let plays = state
            .plays
            .iter()
            .map(|held| if lets_go { *held } else { 0.0 });
        creep.chain(plays).all(|left| left.abs() < least)
    }

    /// The displacement for which the mirror will be at `z`, and a tick of the memory with it.
    pub(crate) fn displacement(&self, state: &mut MemoryState, z: Micrometre) -> Micrometre {
        let crept: f32 = state.creep.iter().map(|at| at.value).sum();
        let before_creep = z.0 - crept;
        // Lags and play operators take turns; in four ticks a position changes less than creep is known.
        let turn = state.turn % TURNS;
        self.creep[turn].advance(&mut state.creep[turn], before_creep);
        let held = &mut state.plays[turn];
        *held += self.release * (before_creep - *held);
        state.turn = turn + 1;
        let mut x = self.gain * before_creep;
        for (play, at) in self.plays.iter().zip(&mut state.plays) {
            *at = pulled(*at, before_creep - play.radius, before_creep + play.radius);
            x += play.weight * *at;
        }
        Micrometre(x)
    }
}

/// `at`, pulled along by the nearer end. (`clamp` would panic, and `max` and `min` are functions of the
/// library that ask for NaN, which a position never is.)
fn pulled(at: f32, low: f32, high: f32) -> f32 {
    let at = if at < low { low } else { at };
    if at > high { high } else { at }
}

// Every lag of the creep has its turn, and every play operator.
const _: () = assert!(LAGS == TURNS && PLAYS == TURNS);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Play;
    use crate::calibration::tests::parts;
    use proptest::prelude::*;

    fn plays() -> impl Strategy<Value = [Play; PLAYS]> {
        proptest::array::uniform4((0.0_f32..0.1, 0.1_f32..15.0)).prop_map(|steps| {
            let mut radius = 0.0;
            steps.map(|(weight, step)| {
                radius += step;
                Play {
                    weight,
                    radius: Micrometre(radius),
                }
            })
        })
    }

    /// The stage `memory` forward, in f64.
    struct Forward {
        memory: MemoryCalibration,
        plays: [f64; PLAYS],
        creep: [f64; LAGS],
    }

    impl Forward {
        fn new(memory: MemoryCalibration) -> Self {
            Self {
                memory,
                plays: [0.0; PLAYS],
                creep: [0.0; LAGS],
            }
        }

        fn step(&mut self, x: f64) -> f64 {
            let release_s = f64::from(self.memory.release.0);
            let kept = if release_s > 0.0 {
                (-1e-4 / release_s).exp()
            } else {
                1.0
            };
            let mut y = x;
            for (play, at) in self.memory.plays.iter().zip(&mut self.plays) {
                let radius = f64::from(play.radius.0);
                *at = (x + (*at - x) * kept).max(x - radius).min(x + radius);
                y += f64::from(play.weight) * (*at - x);
            }
            let crept: f64 = self.creep.iter().sum();
            for (lag, at) in self.memory.creep.iter().zip(&mut self.creep) {
                let left = (-1e-4 / f64::from(lag.time.0)).exp();
                let goal = f64::from(lag.weight) * y;
                *at = goal + left * (*at - goal);
            }
            y + crept
        }
    }

    proptest! {
        #[test]
        fn the_inverse_is_exact_along_any_course(
            plays in plays(),
            course in proptest::collection::vec(0.0_f32..170.0, 1..60),
        ) {
            let memory = MemoryCalibration { plays, ..MemoryCalibration::NONE };
            let inverse = MemoryInverse::new(&memory);
            let mut state = MemoryState::default();
            let mut mirror = Forward::new(memory);
            for z in course {
                let x = inverse.displacement(&mut state, Micrometre(z));
                let reached = mirror.step(f64::from(x.0));
                prop_assert!((reached - f64::from(z)).abs() < 2e-4, "{reached} for {z}");
            }
        }
    }

    #[test]
    fn creep_and_hysteresis_are_undone_together() {
        let memory = parts().memory;
        let inverse = MemoryInverse::new(&memory);
        let mut state = MemoryState::default();
        let mut mirror = Forward::new(memory);
        for tick in 0..200_000 {
            let z = [0.0, 160.0, 40.0, 90.0][tick / 50_000];
            let x = inverse.displacement(&mut state, Micrometre(z));
            let reached = mirror.step(f64::from(x.0));
            // Plays that let go are inverted to the second order of their weights, here 4 % of 0.5 um.
            assert!((reached - f64::from(z)).abs() < 0.02, "{reached} for {z}");
        }
    }

    #[test]
    fn without_memory_nothing_is_changed() {
        let inverse = MemoryInverse::new(&MemoryCalibration::NONE);
        let mut state = MemoryState::default();
        for z in [0.0, 170.0, 3.3, 90.0] {
            assert_eq!(inverse.displacement(&mut state, Micrometre(z)).0, z);
        }
    }
}
