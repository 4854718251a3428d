//! The plate as a mass on four springs: each of its three coordinates follows its static value through a second-order
//! mode, advanced exactly for an input that is a cubic in time.

/// A quantity and how fast it changes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Flow {
    pub(crate) value: f64,
    pub(crate) rate: f64,
}

/// Where the static value of a coordinate goes during one step: the cubic with these ends and end slopes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Course {
    pub(crate) from: Flow,
    pub(crate) to: Flow,
}

impl Course {
    /// How far the cubic leaves a parabola within a step of `h` seconds: where it does, a shorter step follows better.
    pub(crate) fn bend(&self, h: f64) -> f64 {
        ((self.from.rate + self.to.rate) * h - 2.0 * (self.to.value - self.from.value)).abs()
    }

    /// Coefficients in powers of the time since the step's start.
    fn cubic(&self, h: f64) -> [f64; 4] {
        let (a, b) = (self.from, self.to);
        let chord = (b.value - a.value) / h;
        [
            a.value,
            a.rate,
            (3.0 * chord - 2.0 * a.rate - b.rate) / h,
            (a.rate + b.rate - 2.0 * chord) / (h * h),
        ]
    }
}

/// A second-order mode, `x'' / w^2 + x' / (w Q) + x = u`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mode {
    omega: f64,
    decay: f64,
    ringing: f64,
    step: f64,
    /// `exp(-decay h)` times the cosine and the sine of the ringing angle over one step.
    turn: (f64, f64),
}

impl Mode {
    /// `frequency_hz` undamped, `q` above 0.5 (it rings).
    pub(crate) fn new(frequency_hz: f64, q: f64) -> Self {
        let omega = std::f64::consts::TAU * frequency_hz;
        let decay = omega / (2.0 * q);
        let ringing = (omega * omega - decay * decay).sqrt();
        Self {
            omega,
            decay,
            ringing,
            step: 0.0,
            turn: (1.0, 0.0),
        }
    }

    fn set_step(&mut self, h: f64) {
        if h != self.step {
            let shrink = (-self.decay * h).exp();
            let (sin, cos) = (self.ringing * h).sin_cos();
            self.turn = (shrink * cos, shrink * sin);
            self.step = h;
        }
    }

    /// Moves `state` on by `h` seconds while its static value takes `course`.
    pub(crate) fn advance(&mut self, state: Flow, course: &Course, h: f64) -> Flow {
        self.set_step(h);
        let u = course.cubic(h);
        let inertia = 1.0 / (self.omega * self.omega);
        let friction = 2.0 * self.decay * inertia;
        let p3 = u[3];
        let p2 = u[2] - 3.0 * friction * p3;
        let p1 = u[1] - 2.0 * friction * p2 - 6.0 * inertia * p3;
        let p0 = u[0] - friction * p1 - 2.0 * inertia * p2;
        let (x, v) = (state.value - p0, state.rate - p1);
        let (cos, sin) = self.turn;
        let lean = (v + self.decay * x) / self.ringing;
        Flow {
            value: p0 + h * (p1 + h * (p2 + h * p3)) + x * cos + lean * sin,
            rate: p1 + h * (2.0 * p2 + 3.0 * h * p3) + (lean * self.ringing - self.decay * x) * cos
                - (x * self.ringing + self.decay * lean) * sin,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STILL: Flow = Flow {
        value: 0.0,
        rate: 0.0,
    };

    fn held(value: f64) -> Course {
        let end = Flow { value, rate: 0.0 };
        Course { from: end, to: end }
    }

    #[test]
    fn a_step_rings_at_the_damped_frequency_and_settles() {
        let mut mode = Mode::new(1000.0, 20.0);
        let peak = mode.advance(STILL, &held(1.0), 0.5e-3).value;
        // The damped mode is slower by 1 / (8 Q^2) = 3e-4, so it is there a little after this.
        approx::assert_relative_eq!(
            peak,
            1.0 + (-std::f64::consts::PI / 40.0f64).exp(),
            max_relative = 1e-3
        );
        let end = mode.advance(STILL, &held(1.0), 1.0);
        approx::assert_relative_eq!(end.value, 1.0, max_relative = 1e-12);
    }

    #[test]
    fn two_half_steps_are_one_step_on_a_cubic() {
        let mut mode = Mode::new(700.0, 5.0);
        let c = [0.3, -20.0, 5e3, 4e6];
        let at = |t: f64| Flow {
            value: c[0] + t * (c[1] + t * (c[2] + t * c[3])),
            rate: c[1] + t * (2.0 * c[2] + 3.0 * t * c[3]),
        };
        let h = 1e-3;
        let whole = mode.advance(
            STILL,
            &Course {
                from: at(0.0),
                to: at(h),
            },
            h,
        );
        let half = mode.advance(
            STILL,
            &Course {
                from: at(0.0),
                to: at(h / 2.0),
            },
            h / 2.0,
        );
        let twice = mode.advance(
            half,
            &Course {
                from: at(h / 2.0),
                to: at(h),
            },
            h / 2.0,
        );
        approx::assert_relative_eq!(whole.value, twice.value, max_relative = 1e-10);
        approx::assert_relative_eq!(whole.rate, twice.rate, max_relative = 1e-9);
    }
}
