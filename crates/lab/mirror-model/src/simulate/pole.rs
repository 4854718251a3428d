//! One step of a first-order pole.

/// A time constant below this, or a step that does not last, has the pole follow its input at once (s).
const INSTANT_S: f64 = 1e-9;

/// A pole of unit gain, tau x' = u - x, over one step with an input that runs straight (first-order hold), ready to be used
/// again and again: x(h) = pole x(0) + start_gain u(0) + end_gain u(h).
#[derive(Clone, Copy)]
pub(super) struct Pole {
    pole: f64,
    start_gain: f64,
    /// How much of the input at the step's end arrives by then.
    pub(super) end_gain: f64,
}

impl Pole {
    /// Of a time constant over a step of `h` (both in s).
    pub(super) fn new(tau_s: f64, h: f64) -> Self {
        if tau_s < INSTANT_S || h <= 0.0 {
            return Self {
                pole: 0.0,
                start_gain: 0.0,
                end_gain: 1.0,
            };
        }
        let pole = (-h / tau_s).exp();
        let mean = tau_s / h * (1.0 - pole);
        Self {
            pole,
            start_gain: mean - pole,
            end_gain: 1.0 - mean,
        }
    }

    /// The state at the step's end, from that at its start and the input at both.
    pub(super) fn after(&self, x: f64, from: f64, to: f64) -> f64 {
        self.pole * x + self.start_gain * from + self.end_gain * to
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of some operations on numbers of order 1.
    const ROUNDING: f64 = 1e-14;

    #[test]
    fn a_step_of_the_input_is_answered_by_an_exponential() {
        let pole = Pole::new(2e-3, 1e-3);
        let answer = 1.0 - (-0.5_f64).exp();
        assert!((pole.after(0.0, 1.0, 1.0) - answer).abs() < ROUNDING);
        assert!((pole.after(1.0, 1.0, 1.0) - 1.0).abs() < ROUNDING, "gain 1");
    }

    #[test]
    fn a_ramp_of_the_input_is_followed_exactly_in_one_step_or_many() {
        // x' = (t - x) / tau from rest: x = t - tau (1 - exp(-t / tau)).
        let (tau_s, end_s) = (3e-3, 8e-3);
        let exact = end_s - tau_s * (1.0 - f64::exp(-end_s / tau_s));
        let once = Pole::new(tau_s, end_s).after(0.0, 0.0, end_s);
        let eighth = Pole::new(tau_s, end_s / 8.0);
        let often = (0..8).fold(0.0, |x, step| {
            let at = |step: i32| end_s * f64::from(step) / 8.0;
            eighth.after(x, at(step), at(step + 1))
        });
        assert!((once - exact).abs() < ROUNDING && (often - exact).abs() < ROUNDING);
    }

    #[test]
    fn no_time_constant_is_no_lag() {
        assert_eq!(Pole::new(0.0, 1e-3).after(5.0, 1.0, 2.0), 2.0);
    }
}
