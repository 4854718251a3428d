use super::*;
use crate::waveform::{Curve, POINTS, POSE_POINTS, Triggers};
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
        triggers: Triggers::default(),
    }
}

fn play(waveform: Waveform, points: &[i16]) -> Vec<f32> {
    let mut player = Player::new(waveform, TICK_HZ).expect("playable");
    let mut values = Vec::new();
    while !player.is_over() {
        values.push(player.next(|i| points[i]).value);
    }
    let last = player.next(|i| points[i]).value;
    values.push(last);
    assert_eq!(player.next(|i| points[i]).value, last, "it stays");
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
        // The last tick is a whole one.
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
            // Of a full scale of 1: places of up to 19 points are exact to 1e-6 in f32, on slopes of up to 2.
            prop_assert!((value - exact).abs() < 1e-5, "{value} for {exact}");
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
                let value = player.next(|i| stored[i]).value;
                let reach = amplitude.abs() * 1.000_01;
                prop_assert!(value >= offset - reach && value <= offset + reach, "{value}");
            }
        }
    }
}

const RASTER: Waveform = Waveform {
    quantity: Quantity::Pose {
        tilts: [
            Tilt {
                offset: 0.01,
                amplitude: 0.02,
                curve: Curve::Triangle,
                turns: 8,
                start: 3 << 14,
            },
            Tilt {
                offset: 0.0,
                amplitude: 0.03,
                curve: Curve::Sine,
                turns: 3,
                start: 1 << 14,
            },
        ],
    },
    shape: Shape::Sine { frequency_hz: 2.0 },
    offset: 80.0,
    amplitude: 0.0,
    cycles: 2,
    ends_off: true,
    triggers: Triggers {
        frames: 2,
        lines: 16,
    },
};

#[test]
fn tilts_turn_with_the_cycle_and_triggers_tell_where_frames_and_lines_begin() {
    let mut player = Player::new(RASTER, TICK_HZ).expect("playable");
    let (mut frames, mut lines) = (Vec::new(), Vec::new());
    // A cycle of half a second is 5000 ticks.
    for tick in 0..10_000_u32 {
        assert!(!player.is_over());
        let played = player.next(|_| 0);
        let cycles = (f64::from(tick) + 0.5) / 5000.0;
        let quarters = 4.0 * (8.0 * cycles + 0.75 + 0.25).fract();
        let x = 0.01 + 0.02 * (1.0 - (quarters - 2.0).abs());
        let y = 0.03 * (std::f64::consts::TAU * (3.0 * cycles + 0.25)).sin();
        for (tilt, exact) in played.tilts.into_iter().zip([x, y]) {
            // The phase of a turn is cut off at 2^-32 of a cycle in each tick.
            assert!(
                (f64::from(tilt) - exact).abs() < 3e-6,
                "{tick}: {tilt} for {exact}"
            );
        }
        assert_eq!(played.value, 80.0);
        if played.trigger.has(Trigger::FRAME) {
            frames.push(tick);
        }
        if played.trigger.has(Trigger::LINE) {
            lines.push(tick);
        }
    }
    // The step's last bit makes a beginning late by a tick at most.
    let near = |ticks: &[u32], period: f64| {
        let due = ticks.iter().zip(0_u32..);
        for (tick, count) in due {
            assert!((0.0..=1.0).contains(&(f64::from(*tick) - f64::from(count) * period)));
        }
    };
    assert_eq!((frames.len(), lines.len()), (4, 32));
    near(&frames, 2500.0);
    near(&lines, 312.5);
}

#[test]
fn what_leads_is_told_earlier_and_begins_and_ends_as_before() {
    let points: Vec<i16> = (0..9).map(|k| 1000 * (k % 4)).collect();
    let table = Table {
        points: 9,
        dwell_ticks: 10,
    };
    let lead = 7;
    for shape in [
        Shape::Sine {
            frequency_hz: 125.0,
        },
        Shape::Triangle {
            frequency_hz: 125.0,
        },
        Shape::Lines(table),
    ] {
        let waveform = waveform(shape, 80.0, 40.0, 2);
        let player = || Player::new(waveform, TICK_HZ).expect("playable");
        let (mut plain, mut led) = (player(), player().leading(lead as f32));
        let [plain, led] = [&mut plain, &mut led].map(|player| {
            let mut values = Vec::new();
            while !player.is_over() {
                values.push(player.next(|i| points[i]).value);
            }
            values
        });
        assert_eq!(plain.len(), led.len());
        for (later, now) in plain[lead..].iter().zip(&led) {
            // A ten-millionth of the amplitude for each tick of the lead, which f32 keeps.
            assert!((later - now).abs() < 1e-3, "{shape:?}: {now} for {later}");
        }
        // The middle, and the last point: both are the offset.
        let end = 80.0;
        let last = led.len() - lead;
        assert!(led[last..].iter().all(|value| (value - end).abs() < 1e-3));
    }
}

#[test]
fn drives_and_steps_are_not_led() {
    let table = Table {
        points: 2,
        dwell_ticks: 10,
    };
    let drive = Quantity::Drive {
        active: [true; 4],
        others_v: 0.0,
    };
    let steps = waveform(Shape::Steps(table), 1.0, 1.0, 1);
    let sine = Waveform {
        quantity: drive,
        ..waveform(
            Shape::Sine {
                frequency_hz: 125.0,
            },
            1.0,
            1.0,
            1,
        )
    };
    for waveform in [steps, sine] {
        let player = || Player::new(waveform, TICK_HZ).expect("playable");
        let (mut plain, mut led) = (player(), player().leading(7.0));
        for _ in 0..20 {
            assert_eq!(plain.next(|i| i as i16), led.next(|i| i as i16));
        }
    }
}

#[test]
fn a_table_of_poses_has_three_columns_and_a_frame_a_cycle() {
    let points = [0, FULL_SCALE, FULL_SCALE, 0, 0, -FULL_SCALE];
    let table = Table {
        points: 2,
        dwell_ticks: 4,
    };
    let poses = Waveform {
        shape: Shape::Lines(table),
        amplitude: 10.0,
        triggers: Triggers {
            frames: 1,
            lines: 0,
        },
        ..RASTER
    };
    let mut player = Player::new(poses, TICK_HZ).expect("playable");
    for tick in 0..8 {
        let played = player.next(|i| points[i]);
        let part = ((tick % 4) as f32 + 0.5) / 4.0;
        // A tenth of a nanometre, ten times what f32 keeps of 90 um.
        assert!((played.value - (80.0 + 10.0 * part)).abs() < 1e-4);
        assert!((played.tilts[0] - (0.01 + 0.02 * (1.0 - part))).abs() < 1e-6);
        assert!((played.tilts[1] + 0.03 * part).abs() < 1e-6);
        assert_eq!(played.trigger.has(Trigger::FRAME), tick % 4 == 0);
    }
    assert!(player.is_over());
    let end = player.next(|i| points[i]);
    assert_eq!((end.trigger, end.value), (Trigger::NONE, 90.0));
    assert!((end.tilts[1] + 0.03).abs() < 1e-6);
}

#[test]
fn poses_that_cannot_be_played_are_named() {
    let flaw = |waveform| Player::new(waveform, TICK_HZ).expect_err("unplayable");
    let table = |points| {
        Shape::Lines(Table {
            points,
            dwell_ticks: 1,
        })
    };
    let many = POSE_POINTS as u16 + 1;
    let of_table = Waveform {
        shape: table(many),
        triggers: Triggers::default(),
        ..RASTER
    };
    assert_eq!(flaw(of_table), Flaw::Points);
    assert_eq!(
        flaw(Waveform {
            shape: table(2),
            ..RASTER
        }),
        Flaw::Triggers
    );
    let often = Triggers {
        frames: 1,
        lines: 2501,
    };
    assert_eq!(
        flaw(Waveform {
            triggers: often,
            ..RASTER
        }),
        Flaw::Triggers
    );
    let tilts = |tilt| Waveform {
        quantity: Quantity::Pose {
            tilts: [Tilt::default(), tilt],
        },
        ..RASTER
    };
    let fast = Tilt {
        turns: 1251,
        ..Tilt::default()
    };
    assert_eq!(flaw(tilts(fast)), Flaw::Frequency);
    let none = Tilt {
        offset: f32::NAN,
        ..Tilt::default()
    };
    assert_eq!(flaw(tilts(none)), Flaw::NotANumber);
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
