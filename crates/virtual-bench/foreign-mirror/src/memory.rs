//! What a lever remembers: friction and creep.

/// Radii of the play operators, as parts of the span: small ones for the turns of a loop, large ones for its width.
const RADII: [f64; 3] = [0.015, 0.04, 0.1];

/// Friction as play operators in parallel (Prandtl 1928).
#[derive(Clone, Debug)]
pub struct Friction {
    span: f64,
    weight: f64,
    held: [f64; RADII.len()],
}

impl Friction {
    /// Friction whose loop over `span` is so wide, as a part of it.
    pub fn new(width: f64, span: f64) -> Self {
        // On the way up every play is its radius behind, on the way down before.
        let weight = width / (2.0 * RADII.iter().sum::<f64>());
        Self {
            span,
            weight,
            held: [0.0; RADII.len()],
        }
    }

    /// Where it lets go to.
    pub fn follow(&mut self, free: f64) -> f64 {
        let mut there = free;
        for (held, radius) in self.held.iter_mut().zip(RADII) {
            let radius = radius * self.span;
            *held = held.clamp(free - radius, free + radius);
            there += self.weight * (*held - free);
        }
        there
    }
}

/// Creep as a chain of three Kelvin-Voigt elements: a spring beside a dashpot each.
#[derive(Clone, Debug)]
pub struct Creep {
    weight: f64,
    times_s: [f64; 3],
    given: [f64; 3],
}

impl Creep {
    /// Elements that each give way by `weight` of what is there, in such times (s).
    pub fn new(weight: f64, times_s: [f64; 3]) -> Self {
        Self {
            weight,
            times_s,
            given: [0.0; 3],
        }
    }

    /// So many seconds under what is there at once; returns where it is then.
    pub fn follow(&mut self, at_once: f64, seconds: f64) -> f64 {
        for (given, time_s) in self.given.iter_mut().zip(self.times_s) {
            *given += (self.weight * at_once - *given) * -(-seconds / time_s).exp_m1();
        }
        at_once + self.given.iter().sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_makes_a_loop_of_the_width_that_was_asked_for() {
        let mut friction = Friction::new(0.015, 2.0);
        let mut way = |to: f64| friction.follow(to);
        way(2.0);
        way(0.0);
        let up = way(1.0);
        way(2.0);
        let down = way(1.0);
        assert!((down - up - 0.015 * 2.0).abs() < 1e-12, "{up} and {down}");
    }

    #[test]
    fn creep_ends_where_the_springs_hold_it() {
        let mut creep = Creep::new(0.01, [0.3, 3.0, 30.0]);
        assert!((creep.follow(1.0, 0.0) - 1.0).abs() < 1e-12);
        // The digits of 1 - exp(-1) and 1 - exp(-1/10).
        assert!((creep.follow(1.0, 3.0) - 1.0 - 0.01 * (1.0 + 0.632_121 + 0.095_163)).abs() < 1e-6);
        assert!((creep.follow(1.0, 1e4) - 1.03).abs() < 1e-12);
    }
}
