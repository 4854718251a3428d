//! Places in a cycle, a whole one being 2^32, and what a sine and a triangle are there.

use core::f32::consts::FRAC_PI_2;

use crate::waveform::{Curve, Tilt};

/// How far a tick goes in a cycle of so many hertz; never nowhere.
pub(crate) fn phase_step(frequency_hz: f32, tick_hz: u32) -> u32 {
    // In f64: a turn has more steps than f32 has digits.
    ((f64::from(frequency_hz) / f64::from(tick_hz) * 4_294_967_296.0) as u32).max(1)
}

/// The place in what begins again and again, a whole one being 2^32.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Course {
    place: u32,
    step: u32,
}

impl Course {
    /// One that begins with the next tick, and goes on by `step` in each.
    pub(crate) fn of(step: u32) -> Self {
        Self { place: 0, step }
    }

    /// A tick passes; whether another one begins with the next.
    pub(crate) fn pass(&mut self) -> bool {
        let (place, begins) = self.place.overflowing_add(self.step);
        self.place = place;
        begins
    }
}

impl Tilt {
    /// Its share of the amplitude at a place in the waveform's cycle, a whole one being 2^32.
    pub(crate) fn at_turn(&self, phase: u32) -> f32 {
        let start = u32::from(self.start) << 16;
        let place = phase.wrapping_mul(self.turns.into()).wrapping_add(start);
        match self.curve {
            Curve::Sine => sine(folded(place)),
            Curve::Triangle => folded(place),
        }
    }
}

/// A turn folded into quarters: up from 0 to 1, down to -1 and back, in straight lines.
pub(crate) fn folded(phase: u32) -> f32 {
    let signed = phase as i32;
    // In the second and third quarter the two highest bits differ.
    let folded = if signed ^ (signed << 1) < 0 {
        i32::MIN.wrapping_sub(signed)
    } else {
        signed
    };
    folded as f32 / 1_073_741_824.0
}

/// The sine of so many quarter turns, -1 to 1: its series, whose remainder stays below 4e-6.
pub(crate) fn sine(quarters: f32) -> f32 {
    let x = quarters * FRAC_PI_2;
    let square = x * x;
    let series = [1.0 / 362_880.0, -1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0, 1.0];
    x * series.iter().fold(0.0, |sum, term| sum * square + term)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_goes_up_down_and_back() {
        let eighth = 1_u32 << 29;
        let shares = [0.0, 0.5, 1.0, 0.5, 0.0, -0.5, -1.0, -0.5];
        for (place, share) in (0_u32..).zip(shares) {
            assert_eq!(folded(place * eighth), share);
        }
    }

    #[test]
    fn a_sine_is_off_by_what_its_series_leaves_out() {
        for hundredth in -100_i8..=100 {
            let quarters = f32::from(hundredth) / 100.0;
            let exact = (f64::from(quarters) * std::f64::consts::FRAC_PI_2).sin();
            // (pi/2)^11 / 11! is the first term left out, and three roundings of f32.
            assert!((f64::from(sine(quarters)) - exact).abs() < 3.6e-6 + 3.0 * 6e-8);
        }
    }

    #[test]
    fn the_slowest_cycle_goes_on() {
        assert_eq!(phase_step(1e-9, 10_000), 1);
        assert_eq!(phase_step(2500.0, 10_000), 1 << 30);
    }
}
