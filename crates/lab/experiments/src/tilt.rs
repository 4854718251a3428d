//! How the plate tilts while its piston goes through a signal.

use std::f64::consts::TAU;

/// A tilt (rad) in step with the cycles of the piston's signal.
#[derive(Clone, Debug, PartialEq)]
pub enum Tilt {
    /// A sine from its mean upwards, beside a sine or a triangle of the piston.
    Sine(Turns),
    /// Straight lines from the mean up, down, and back, beside the same.
    Triangle(Turns),
    /// In a straight line from value to value, each with the piston's own.
    Lines(Vec<f64>),
}

/// The numbers of a tilt that repeats itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turns {
    /// Its middle (rad).
    pub mean: f64,
    /// From its middle to its top (rad).
    pub amplitude: f64,
    /// Whole turns in one cycle of the piston's signal.
    pub per_cycle: u16,
    /// Where in its turn the cycle begins, 0 to 1.
    pub start: f64,
}

/// How often frames and lines begin in a cycle, evenly: what instruments that follow triggers are told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Beginnings {
    /// Frames in a cycle.
    pub frames: u16,
    /// Lines in a cycle.
    pub lines: u16,
}

impl Tilt {
    /// How often it repeats itself in one cycle of the piston's signal.
    pub fn per_cycle(&self) -> u32 {
        match self {
            Self::Sine(turns) | Self::Triangle(turns) => u32::from(turns.per_cycle).max(1),
            Self::Lines(_) => 1,
        }
    }

    /// Its value after so many cycles of the piston's signal (rad).
    pub fn at(&self, cycles: f64) -> f64 {
        match self {
            Self::Sine(turns) => turns.mean + turns.amplitude * (TAU * turns.at(cycles)).sin(),
            Self::Triangle(turns) => {
                // In quarters of a turn since the lowest point.
                let quarters = 4.0 * (turns.at(cycles) + 0.25).fract();
                turns.mean + turns.amplitude * (1.0 - (quarters - 2.0).abs())
            }
            Self::Lines(values) => between(values, cycles),
        }
    }

    /// The lowest and the highest value (rad).
    pub fn range(&self) -> (f64, f64) {
        match self {
            Self::Sine(turns) | Self::Triangle(turns) => {
                let reach = turns.amplitude.abs();
                (turns.mean - reach, turns.mean + reach)
            }
            Self::Lines(values) => span(values),
        }
    }
}

impl Turns {
    fn at(&self, cycles: f64) -> f64 {
        cycles * f64::from(self.per_cycle) + self.start
    }
}

/// Where straight lines from value to value are after so many cycles.
pub(crate) fn between(values: &[f64], cycles: f64) -> f64 {
    let place = cycles.rem_euclid(1.0) * values.len().saturating_sub(1) as f64;
    match values.get(place as usize..) {
        Some([from, to, ..]) => from + place.fract() * (to - from),
        Some([last]) => *last,
        _ => f64::NAN,
    }
}

/// The lowest and the highest of these.
pub(crate) fn span(values: &[f64]) -> (f64, f64) {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    values.iter().fold(none, |(low, high), value| {
        (low.min(*value), high.max(*value))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_tilt_turns_so_often_a_cycle_from_where_it_begins() {
        let turns = Turns {
            mean: 1.0,
            amplitude: 0.5,
            per_cycle: 2,
            start: 0.75,
        };
        for (cycles, sine, triangle) in [
            (0.0, 0.5, 0.5),
            (0.125, 1.0, 1.0),
            (0.25, 1.5, 1.5),
            (0.0625, 1.0 - 0.5 * 0.5_f64.sqrt(), 0.75),
        ] {
            for whole in [0.0, 3.0] {
                let at = whole + cycles;
                assert_relative_eq!(Tilt::Sine(turns).at(at), sine, epsilon = 1e-12);
                assert_relative_eq!(Tilt::Triangle(turns).at(at), triangle, epsilon = 1e-12);
            }
        }
        assert_eq!(Tilt::Sine(turns).range(), (0.5, 1.5));
    }

    #[test]
    fn lines_go_through_their_values_in_a_cycle() {
        let lines = Tilt::Lines(vec![0.0, 2.0, 1.0]);
        assert_eq!(
            [0.0, 0.25, 0.5, 0.75].map(|at| lines.at(at)),
            [0.0, 1.0, 2.0, 1.5]
        );
        assert_eq!(lines.range(), (0.0, 2.0));
    }
}
