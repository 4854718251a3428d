//! The four actuators side by side: one number each, handled together so that the compiler vectorises.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// One number for each of the four actuators.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(32))]
pub(crate) struct PerActuator(pub(crate) [f64; 4]);

impl PerActuator {
    pub(crate) const ZERO: Self = Self([0.0; 4]);

    #[inline(always)]
    pub(crate) fn splat(value: f64) -> Self {
        Self([value; 4])
    }

    #[inline(always)]
    pub(crate) fn map(self, f: impl Fn(f64) -> f64) -> Self {
        // Written out, as in `zip`: `array::map` stays a loop at lower optimisation.
        let a = self.0;
        Self([f(a[0]), f(a[1]), f(a[2]), f(a[3])])
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let (a, b) = (self.0, other.0);
        Self([f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])])
    }

    /// Each actuator's two neighbours around the plate, summed.
    #[inline(always)]
    pub(crate) fn neighbours(self) -> Self {
        let [a, b, c, d] = self.0;
        Self([b + d, c + a, d + b, a + c])
    }

    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        self.map(f64::abs)
    }

    #[inline(always)]
    pub(crate) fn sum(self) -> f64 {
        (self.0[0] + self.0[1]) + (self.0[2] + self.0[3])
    }

    pub(crate) fn largest(self) -> f64 {
        self.0.into_iter().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Sine and cosine by their series, good to 2e-9 and 2e-8 up to 1.2 rad: one call a cell and actuator to the
    /// system's own would cost more than all the rest.
    #[inline(always)]
    pub(crate) fn sin_cos(self) -> (Self, Self) {
        let x2 = self * self;
        let series = |coefficients: [f64; 5]| {
            let tail = coefficients
                .into_iter()
                .fold(Self::ZERO, |sum, c| (sum + Self::splat(c)) * x2);
            Self::splat(1.0) + tail
        };
        (
            self * series([
                -1.0 / 39_916_800.0,
                1.0 / 362_880.0,
                -1.0 / 5040.0,
                1.0 / 120.0,
                -1.0 / 6.0,
            ]),
            series([
                -1.0 / 3_628_800.0,
                1.0 / 40_320.0,
                -1.0 / 720.0,
                1.0 / 24.0,
                -0.5,
            ]),
        )
    }
}

macro_rules! per_actuator {
    ($trait:ident, $method:ident, $op:tt) => {
        impl $trait for PerActuator {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| a $op b)
            }
        }
    };
}
per_actuator!(Add, add, +);
per_actuator!(Sub, sub, -);
per_actuator!(Mul, mul, *);
per_actuator!(Div, div, /);

impl Mul<f64> for PerActuator {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self.map(|a| a * factor)
    }
}

impl Neg for PerActuator {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl AddAssign for PerActuator {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_are_sine_and_cosine() {
        for i in -120..=120 {
            let x = f64::from(i) * 0.01;
            let (sin, cos) = PerActuator::splat(x).sin_cos();
            // The first terms that are left out, at 1.2: x^13 / 13! = 1.7e-9, and x^12 / 12! = 1.9e-8.
            approx::assert_abs_diff_eq!(sin.0[0], x.sin(), epsilon = 2e-9);
            approx::assert_abs_diff_eq!(cos.0[3], x.cos(), epsilon = 2e-8);
        }
    }
}
