//! The stage `memory` inverted: the displacement that the shape must give, so that with hysteresis and
//! creep the mirror is where it is asked to be.
//!
//! Each actuator remembers its own way; the numbers are the mirror's. One of them has its turn at every tick, and goes on along
//! its tangent until its next one: in four ticks the tangent of a memory of a few percent changes less than creep is known.

use crate::CHANNELS;
use crate::between::Between;
use crate::calibration::{LAGS, Lag, Memory as MemoryCalibration, PLAYS};
use crate::lag::{SlowLag, SlowState, rate};
use crate::units::{Micrometre, Volt};
use libm::powf;

/// Ticks from one turn of a lag, or of a play operator that lets go, to the next: one of each actuator has its turn when the
/// actuator has.
pub(crate) const TURNS: usize = CHANNELS * LAGS;

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
    /// Part of what it holds back that a play operator lets go of from turn to turn, by each volt of the drive.
    release_per_volt: f32,
    /// How much of where it was led each lag holds, and the weights of that.
    creep: [SlowLag; LAGS],
    creep_weights: [f32; LAGS],
}

/// What an actuator remembers.
#[derive(Clone, Debug)]
pub(crate) struct MemoryState {
    plays: [f32; PLAYS],
    creep: [SlowState; LAGS],
    /// The drive at its last turn.
    drive: Volt,
    /// Position at its last turn.
    position: f32,
    /// The tangent there: displacement at position 0, and how it changes with the position.
    offset: f32,
    slope: f32,
}

/// What of another inverse each lag and play of this goes on with: the two lags between whose times its own lies, and the play of about its
/// radius.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Successors {
    creep: [Between; LAGS],
    plays: [usize; PLAYS],
}

impl Successors {
    /// What the lags of the creep go on with, of what those before had.
    pub(crate) fn creep_among(&self, before: &[f32; LAGS]) -> [f32; LAGS] {
        self.creep.map(|place| place.among(before))
    }
}

impl MemoryInverse {
    /// The exact inverse of a Prandtl-Ishlinskii operator is another one (Kuhnen 2003), here with the
    /// weights of the play operators alone and what is left of 1 for the part without memory.
    /// `highest`: the drive that the release counts at.
    pub(crate) fn new(memory: &MemoryCalibration, highest: Volt) -> Self {
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
            release_per_volt: if memory.release.0 > 0.0 {
                rate(memory.release, TURNS) / highest.0
            } else {
                0.0
            },
            creep: memory
                .creep
                .map(|lag| SlowLag::new(&Lag { weight: 1.0, ..lag }, TURNS)),
            creep_weights: memory.creep.map(|lag| lag.weight),
        }
    }

    /// An actuator at rest.
    pub(crate) fn at_rest(&self) -> MemoryState {
        MemoryState {
            plays: [0.0; PLAYS],
            creep: Default::default(),
            drive: Volt(0.0),
            position: 0.0,
            offset: 0.0,
            slope: self.gain,
        }
    }

    /// An actuator that is here, and remembers this.
    pub(crate) fn of(
        &self,
        plays: [f32; PLAYS],
        creep: [f32; LAGS],
        position: Micrometre,
    ) -> MemoryState {
        let mut state = MemoryState {
            plays,
            creep: creep.map(SlowState::at),
            position: position.0,
            ..self.at_rest()
        };
        let before_creep = self.before_creep(&state);
        self.pull(&mut state, before_creep);
        state
    }

    /// Which lags and plays of the one before these go on with.
    pub(crate) fn successors(&self, before: &Self) -> Successors {
        let rates = before.creep.each_ref().map(SlowLag::rate);
        let radii = before.plays.map(|play| play.radius);
        Successors {
            creep: self
                .creep
                .each_ref()
                .map(|lag| Between::of_rate(lag.rate(), &rates)),
            plays: self.plays.map(|play| nearest(play.radius, &radii)),
        }
    }

    /// What an actuator that was followed with other numbers remembers: each lag is where one of its time would have been, and each play
    /// holds back the same part of its radius as the one of about that.
    pub(crate) fn inherit(
        &self,
        from: &Successors,
        (before, state): (&Self, &MemoryState),
    ) -> MemoryState {
        let lags = state.creep.map(|lag| lag.value);
        let mut inherited = MemoryState {
            creep: from.creep_among(&lags).map(SlowState::at),
            position: state.position,
            ..self.at_rest()
        };
        let (was, is) = (before.before_creep(state), self.before_creep(&inherited));
        let plays = self.plays.iter().zip(from.plays);
        for (held, (play, as_before)) in inherited.plays.iter_mut().zip(plays) {
            let radius = before.plays[as_before % PLAYS].radius;
            if radius > 0.0 {
                let part = (state.plays[as_before % PLAYS] - was) / radius;
                *held = is + part * play.radius;
            }
        }
        self.pull(&mut inherited, is);
        inherited
    }

    /// Where an actuator would be at its last turn without creep (um).
    #[inline(always)]
    pub(crate) fn before_creep(&self, state: &MemoryState) -> f32 {
        let lags = state.creep.iter().zip(self.creep_weights);
        lags.fold(state.position, |left, (lag, weight)| {
            left - weight * lag.value
        })
    }

    /// Radius and weight of a play operator of the inverse.
    pub(crate) fn play(&self, play: usize) -> (f32, f32) {
        let InversePlay { radius, weight } = self.plays[play % PLAYS];
        (radius, weight)
    }

    /// Part of what it holds back that a play operator lets go of from turn to turn: a drive trembles by a step of its rounding, and z, which
    /// grows with its square, in proportion to it.
    #[inline(always)]
    pub(crate) fn release(&self, state: &MemoryState) -> f32 {
        self.release_per_volt * state.drive.0
    }

    /// What the creep makes of where its lags are (um).
    pub(crate) fn creep_of(&self, lags: &[f32; LAGS]) -> f32 {
        let weighted = lags.iter().zip(self.creep_weights);
        weighted.map(|(lag, weight)| weight * lag).sum()
    }

    /// Part of where a lag of the creep was that is left of it after a turn.
    pub(crate) fn creep_pole(&self, lag: usize) -> f32 {
        1.0 - self.creep[lag % LAGS].rate()
    }

    /// Creep that is still to come at the present position (um).
    pub(crate) fn creep_to_come(&self, state: &MemoryState) -> f32 {
        let before_creep = self.before_creep(state);
        let lags = self.creep.iter().zip(&state.creep).zip(self.creep_weights);
        lags.map(|((lag, at), weight)| weight * lag.left(at, before_creep))
            .sum()
    }

    /// Whether nothing is left that fades by itself where nothing is driven: less than this far (um). What plays hold they hold for ever.
    pub(crate) fn is_at_rest(&self, state: &MemoryState, least: f32) -> bool {
        let before_creep = self.before_creep(state);
        let lags = self.creep.iter().zip(&state.creep).zip(self.creep_weights);
        let mut left = lags.map(|((lag, at), weight)| weight * lag.left(at, before_creep));
        left.all(|left| left.abs() < least)
    }

    /// So many ticks pass in which it lies where it rests: lags go there, those of no weight too, which another calibration may give
    /// some.
    pub(crate) fn rest(&self, state: &mut MemoryState, ticks: u16) {
        let turns = f32::from(ticks) / TURNS as f32;
        let before_creep = self.before_creep(state);
        for (lag, at) in self.creep.iter().zip(&mut state.creep) {
            let left = (at.value - before_creep) * powf(1.0 - lag.rate(), turns);
            *at = SlowState::at(before_creep + left);
        }
    }

    /// An actuator's turn, at `z` by a drive: the plays are pulled along, and those of number `turn`, play and lag, have theirs.
    #[inline(always)]
    pub(crate) fn advance(
        &self,
        state: &mut MemoryState,
        turn: usize,
        (z, drive): (Micrometre, Volt),
    ) {
        let turn = turn % LAGS;
        (state.position, state.drive) = (z.0, drive);
        let before_creep = self.before_creep(state);
        self.creep[turn].advance(&mut state.creep[turn], before_creep);
        let release = self.release(state);
        let held = &mut state.plays[turn];
        *held += release * (before_creep - *held);
        self.pull(state, before_creep);
    }

    /// The plays are pulled along to where the actuator is.
    #[inline(always)]
    fn pull(&self, state: &mut MemoryState, before_creep: f32) {
        let mut x = self.gain * before_creep;
        let mut slope = self.gain;
        for (play, held) in self.plays.iter().zip(&mut state.plays) {
            let (low, high) = (before_creep - play.radius, before_creep + play.radius);
            if *held < low {
                *held = low;
                slope += play.weight;
            } else if *held > high {
                *held = high;
                slope += play.weight;
            }
            x += play.weight * *held;
        }
        state.offset = x - slope * state.position;
        state.slope = slope;
    }
}

/// Which of several numbers is the least times larger or smaller than this one.
fn nearest<const N: usize>(number: f32, among: &[f32; N]) -> usize {
    let (mut nearest, mut least) = (0, f32::INFINITY);
    for (i, other) in among.iter().enumerate() {
        let apart = if *other > number {
            other / number
        } else {
            number / other
        };
        if apart < least {
            (nearest, least) = (i, apart);
        }
    }
    nearest % N
}

impl MemoryState {
    /// What its play operators hold, and its lags (um).
    pub(crate) fn held(&self) -> ([f32; PLAYS], [f32; LAGS]) {
        (self.plays, self.creep.map(|lag| lag.value))
    }

    /// The displacement for which the actuator will be at `z`.
    #[inline(always)]
    pub(crate) fn displacement(&self, z: Micrometre) -> Micrometre {
        Micrometre(self.offset + self.slope * z.0)
    }

    /// Where the actuator will be by a displacement.
    pub(crate) fn position(&self, displacement: Micrometre) -> Micrometre {
        // The inverse is nowhere less steep than 1: hysteresis and creep only ever hold back.
        Micrometre((displacement.0 - self.offset) / self.slope)
    }
}

// Every play operator has its turn when a lag of the creep has.
const _: () = assert!(LAGS == PLAYS);

#[cfg(test)]
mod tests;
