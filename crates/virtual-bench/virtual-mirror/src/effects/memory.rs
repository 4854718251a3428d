//! What the displacement remembers: friction, relaxation, yield, contact.

use super::catalogue::{Effect, Effects};
use crate::per_actuator::PerActuator;

/// Dahl friction: a force that builds up over a length and saturates, with the direction of motion (P. Dahl, A Solid
/// Friction Model, 1968).
#[derive(Clone, Copy, Debug)]
struct Friction {
    /// Half the width of the widest loop (m).
    height: f64,
    /// Motion over which it turns round (m).
    length: f64,
    held_back: PerActuator,
}

impl Friction {
    /// The paper's loop at 0.1 Hz is 1.6 um wide: twice the height.
    fn new(strength: f64) -> Self {
        Self {
            height: 0.8e-6 * strength,
            length: 12e-6,
            held_back: PerActuator::ZERO,
        }
    }

    fn advanced(mut self, moved: PerActuator) -> Self {
        let target = moved.map(|m| {
            if m == 0.0 {
                0.0
            } else {
                m.signum() * self.height
            }
        });
        let left = moved.map(|m| (-m.abs() / self.length).exp());
        self.held_back = target + (self.held_back - target) * left;
        self
    }

    fn rate(&self, rate: PerActuator) -> PerActuator {
        let target = rate.map(|r| {
            if r == 0.0 {
                0.0
            } else {
                r.signum() * self.height
            }
        });
        rate.abs() * (target - self.held_back) * (1.0 / self.length)
    }
}

/// Relaxation times of the films (s) and how the compliance spreads over them: a power law's spectrum, five elements that
/// end within the 30 s in which the paper's step stops creeping.
const CREEP: [(f64, f64); 5] = [
    (0.12, 0.13),
    (0.6, 0.17),
    (2.5, 0.20),
    (8.0, 0.24),
    (25.0, 0.26),
];

/// A chain of Kelvin-Voigt elements, 2 % of the displacement altogether at strength 1.
#[derive(Clone, Copy, Debug)]
struct Creep {
    compliance: f64,
    crept: [PerActuator; CREEP.len()],
}

impl Creep {
    fn new(strength: f64) -> Self {
        Self {
            compliance: 0.02 * strength,
            crept: [PerActuator::ZERO; CREEP.len()],
        }
    }

    /// Exact for an input that moves in a straight line.
    fn advanced(mut self, from: PerActuator, to: PerActuator, h: f64) -> Self {
        for (crept, (tau, _)) in self.crept.iter_mut().zip(CREEP) {
            let left = (-h / tau).exp();
            let lag = (to - from) * (tau / h);
            *crept = to - lag + (*crept - from + lag) * left;
        }
        self
    }

    fn extra(&self) -> PerActuator {
        let elements = self.crept.iter().zip(CREEP);
        elements.fold(PerActuator::ZERO, |sum, (crept, (_, weight))| {
            sum + *crept * weight
        }) * self.compliance
    }

    fn rate(&self, input: PerActuator) -> PerActuator {
        let elements = self.crept.iter().zip(CREEP);
        let rate = |sum, (crept, (tau, weight)): (&PerActuator, (f64, f64))| {
            sum + (input - *crept) * (weight / tau)
        };
        elements.fold(PerActuator::ZERO, rate) * self.compliance
    }
}

/// History of the four actuators' displacements.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Memory {
    friction: Option<Friction>,
    creep: Option<Creep>,
}

impl Memory {
    pub(crate) fn new(effects: &Effects) -> Self {
        Self {
            friction: effects.active(Effect::Hysteresis).map(Friction::new),
            creep: effects.active(Effect::Creep).map(Creep::new),
        }
    }

    /// The history after the static displacement has moved on within `h` seconds.
    pub(crate) fn advanced(mut self, from: PerActuator, to: PerActuator, h: f64) -> Self {
        self.friction = self.friction.map(|friction| friction.advanced(to - from));
        self.creep = self.creep.map(|creep| creep.advanced(from, to, h));
        self
    }

    /// Displacement and its rate with history, from those without.
    pub(crate) fn outlet(
        &self,
        value: PerActuator,
        rate: PerActuator,
    ) -> (PerActuator, PerActuator) {
        let (mut with, mut with_rate) = (value, rate);
        if let Some(friction) = &self.friction {
            with = with - friction.held_back;
            with_rate = with_rate - friction.rate(rate);
        }
        if let Some(creep) = &self.creep {
            with += creep.extra();
            with_rate += creep.rate(value);
        }
        (with, with_rate)
    }
}

/// Aluminium that yields above a temperature and keeps part of the strain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Yield {
    above_k: f64,
    kept: f64,
}

impl Yield {
    pub(crate) fn new(effects: &Effects) -> Option<Self> {
        effects.active(Effect::Softening).map(|strength| Self {
            above_k: 65.0,
            kept: 0.05 * strength,
        })
    }

    /// Plastic strain of a cell (as kelvins of expansion) that has now seen `theta`.
    pub(crate) fn advanced(&self, plastic: PerActuator, theta: PerActuator) -> PerActuator {
        plastic.max((theta - PerActuator::splat(self.above_k)) * self.kept)
    }
}

/// Sticking near the substrate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stiction {
    pull: f64,
    stuck: bool,
}

impl Stiction {
    /// Where it snaps and where it lets go (m).
    const SNAPS: f64 = 85e-6;
    const RELEASES: f64 = 70e-6;

    pub(crate) fn new(effects: &Effects) -> Option<Self> {
        effects.active(Effect::Stiction).map(|strength| Self {
            pull: 1.5e-6 * strength,
            stuck: false,
        })
    }

    pub(crate) fn advanced(mut self, piston: f64) -> Self {
        self.stuck = piston
            > if self.stuck {
                Self::RELEASES
            } else {
                Self::SNAPS
            };
        self
    }

    pub(crate) fn pull(&self) -> f64 {
        if self.stuck { self.pull } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn only(effect: Effect) -> Memory {
        let mut effects = Effects::default();
        effects.set(effect, 1.0);
        Memory::new(&effects)
    }

    /// Output (um) while the input goes through `turns` (um) in `parts` steps each, `h` seconds a step.
    fn follow(mut memory: Memory, turns: &[f64], parts: u32, h: f64) -> f64 {
        let mut at = 0.0;
        for turn in turns {
            for part in 1..=parts {
                let to = at + (turn - at) * f64::from(part) / f64::from(parts);
                let from = at + (turn - at) * f64::from(part - 1) / f64::from(parts);
                memory = memory.advanced(
                    PerActuator::splat(from * 1e-6),
                    PerActuator::splat(to * 1e-6),
                    h,
                );
            }
            at = *turn;
        }
        memory
            .outlet(PerActuator::splat(at * 1e-6), PerActuator::ZERO)
            .0
            .0[0]
            * 1e6
    }

    #[test]
    fn friction_knows_the_way_but_not_the_time() {
        let (up, down) = ([60.0], [120.0, 60.0]);
        let friction = only(Effect::Hysteresis);
        let width = follow(friction, &down, 10, 1.0) - follow(friction, &up, 10, 1.0);
        // After 60 um, five of its lengths, friction lacks e^-5 = 0.7 % on the way up and twice that on the way down.
        approx::assert_relative_eq!(width, 1.6, max_relative = 0.02);
        assert_eq!(
            follow(friction, &up, 10, 1.0),
            follow(friction, &up, 10, 1e-4)
        );
        approx::assert_relative_eq!(
            follow(friction, &down, 1, 1.0),
            follow(friction, &down, 100, 1.0),
            max_relative = 1e-12
        );
    }

    #[test]
    fn creep_is_exact_on_ramps_and_ends_at_its_compliance() {
        let creep = only(Effect::Creep);
        approx::assert_relative_eq!(
            follow(creep, &[100.0, 100.0], 1, 500.0),
            102.0,
            max_relative = 1e-9
        );
        approx::assert_relative_eq!(
            follow(creep, &[100.0], 1, 5.0),
            follow(creep, &[100.0], 50, 0.1),
            max_relative = 1e-9
        );
    }

    #[test]
    fn yielded_films_keep_the_hottest_moment() {
        let mut effects = Effects::default();
        effects.set(Effect::Softening, 1.0);
        let films = Yield::new(&effects).expect("softening is on");
        let hot = films.advanced(PerActuator::ZERO, PerActuator::splat(105.0));
        assert_eq!(hot.0[0], 2.0);
        assert_eq!(films.advanced(hot, PerActuator::splat(20.0)), hot);
    }

    #[test]
    fn the_plate_lets_go_later_than_it_snaps() {
        let mut effects = Effects::default();
        effects.set(Effect::Stiction, 1.0);
        let mut plate = Stiction::new(&effects).expect("stiction is on");
        let pulls = [60e-6, 80e-6, 90e-6, 80e-6, 60e-6].map(|z| {
            plate = plate.advanced(z);
            plate.pull() > 0.0
        });
        assert_eq!(pulls, [false, false, true, true, false]);
    }
}
