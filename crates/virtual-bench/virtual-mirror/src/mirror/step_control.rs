//! How long the next step may be: error control as in E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential
//! Equations I, section II.4.

/// Shortest step (s): what it comes to is kept, whatever its error.
pub(crate) const SHORTEST_S: f64 = 1e-9;
/// First step (s): a tick of the control loop.
const FIRST_S: f64 = 1e-4;
/// The next step aims at this part of the one whose error would be just allowed (0.8 to 0.9, eq. 4.13).
const SAFETY: f64 = 0.85;
/// How much longer than the one before the next step may be, and how much shorter than a refused one.
const LONGER: f64 = 4.0;
const SHORTER: (f64, f64) = (0.1, 0.7);
/// Error below which a step counts as without one, in units of what is allowed.
const NO_ERROR: f64 = 1e-9;

/// The length of the steps.
#[derive(Clone, Debug)]
pub(crate) struct StepControl {
    /// Length that the error would allow now (s).
    stride_s: f64,
    longest_s: f64,
}

impl StepControl {
    /// Steps of at most `longest_s` seconds.
    pub(crate) fn new(longest_s: f64) -> Self {
        Self {
            stride_s: FIRST_S,
            longest_s,
        }
    }

    /// The next step's length (s): the stride, or what remains, in equal parts when that is less than two.
    pub(crate) fn next(&self, remaining_s: f64) -> f64 {
        if remaining_s <= self.stride_s {
            remaining_s
        } else {
            self.stride_s.min(0.5 * remaining_s)
        }
    }

    /// Adapts the stride to the error, in units of what is allowed, of a step of `h_s` seconds: the error of the
    /// second-order solution grows with the cube of the step. A step that was short because little time remained
    /// shortens nothing.
    pub(crate) fn adapt(&mut self, h_s: f64, error: f64, accepted: bool) {
        let factor = SAFETY * (1.0 / error.max(NO_ERROR)).cbrt();
        if !accepted {
            self.stride_s = h_s * factor.clamp(SHORTER.0, SHORTER.1);
        } else if h_s * factor > self.stride_s || factor < 1.0 {
            self.stride_s = (h_s * factor.min(LONGER)).clamp(SHORTEST_S, self.longest_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_of_eight_times_what_is_allowed_asks_for_less_than_half_the_step() {
        let mut control = StepControl::new(1.0);
        control.adapt(1e-3, 8.0, false);
        approx::assert_relative_eq!(control.next(1.0), SAFETY * 0.5e-3, max_relative = 1e-12);
    }

    #[test]
    fn strides_grow_at_most_fourfold_and_up_to_the_longest() {
        let mut control = StepControl::new(1e-3);
        control.adapt(1e-4, 0.0, true);
        assert_eq!(control.next(1.0), 4e-4);
        control.adapt(4e-4, 0.0, true);
        assert_eq!(control.next(1.0), 1e-3);
    }

    #[test]
    fn what_remains_is_divided_evenly_and_does_not_shorten_the_stride() {
        let mut control = StepControl::new(1.0);
        assert_eq!(control.next(1.5 * FIRST_S), 0.75 * FIRST_S);
        assert_eq!(control.next(0.25 * FIRST_S), 0.25 * FIRST_S);
        control.adapt(1e-8, 0.5, true);
        assert_eq!(control.next(1.0), FIRST_S);
    }
}
