//! How far the plate may be from where it is asked to be.
//!
//! Eight things are not known, and do not depend on each other: what calibration left, what the surroundings may be beyond what the
//! resistances tell, what each resistance tells of its own actuator, what the play operators and the lags of the creep held before the controller began
//! to follow them, the heat and the creep that are still to come, and what a heater has become whose resistance is unknown or tells otherwise than at
//! calibration.
//! Each is a standard uncertainty in micrometres; their root sum of squares (the combined standard uncertainty), times a coverage
//! factor, is told [JCGM 100:2008, 5.1.2 and 6.2.1].
//!
//! It changes nothing that is driven, and takes a piece in each tick.

use crate::CHANNELS;
use crate::calibration::{LAGS, PLAYS, Parts, Residual};
use crate::memory::{MemoryInverse, MemoryState, Successors, TURNS};
use crate::plate::{PlateInverse, Pose};
use crate::units::{Micrometre, Radian};
use fpu::sqrt;
use libm::powf;

/// Half the width of an interval that holds 95 % of a normal distribution, in standard deviations [JCGM 100:2008, table G.1].
const COVERAGE: f32 = 1.96;
/// Part of the creep that is still to come by which it may be off: what `calibrate` leaves of weights and time constants
/// (`closed-loop`, test `uncertainty`).
const OF_CREEP: f32 = 0.3;
/// The same of the heat that the fast poles have still to bring.
const OF_HEAT: f32 = 0.1;
/// A heater that drifts is told before the plate is further off than this (um; `closed-loop`, test `drift`). One that
/// was told, or that shows no resistance to tell by, may be as far off either way, and as far as the heaters are apart.
const DRIFTED: Micrometre = Micrometre(1.0);
/// A mirror whose heaters differ from each other otherwise than at calibration may be another one (um): under another's calibration virtual mirrors were up
/// to 83 um off (`closed-loop`, test `exchanged`).
const OTHERS: Micrometre = Micrometre(85.0);
/// Standard deviation of what lies anywhere in an interval, per half of its width: 1 / sqrt(3) [JCGM 100:2008, 4.3.7].
pub(crate) const RECTANGULAR: f32 = 0.577_35;

/// How far the plate may be from where it is asked to be: half the width of an interval that holds it in 95 of 100 cases.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Uncertainty {
    /// Of the piston.
    pub z: Micrometre,
    /// Of either tilt; it means nothing where the levers are not known.
    pub tilt: Radian,
}

/// Where a play operator may be (um): it was anywhere within its radius when the controller began to follow it.
#[derive(Clone, Copy, Debug)]
struct Span {
    low: f32,
    high: f32,
}

/// Standard uncertainties of one actuator's displacement (um).
#[derive(Clone, Copy, Debug, Default)]
struct Contributions {
    plays: f32,
    creep: f32,
    heat: f32,
    surroundings: f32,
    thermometer: f32,
}

/// The uncertainty budget.
#[derive(Clone, Debug)]
pub(crate) struct Budget {
    residual: Residual,
    spans: [[Span; PLAYS]; CHANNELS],
    contributions: [Contributions; CHANNELS],
    creep_before: CreepBefore,
    /// How far each displacement may be off where a heater tells otherwise than at calibration.
    drifted: Micrometre,
    /// Whether the heaters may be another mirror's.
    is_doubted: bool,
    told: Uncertainty,
}

/// What is left of where the lags of the creep were when the controller began to follow them, which was anywhere from rest to the top.
#[derive(Clone, Copy, Debug)]
struct CreepBefore {
    /// Of each lag, as a part of that.
    left: [f32; LAGS],
    top: Micrometre,
    /// Standard uncertainty of the piston by it (um), the lags by what they followed alike.
    deviation: f32,
}

impl CreepBefore {
    fn weigh(&mut self, memory: &MemoryInverse) {
        self.deviation = RECTANGULAR * self.top.0 * memory.creep_of(&self.left).abs();
    }
}

impl Span {
    /// Pulled along by a position: no further from it than the radius, and nearer by what is let go.
    fn pull(&mut self, position: f32, radius: f32, release: f32) {
        for end in [&mut self.low, &mut self.high] {
            *end += release * (position - *end);
            if *end < position - radius {
                *end = position - radius;
            } else if *end > position + radius {
                *end = position + radius;
            }
        }
    }
}

impl Budget {
    /// One that does not know what the mirror did before.
    pub(crate) fn new(parts: &Parts, memory: &MemoryInverse) -> Self {
        let anywhere = core::array::from_fn(|play| {
            let (radius, _) = memory.play(play);
            Span {
                low: -radius,
                high: radius,
            }
        });
        let mut creep_before = CreepBefore {
            left: [1.0; LAGS],
            top: parts.actuators[0].shape.top(),
            deviation: 0.0,
        };
        creep_before.weigh(memory);
        Self {
            residual: parts.residual,
            spans: [anywhere; CHANNELS],
            contributions: Default::default(),
            creep_before,
            drifted: DRIFTED,
            is_doubted: false,
            told: Uncertainty::default(),
        }
    }

    /// What the lags of the creep hold is known: the controller before followed them.
    pub(crate) fn recall(&mut self) {
        self.creep_before.left = [0.0; LAGS];
        self.creep_before.deviation = 0.0;
    }

    /// So many ticks pass in which nothing is driven.
    pub(crate) fn rest(&mut self, memory: &MemoryInverse, ticks: u16) {
        for (lag, left) in self.creep_before.left.iter_mut().enumerate() {
            *left *= powf(memory.creep_pole(lag), f32::from(ticks) / TURNS as f32);
        }
        self.creep_before.weigh(memory);
    }

    /// What another calibration leaves unknown, whose lags are between those before.
    pub(crate) fn exchange(&mut self, parts: &Parts, memory: &MemoryInverse, from: &Successors) {
        self.residual = parts.residual;
        self.creep_before.top = parts.actuators[0].shape.top();
        self.creep_before.left = from.creep_among(&self.creep_before.left);
        self.creep_before.weigh(memory);
    }

    /// One actuator's play operators may be where they might be before, in the same part of their radii. `is` and `was`: where it is
    /// without creep under `memory`, and under the one before (um).
    pub(crate) fn inherit(
        &mut self,
        actuator: usize,
        (memory, is): (&MemoryInverse, f32),
        (before, was): (&MemoryInverse, f32),
    ) {
        for (play, span) in self.spans[actuator % CHANNELS].iter_mut().enumerate() {
            let ((radius, _), (radius_before, _)) = (memory.play(play), before.play(play));
            if radius_before > 0.0 {
                let part = radius / radius_before;
                span.low = is + part * (span.low - was);
                span.high = is + part * (span.high - was);
            } else {
                (span.low, span.high) = (is - radius, is + radius);
            }
        }
    }

    /// Where each actuator's play operators may be (um).
    #[cfg(test)]
    pub(crate) fn spans(&self) -> [[(f32, f32); PLAYS]; CHANNELS] {
        self.spans
            .map(|spans| spans.map(|span| (span.low, span.high)))
    }

    /// What is told; `None` where nobody has said what the calibration leaves unknown.
    pub(crate) fn uncertainty(&self) -> Option<Uncertainty> {
        self.residual.is_known().then_some(self.told)
    }

    /// How near to where it comes to rest the plate has settled: what calibration left. `None` under one that nobody has tried, which
    /// knows the mirror's time constants as little as its positions.
    pub(crate) fn near(&self) -> Option<Micrometre> {
        let is_tried = self.residual.is_tried();
        is_tried.then_some(Micrometre(COVERAGE * self.residual.piston.0))
    }

    /// Of what a kelvin of the surroundings is worth.
    pub(crate) fn ambient_ratio(&self) -> f32 {
        self.residual.ambient_ratio
    }

    /// One play operator of one actuator, and after the last of them what the actuator's memory contributes.
    pub(crate) fn remember(
        &mut self,
        (actuator, play): (usize, usize),
        memory: &MemoryInverse,
        state: &MemoryState,
    ) {
        let (actuator, play) = (actuator % CHANNELS, play % PLAYS);
        // All four lags have been turned since.
        match (actuator, play) {
            (0, _) => self.creep_before.left[play] *= memory.creep_pole(play),
            (1, 0) => self.creep_before.weigh(memory),
            _ => {}
        }
        let spans = &mut self.spans[actuator];
        let (radius, _) = memory.play(play);
        spans[play].pull(memory.before_creep(state), radius, memory.release(state));
        if play + 1 < PLAYS {
            return;
        }
        let half_widths = spans.iter().enumerate().map(|(play, span)| {
            let (_, weight) = memory.play(play);
            0.5 * weight.abs() * (span.high - span.low)
        });
        let contributions = &mut self.contributions[actuator];
        contributions.plays = RECTANGULAR * half_widths.sum::<f32>();
        contributions.creep = OF_CREEP * memory.creep_to_come(state);
    }

    /// Of one actuator the standard uncertainties by its surroundings and by its thermometer, and what its fast poles have still to bring.
    pub(crate) fn warm(
        &mut self,
        actuator: usize,
        [surroundings, thermometer, to_come]: [Micrometre; 3],
    ) {
        let contributions = &mut self.contributions[actuator % CHANNELS];
        contributions.surroundings = surroundings.0;
        contributions.thermometer = thermometer.0;
        contributions.heat = OF_HEAT * to_come.0;
    }

    /// How far the plate may be off for what the heaters differ by.
    pub(crate) fn drift(&mut self, apart: Micrometre) {
        self.drifted = if apart.0 > DRIFTED.0 { apart } else { DRIFTED };
    }

    /// Whether the mirror may be another one than the calibration's.
    pub(crate) fn doubt(&mut self, is_doubted: bool) {
        self.is_doubted = is_doubted;
    }

    /// All of it, where the actuators are at these positions (um). What is unknown of all four alike moves the plate; what one
    /// actuator does apart from the others tilts it. `is_true`: every resistance tells what it told at calibration.
    pub(crate) fn combine(
        &mut self,
        plate: &PlateInverse,
        positions: &[f32; CHANNELS],
        is_true: bool,
    ) {
        let drifted = RECTANGULAR
            * match (self.is_doubted, is_true) {
                (true, _) => OTHERS.0,
                (false, false) => self.drifted.0,
                (false, true) => 0.0,
            };
        let of = |contribution: fn(&Contributions) -> f32| {
            plate.pose(&self.contributions.each_ref().map(contribution))
        };
        let Residual {
            piston,
            tried,
            part,
            apart,
            ..
        } = self.residual;
        let thermometers = self.contributions.each_ref().map(|it| it.thermometer);
        let untried = |um: f32| part * (um - tried.0).max(0.0);
        let pistons = [
            piston.0,
            untried(plate.pose(positions).z.0),
            of(|it| it.plays).z.0,
            of(|it| it.creep).z.0,
            self.creep_before.deviation,
            of(|it| it.heat).z.0,
            of(|it| it.surroundings).z.0,
            plate.piston_deviation(&thermometers).0,
            drifted,
        ];
        let alone = |actuator: usize| {
            let one = &self.contributions[actuator];
            let position = positions[actuator];
            let apart = (apart * position).max(untried(position));
            // What is left of the plate wherever it is may be left of each actuator alone.
            root_sum_square(&[
                piston.0,
                apart,
                one.plays,
                one.creep,
                one.heat,
                one.thermometer,
                drifted,
            ])
        };
        let tilt = plate.tilt_deviation(&core::array::from_fn(alone));
        let Pose { tilt_x, tilt_y, .. } = of(|it| it.surroundings);
        self.told = Uncertainty {
            z: Micrometre(COVERAGE * root_sum_square(&pistons)),
            tilt: Radian(COVERAGE * root_sum_square(&[tilt.0, tilt_x.0, tilt_y.0])),
        };
    }
}

fn root_sum_square(values: &[f32]) -> f32 {
    sqrt(values.iter().map(|value| value * value).sum())
}
