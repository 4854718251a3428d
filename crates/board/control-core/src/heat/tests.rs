use super::*;
use crate::calibration::tests::parts;
use crate::units::{Second, SecondPerKelvin};
use proptest::prelude::*;

/// Actuators that take the same power.
const EVEN: [f32; CHANNELS] = [0.25; CHANNELS];

/// Heat of which nothing is shared.
fn apart() -> Heat {
    Heat {
        shared: Heat::INSTANT.shared,
        ..parts().heat
    }
}

/// The lags forward, in f64, with the slow ones' turns.
struct Forward {
    heat: Heat,
    fast: [f64; FAST_POLES],
    slow: [f64; SLOW_POLES],
    heating: f64,
}

impl Forward {
    fn new() -> Self {
        Self {
            heat: apart(),
            fast: [0.0; FAST_POLES],
            slow: [0.0; SLOW_POLES],
            heating: 0.0,
        }
    }

    /// A tick, and the slow lags' turn after it.
    fn step(&mut self, heating: f64, turn: bool) -> f64 {
        let relax = |lag: &crate::calibration::Lag, at: &mut f64, input: f64, ticks: f64| {
            let goal = f64::from(lag.weight) * input;
            *at = goal + (*at - goal) * (-1e-4 * ticks / f64::from(lag.time.0)).exp();
        };
        let rested: f64 = self.slow.iter().sum();
        for (lag, at) in self.heat.fast.iter().zip(&mut self.fast) {
            relax(lag, at, heating, 1.0);
        }
        self.heating += heating;
        if turn {
            for (lag, at) in self.heat.slow.iter().zip(&mut self.slow) {
                relax(lag, at, self.heating / TURNS as f64, TURNS as f64);
            }
            self.heating = 0.0;
        }
        rested + self.fast.iter().sum::<f64>()
    }
}

proptest! {
    #[test]
    fn the_inverse_is_exact_along_any_course(
        course in proptest::collection::vec(0.0_f32..100.0, 1..100),
    ) {
        let inverse = HeatInverse::new(&apart(), EVEN);
        let mut state = HeatState::default();
        let mut mirror = Forward::new();
        for (tick, target) in course.into_iter().enumerate() {
            let turn = tick % TURNS == 3;
            let heating = inverse.heating(&state, Kelvin(target));
            inverse.advance(&mut state, heating);
            if turn {
                inverse.advance_slow(&mut state, &mut SharedHeat::default(), 0);
            }
            let reached = mirror.step(f64::from(heating.0), turn);
            // Sums in f32: some forty roundings of 100 K.
            prop_assert!((reached - f64::from(target)).abs() < 5e-4, "{reached} for {target}");
        }
    }

    /// Whatever is driven and however the time constants change, also beyond what a calibration was checked for.
    #[test]
    fn any_heating_leaves_a_temperature(
        growth_s_per_k in -1e-3_f32..1e-3,
        slower in -100.0_f32..100.0,
        driven in proptest::collection::vec(0.0_f32..1e4, 1..300),
    ) {
        let heat = Heat { time_growth: SecondPerKelvin(growth_s_per_k), ..apart() };
        let inverse = HeatInverse::new(&heat, EVEN);
        let (mut state, mut rise) = (HeatState::default(), Kelvin(0.0));
        for heating in driven {
            let left;
            (left, rise) = inverse.unstored(slower, &state, Kelvin(heating), rise);
            inverse.advance(&mut state, left);
            prop_assert!(rise.0.is_finite() && rise.0.abs() < 1e6, "{rise}");
        }
    }

    /// Whatever a limit made of the heating before, the next tick that it leaves free is exact.
    #[test]
    fn nothing_winds_up_behind_a_limit(
        limited in proptest::collection::vec(0.0_f32..120.0, 0..300),
        target in 0.0_f32..100.0,
    ) {
        let inverse = HeatInverse::new(&apart(), EVEN);
        let mut state = HeatState::default();
        let mut mirror = Forward::new();
        for heating in limited {
            inverse.advance(&mut state, Kelvin(heating));
            inverse.advance_slow(&mut state, &mut SharedHeat::default(), 0);
            mirror.step(f64::from(heating), true);
        }
        let heating = inverse.heating(&state, Kelvin(target));
        let reached = mirror.step(f64::from(heating.0), false);
        // As above.
        prop_assert!((reached - f64::from(target)).abs() < 5e-4, "{reached} for {target}");
    }
}

/// What four actuators share, along a sine of each at 20 Hz, against the lags in f64 that their watts drive at every tick.
#[test]
fn what_is_shared_is_followed_in_turns() {
    /// Actuators that take up to a quarter more watts for the same rise.
    const GAINS: [f64; CHANNELS] = [0.22, 0.28, 0.24, 0.26];
    let heat = Heat {
        fast: [
            Lag {
                weight: 0.6,
                time: Second(1e-3),
            },
            Lag {
                weight: 0.3,
                time: Second(33e-3),
            },
            Lag::NONE,
        ],
        slow: [
            Lag {
                weight: 0.1,
                time: Second(4.7),
            },
            Lag {
                weight: 0.0,
                time: Second(1.0),
            },
        ],
        shared: [0.0, 1.0, 0.0, 0.8, 0.0],
        ..Heat::INSTANT
    };
    let inverse = HeatInverse::new(&heat, GAINS.map(|gain| gain as f32));
    let mut states: [HeatState; CHANNELS] = Default::default();
    let mut shared = SharedHeat::default();
    let (mut fast, mut slow) = (0.0_f64, 0.0_f64);
    let mut own = [[0.0_f64; 2]; CHANNELS];
    let mut worst = 0.0_f64;
    let relax = |at: &mut f64, goal: f64, time: f64| {
        *at = goal + (*at - goal) * (-1e-4 / time).exp();
    };
    for tick in 0..40_000_usize {
        let phase = core::f64::consts::TAU * 20.0 * 1e-4 * tick as f64;
        let swing = 20.0 * libm::sin(phase);
        let targets: [f64; CHANNELS] =
            core::array::from_fn(|i| 60.0 + (0.5 + 0.25 * i as f64) * swing);
        let mut heatings = [0.0; CHANNELS];
        for i in 0..CHANNELS {
            let heating = inverse.heating(&states[i], Kelvin(targets[i] as f32));
            inverse.advance(&mut states[i], heating);
            heatings[i] = f64::from(heating.0);
        }
        let turn = tick % TURNS;
        inverse.advance_slow(&mut states[turn], &mut shared, turn);
        let products = heatings.iter().zip(GAINS);
        let mean: f64 = products.map(|(heating, gain)| gain * heating).sum();
        relax(&mut fast, 0.3 * mean, 33e-3);
        relax(&mut slow, 0.08 * mean, 4.7);
        for i in 0..CHANNELS {
            relax(&mut own[i][0], 0.6 * heatings[i], 1e-3);
            relax(&mut own[i][1], 0.02 * heatings[i], 4.7);
            let rise = own[i][0] + own[i][1] + fast + slow;
            // After the first jump from rest.
            if tick > 1000 {
                worst = worst.max((rise - targets[i]).abs());
            }
        }
    }
    // What is shared goes by up to 0.03 K in a tick here, and is told once in four.
    assert!(worst < 0.1, "{worst} K");
}

/// A beam behind its heater along a smooth way, as f64 follows a heater that warms straight within each tick.
#[test]
fn a_heater_that_is_led_takes_its_beam_along_the_way() {
    const TICKS: usize = 70;
    let inverse = HeatInverse::new(&parts().heat, EVEN);
    let lag = f64::from(parts().heat.beam_lag.0) / 1e-4;
    let (pole, mean) = ((-1.0 / lag).exp(), lag * -(-1.0 / lag).exp_m1());
    let (mut asked, mut heater, mut beam) = (Kelvin(0.0), 0.0, 0.0);
    for tick in 1..=2 * TICKS {
        let done = (tick as f64 / TICKS as f64).min(1.0);
        let next = Kelvin((100.0 * done.powi(3) * (10.0 - done * (15.0 - 6.0 * done))) as f32);
        let led = f64::from(inverse.heater(next, asked).0);
        beam = pole * beam + (mean - pole) * heater + (1.0 - mean) * led;
        (heater, asked) = (led, next);
        // The slope's difference is half a tick old: lag / 2 of the second difference, at most 5.8 of 100 K in 70 ticks squared.
        let most = 0.5 * lag * 5.8 * 100.0 / (TICKS as f64).powi(2);
        assert!((beam - f64::from(next.0)).abs() < most, "tick {tick}");
    }
    assert!((beam - 100.0).abs() < 1e-3);
}

/// A heater along a smooth way, whose time constant is a tenth longer than the poles' and grows by half over it, as f64 follows it in hundredths of a tick.
#[test]
fn a_heater_that_slows_as_it_warms_is_where_it_is_asked_to_be() {
    const TICKS: usize = 70;
    const SUBSTEPS: usize = 100;
    let (time_s, slower_s, growth_s_k) = (2e-3, 2e-4, 1e-5);
    let slower = slower_s as f32 / TICK.0;
    let mut heat = Heat {
        time_growth: SecondPerKelvin(growth_s_k as f32),
        ..Heat::INSTANT
    };
    heat.fast[0].time = Second(time_s as f32);
    let inverse = HeatInverse::new(&heat, EVEN);
    let (mut state, mut core, mut mirror) = (HeatState::default(), Kelvin(0.0), 0.0_f64);
    for tick in 1..=2 * TICKS {
        let done = (tick as f64 / TICKS as f64).min(1.0);
        let asked = Kelvin((100.0 * done.powi(3) * (10.0 - done * (15.0 - 6.0 * done))) as f32);
        let heating = inverse.heating(&state, asked);
        let whole = Kelvin(heating.0 + inverse.stored(slower, core, asked).0);
        let (found, _) = inverse.unstored(slower, &state, whole, core);
        // Of what the square of a tick's way stores, 0.05 / K of 2.7 K, a step of the secant method leaves the part by which storing slows
        // the way: a quarter, 2 x 0.05 x 0.05 x 64 of itself and one; a tenth more with what it stores at any rise.
        assert!((found.0 - heating.0).abs() < 0.1, "{found} for {heating}");
        inverse.advance(&mut state, heating);
        core = asked;
        for _ in 0..SUBSTEPS {
            let slope = (f64::from(whole.0) - mirror) / (time_s + slower_s + growth_s_k * mirror);
            mirror += slope * 1e-4 / SUBSTEPS as f64;
        }
        // Within a tick the heating is held and the rise is not straight: a tick over twice the time constant of a tick's way.
        let most = 2.7 * 1e-4 / (2.0 * time_s);
        assert!(
            (mirror - f64::from(asked.0)).abs() < most,
            "tick {tick}: {mirror} for {asked}"
        );
    }
}

#[test]
fn without_poles_heating_is_temperature() {
    let inverse = HeatInverse::new(&Heat::INSTANT, EVEN);
    let state = HeatState::default();
    assert_eq!(inverse.heating(&state, Kelvin(42.0)), Kelvin(42.0));
}

/// Heat of slow poles, warmed by so many kelvins for this long, and then cooling.
fn warmed(
    inverse: &HeatInverse,
    input: f32,
    seconds: f32,
    cooled_s: f32,
) -> (HeatState, SharedHeat) {
    let (mut state, mut shared) = (HeatState::default(), SharedHeat::default());
    let turns = |seconds: f32| (seconds / TICK.0) as usize / TURNS;
    for turn in 0..turns(seconds + cooled_s) {
        let input = if turn < turns(seconds) { input } else { 0.0 };
        for of in 0..TURNS {
            inverse.advance(&mut state, Kelvin(input));
            // Each of the four is as warm; one of them is looked at.
            state.heating = input * TURNS as f32;
            inverse.advance_slow(&mut state, &mut shared, of);
        }
    }
    (state, shared)
}

/// Another calibration has the slow poles that are the mirror's: which the one before had otherwise, or not at all.
#[test]
fn poles_that_were_unknown_are_as_warm_as_if_they_had_been_known() {
    let with = |slow: [(f32, f32); SLOW_POLES], is_shared: bool| {
        let part = if is_shared { 0.6 } else { 0.0 };
        let heat = Heat {
            fast: [(0.9, 1e-3), (0.0, 0.0), (0.0, 0.0)].map(lag),
            slow: slow.map(lag),
            shared: [0.0, 0.0, 0.0, part, part],
            ..Heat::INSTANT
        };
        HeatInverse::new(&heat, EVEN)
    };
    let lacking = [(0.0, 0.25), (0.0, 0.25)];
    let rests = [(0.1, 4.5), (0.0, 0.25)];
    let between = [(0.04, 8.0), (0.06, 40.0)];
    for (seconds, cooled_s) in [(120.0, 0.2), (120.0, 10.0), (5.0, 1.0)] {
        for (before, after) in [(lacking, rests), (lacking, between), (rests, between)] {
            for is_shared in [false, true] {
                let (before, after) = (with(before, false), with(after, is_shared));
                let (state, shared) = warmed(&before, 50.0, seconds, cooled_s);
                let from = after.poles_before(&before);
                let shared = after.inherit_shared((&from, &before, &shared), |it| it);
                let found = after.inherit(&shared, (&from, &before, &state), |it| it);
                let (truly, _) = warmed(&after, 50.0, seconds, cooled_s);
                let off_k = (found.free_response - truly.free_response).abs();
                // An exponential between two others, on a logarithmic scale of times: an eighth of the 5 K that they come to (0.57 K at most).
                assert!(off_k < 0.625, "{off_k} K after {seconds} and {cooled_s} s");
            }
        }
    }
}

fn lag((weight, seconds): (f32, f32)) -> Lag {
    Lag {
        weight,
        time: Second(seconds),
    }
}
