//! One step of a lag, and the fixed point of a function.

/// A first-order lag over one step with an input that runs straight, ready to be used again and again.
#[derive(Clone, Copy)]
pub(super) struct Lag {
    keeps: f64,
    takes_start: f64,
    /// How much of the input at the step's end arrives by then.
    pub(super) takes_end: f64,
}

impl Lag {
    pub(super) fn new(tau_s: f64, h: f64) -> Self {
        if tau_s < 1e-9 || h <= 0.0 {
            return Self {
                keeps: 0.0,
                takes_start: 0.0,
                takes_end: 1.0,
            };
        }
        let keeps = (-h / tau_s).exp();
        let mean = tau_s / h * (1.0 - keeps);
        Self {
            keeps,
            takes_start: mean - keeps,
            takes_end: 1.0 - mean,
        }
    }

    pub(super) fn after(&self, x: f64, from: f64, to: f64) -> f64 {
        self.keeps * x + self.takes_start * from + self.takes_end * to
    }
}

/// An overshoot is taken back to this part of its step.
const RETREAT: f64 = 0.125;
/// So many times at most.
const RETREATS: usize = 8;

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
            // The function is no longer what it was: other lanes have changed.
            (self.from, self.last) = (None, None);
        }
        self.retreats = 0;
        let before = self.last.replace((guess, off));
        let Some((guess_before, off_before)) = before else {
            return guess + off / (1.0 - self.usual_slope);
        };
        let slope = (off - off_before) / (guess - guess_before);
        // Falling, as it is where a fixed point attracts in time; anything else is noise of equal guesses.
        if slope < -1e-3 && slope.is_finite() {
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
