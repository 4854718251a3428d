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

/// Finds the fixed point of a function by secants. Where a strong heat loss makes every round overshoot, going from
/// value to value would run away.
#[derive(Clone, Copy)]
pub(super) struct Secant {
    /// Slope of the function as long as no two of its values are known.
    usual_slope: f64,
    last: Option<(f64, f64)>,
}

impl Secant {
    pub(super) fn new(usual_slope: f64) -> Self {
        Self {
            usual_slope,
            last: None,
        }
    }

    /// The next guess, when the function has this value at the last one.
    pub(super) fn next(&mut self, guess: f64, value: f64) -> f64 {
        let off = value - guess;
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
}
