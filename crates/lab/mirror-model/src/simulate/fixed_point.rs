//! The fixed point of a function, by secants.

/// A step is an overshoot where the function is off by more than its inverse times that step, and is taken back to this part
/// of itself.
const RETREAT: f64 = 0.125;
/// So many times at most: to 6e-8 of the step, below which a guess in kelvins is rounding.
const RETREATS: usize = 8;
/// A slope of the difference to the fixed point that is not below this is noise of equal guesses.
const FALLING: f64 = -1e-3;

/// Finds the fixed point of a function by secants. Where a strong heat loss makes every round overshoot, going from
/// value to value would run away; where it grows with a power of temperature, so would the first step.
#[derive(Clone, Copy)]
pub(super) struct Secant {
    /// Slope of the function as long as no two of its values are known.
    usual_slope: f64,
    /// A guess from which the first one is a step, if it is one.
    from: Option<f64>,
    last: Option<(f64, f64)>,
    /// How often the last step was taken back.
    retreats: usize,
    /// Whether any was.
    pub(super) has_retreated: bool,
}

impl Secant {
    pub(super) fn new(usual_slope: f64, from: Option<f64>) -> Self {
        Self {
            usual_slope: usual_slope.min(0.0),
            from,
            last: None,
            retreats: 0,
            has_retreated: false,
        }
    }

    /// The next guess, when the function has this value at the last one.
    pub(super) fn next(&mut self, guess: f64, value: f64) -> f64 {
        let off = value - guess;
        if let Some(from) = self.goes_too_far(guess, off) {
            if self.retreats < RETREATS {
                self.retreats += 1;
                self.has_retreated = true;
                return from + RETREAT * (guess - from);
            }
            // The function is no longer what it was: other actuators have changed.
            (self.from, self.last) = (None, None);
        }
        self.retreats = 0;
        let before = self.last.replace((guess, off));
        let Some((guess_before, off_before)) = before else {
            return guess + off / (1.0 - self.usual_slope);
        };
        let slope = (off - off_before) / (guess - guess_before);
        // Falling, as it is where a fixed point attracts in time; anything else is noise of equal guesses.
        if slope < FALLING && slope.is_finite() {
            guess - off / slope
        } else {
            value
        }
    }

    /// The guess before, if this one is off many times further than that one, or than its whole step.
    fn goes_too_far(&self, guess: f64, off: f64) -> Option<f64> {
        let (from, usual) = match self.last {
            Some((before, off_before)) => (before, off_before),
            None => (self.from?, guess - self.from?),
        };
        (off.is_nan() || RETREAT * off.abs() > usual.abs()).then_some(from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The guess after so many rounds on a function, from a first guess.
    fn found(function: impl Fn(f64) -> f64, first: f64, slope: f64, rounds: usize) -> f64 {
        let mut secant = Secant::new(slope, None);
        (0..rounds).fold(first, |guess, _| secant.next(guess, function(guess)))
    }

    #[test]
    fn a_straight_line_is_solved_by_its_slope_in_one_round() {
        // x = 10 - 3 x at 2.5.
        assert_eq!(found(|x| 10.0 - 3.0 * x, 1.0, -3.0, 1), 2.5);
    }

    #[test]
    fn a_steep_fall_that_iteration_would_run_away_from_is_solved() {
        // Going from value to value diverges where the slope is beyond -1; x = 100 / (1 + x^2) at x^3 + x = 100.
        let root = found(|x| 100.0 / (1.0 + x * x), 1.0, 0.0, 30);
        assert!((root.powi(3) + root - 100.0).abs() < 1e-6, "{root}");
    }

    #[test]
    fn a_first_step_into_a_power_of_the_guess_is_taken_back() {
        // The step from 0 to 1 makes the function 1e6 times as large: it shrinks until the function is of the step's size.
        let mut secant = Secant::new(0.0, Some(0.0));
        let first = secant.next(1.0, 1e6);
        assert_eq!(first, RETREAT);
        assert!(secant.has_retreated);
        assert_eq!(secant.next(first, 1e6), RETREAT * first);
    }
}
