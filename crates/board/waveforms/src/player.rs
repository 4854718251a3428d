//! A waveform as it is played, a value a control tick.

use core::f32::consts::FRAC_PI_2;

use crate::waveform::{FULL_SCALE, Flaw, Shape, Table, Waveform};

/// Plays a waveform.
///
/// The value of a tick is that of the waveform in the tick's middle, so that the steps that come out
/// are where the curve is on average. After the last cycle a sine and a triangle stay in their
/// middle, a table at its last point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Player {
    waveform: Waveform,
    cycles_left: u32,
    /// Of sines and triangles: the place in the cycle, a whole turn being 2^32.
    phase: u32,
    phase_step: u32,
    /// Of tables: the point, and the ticks since it began.
    point: u16,
    ticks: u32,
}

impl Player {
    /// A player at the waveform's start, for a board of `tick_hz` control ticks a second.
    ///
    /// # Errors
    /// What makes the waveform unplayable.
    pub fn new(waveform: Waveform, tick_hz: u32) -> Result<Self, Flaw> {
        waveform.check(tick_hz)?;
        let phase_step = match waveform.shape {
            Shape::Sine { frequency_hz } | Shape::Triangle { frequency_hz } => {
                // In f64: a turn has more steps than f32 has digits. Never below one step.
                ((f64::from(frequency_hz) / f64::from(tick_hz) * 4_294_967_296.0) as u32).max(1)
            }
            Shape::Steps(_) | Shape::Lines(_) => 0,
        };
        Ok(Self {
            waveform,
            cycles_left: waveform.cycles,
            phase: phase_step / 2,
            phase_step,
            point: 0,
            ticks: 0,
        })
    }

    /// What is played.
    pub fn waveform(&self) -> &Waveform {
        &self.waveform
    }

    /// Whether all cycles are over.
    pub fn is_over(&self) -> bool {
        self.cycles_left == 0
    }

    /// The value of the next tick. `point` tells the board's points by their index.
    pub fn next(&mut self, point: impl Fn(usize) -> i16) -> f32 {
        let shape = match self.waveform.shape {
            Shape::Sine { .. } => self.turn(sine),
            Shape::Triangle { .. } => self.turn(|quarters| quarters),
            Shape::Steps(table) => self.step(table, point),
            Shape::Lines(table) => self.line(table, point),
        };
        self.waveform.offset + self.waveform.amplitude * shape
    }

    fn turn(&mut self, shape: impl Fn(f32) -> f32) -> f32 {
        if self.is_over() {
            return 0.0;
        }
        let value = shape(folded(self.phase));
        let (phase, turned) = self.phase.overflowing_add(self.phase_step);
        self.phase = phase;
        self.cycles_left -= u32::from(turned);
        value
    }

    fn step(&mut self, table: Table, point: impl Fn(usize) -> i16) -> f32 {
        let value = share(point(usize::from(self.point)));
        self.pass(table, table.points);
        value
    }

    fn line(&mut self, table: Table, point: impl Fn(usize) -> i16) -> f32 {
        let last = usize::from(table.points) - 1;
        if self.is_over() {
            return share(point(last));
        }
        let from = share(point(usize::from(self.point)));
        let to = share(point(usize::from(self.point) + 1));
        let part = (self.ticks as f32 + 0.5) / table.dwell_ticks as f32;
        self.pass(table, table.points - 1);
        from + part * (to - from)
    }

    /// A tick passes in a table with so many dwells; at the end the last one stays.
    fn pass(&mut self, table: Table, dwells: u16) {
        if self.is_over() {
            return;
        }
        self.ticks += 1;
        if self.ticks < table.dwell_ticks {
            return;
        }
        self.ticks = 0;
        if self.point + 1 < dwells {
            self.point += 1;
            return;
        }
        self.cycles_left -= 1;
        if !self.is_over() {
            self.point = 0;
        }
    }
}

/// A point as a share of the amplitude.
fn share(point: i16) -> f32 {
    f32::from(point) / f32::from(FULL_SCALE)
}

/// A turn folded into quarters: up from 0 to 1, down to -1 and back, in straight lines.
fn folded(phase: u32) -> f32 {
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
fn sine(quarters: f32) -> f32 {
    let x = quarters * FRAC_PI_2;
    let square = x * x;
    let series = [1.0 / 362_880.0, -1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0, 1.0];
    x * series.iter().fold(0.0, |sum, term| sum * square + term)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::waveform::{POINTS, Quantity};
    use proptest::prelude::*;
    use std::vec::Vec;

    const TICK_HZ: u32 = 10_000;

    fn waveform(shape: Shape, offset: f32, amplitude: f32, cycles: u32) -> Waveform {
        Waveform {
            quantity: Quantity::Position,
            shape,
            offset,
            amplitude,
            cycles,
            ends_off: false,
        }
    }

    fn play(waveform: Waveform, points: &[i16]) -> Vec<f32> {
        let mut player = Player::new(waveform, TICK_HZ).expect("playable");
        let mut values = Vec::new();
        while !player.is_over() {
            values.push(player.next(|i| points[i]));
        }
        let last = player.next(|i| points[i]);
        values.push(last);
        assert_eq!(player.next(|i| points[i]), last, "it stays");
        values
    }

    proptest! {
        #[test]
        fn a_sine_has_its_offset_amplitude_frequency_and_cycles(
            frequency_hz in 5.0_f32..500.0,
            offset in -100.0_f32..100.0,
            amplitude in 0.1_f32..100.0,
            cycles in 1_u32..4,
        ) {
            let values = play(waveform(Shape::Sine { frequency_hz }, offset, amplitude, cycles), &[]);
            let (end, sine) = values.split_last().unwrap();
            prop_assert_eq!(*end, offset);
            let ticks = f64::from(cycles) * f64::from(TICK_HZ) / f64::from(frequency_hz);
            prop_assert!((sine.len() as f64 - ticks).abs() <= 1.0, "{} ticks of {ticks}", sine.len());
            for (tick, value) in sine.iter().enumerate() {
                let turns = (tick as f64 + 0.5) / f64::from(TICK_HZ) * f64::from(frequency_hz);
                let exact = f64::from(offset)
                    + f64::from(amplitude) * (std::f64::consts::TAU * turns).sin();
                let bound = 1e-5 * f64::from(amplitude) + 1e-6 * f64::from(offset.abs());
                prop_assert!((f64::from(*value) - exact).abs() < bound, "{value} for {exact}");
            }
        }

        #[test]
        fn a_triangle_has_straight_lines_and_its_extremes(
            frequency_hz in 1.0_f32..100.0,
            offset in -100.0_f32..100.0,
            amplitude in 1.0_f32..100.0,
        ) {
            let values = play(waveform(Shape::Triangle { frequency_hz }, offset, amplitude, 1), &[]);
            let slope = 4.0 * amplitude * frequency_hz / TICK_HZ as f32;
            for pair in values[..values.len() - 1].windows(2) {
                prop_assert!((pair[1] - pair[0]).abs() <= slope * 1.01 + 1e-4);
            }
            let highest = values.iter().fold(f32::MIN, |a, b| a.max(*b));
            let lowest = values.iter().fold(f32::MAX, |a, b| a.min(*b));
            prop_assert!((highest - offset - amplitude).abs() <= slope);
            prop_assert!((offset - lowest - amplitude).abs() <= slope);
        }

        #[test]
        fn steps_hold_each_point_for_its_dwell(
            points in proptest::collection::vec(any::<i16>(), 1..20),
            dwell_ticks in 1_u32..50,
            cycles in 1_u32..4,
        ) {
            let table = Table { points: points.len() as u16, dwell_ticks };
            let values = play(waveform(Shape::Steps(table), 1.0, 2.0, cycles), &points);
            prop_assert_eq!(values.len() - 1, points.len() * dwell_ticks as usize * cycles as usize);
            for (tick, value) in values[..values.len() - 1].iter().enumerate() {
                let point = points[tick / dwell_ticks as usize % points.len()];
                prop_assert_eq!(*value, 1.0 + 2.0 * share(point));
            }
            prop_assert_eq!(values[values.len() - 1], 1.0 + 2.0 * share(*points.last().unwrap()));
        }

        #[test]
        fn lines_pass_every_point_at_its_time(
            points in proptest::collection::vec(any::<i16>(), 2..20),
            dwell_ticks in 1_u32..50,
        ) {
            let table = Table { points: points.len() as u16, dwell_ticks };
            let values = play(waveform(Shape::Lines(table), 0.0, 1.0, 1), &points);
            for (tick, value) in values[..values.len() - 1].iter().enumerate() {
                let time = (tick as f32 + 0.5) / dwell_ticks as f32;
                let from = tick / dwell_ticks as usize;
                let (a, b) = (share(points[from]), share(points[from + 1]));
                let exact = a + (time - from as f32) * (b - a);
                prop_assert!((value - exact).abs() < 1e-4, "{value} for {exact}");
            }
            prop_assert_eq!(values[values.len() - 1], share(*points.last().unwrap()));
        }

        #[test]
        fn whatever_is_asked_is_refused_or_stays_within_its_amplitude(
            bits in any::<[u32; 3]>(), points: u16, dwell_ticks: u32, cycles: u32, kind in 0..4,
        ) {
            let [offset, amplitude, frequency_hz] = bits.map(f32::from_bits);
            let table = Table { points, dwell_ticks };
            let shape = match kind {
                0 => Shape::Sine { frequency_hz },
                1 => Shape::Triangle { frequency_hz },
                2 => Shape::Steps(table),
                _ => Shape::Lines(table),
            };
            let stored = [12_345_i16; POINTS];
            if let Ok(mut player) = Player::new(waveform(shape, offset, amplitude, cycles), TICK_HZ) {
                for _ in 0..100 {
                    let value = player.next(|i| stored[i]);
                    let reach = amplitude.abs() * 1.000_01;
                    prop_assert!(value >= offset - reach && value <= offset + reach, "{value}");
                }
            }
        }
    }

    #[test]
    fn what_cannot_be_played_is_named() {
        let sine = Shape::Sine { frequency_hz: 1.0 };
        let flaw = |waveform| Player::new(waveform, TICK_HZ).expect_err("unplayable");
        assert_eq!(flaw(waveform(sine, f32::NAN, 1.0, 1)), Flaw::NotANumber);
        assert_eq!(flaw(waveform(sine, 0.0, 1.0, 0)), Flaw::NoCycles);
        let fast = Shape::Triangle {
            frequency_hz: 2501.0,
        };
        assert_eq!(flaw(waveform(fast, 0.0, 1.0, 1)), Flaw::Frequency);
        let steps = |points, dwell_ticks| {
            Shape::Steps(Table {
                points,
                dwell_ticks,
            })
        };
        assert_eq!(flaw(waveform(steps(0, 1), 0.0, 1.0, 1)), Flaw::Points);
        assert_eq!(flaw(waveform(steps(513, 1), 0.0, 1.0, 1)), Flaw::Points);
        assert_eq!(flaw(waveform(steps(1, 0), 0.0, 1.0, 1)), Flaw::NoDwell);
        let line = Shape::Lines(Table {
            points: 1,
            dwell_ticks: 1,
        });
        assert_eq!(flaw(waveform(line, 0.0, 1.0, 1)), Flaw::Points);
    }
}
