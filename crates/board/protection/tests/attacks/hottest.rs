//! How hot can a heater be made from outside, without a hardware fault? A search over calibrations that the board
//! accepts and drive patterns, in air and in vacuum, against a mirror that shares no equation with the firmware: a
//! thermal network of its own, platinum by Callendar and Van Dusen, the output filter, the instants of sampling, and the
//! tolerances of the sense. Whoever attacks clears every trip at once and goes on.

use control_core::design::HOTTEST_RISE;
use protection::Fault;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::bench::{Board, Claim};
use crate::plant::Surroundings;

/// What a host sends as long as a run lasts, from the tick's number.
type Pattern = Box<dyn Fn(u32) -> f64>;

/// One that a host might try.
fn random(rng: &mut ChaCha8Rng) -> Claim {
    Claim {
        cold_ohm: rng.random_range(200.0..800.0),
        tcr: 10_f64.powf(rng.random_range(-3.2..-1.0)),
        drive_v: rng.random_range(3.0..5.0),
        rise_k: rng.random_range(50.0..1000.0),
        sense: (rng.random_range(-60e-6..60e-6), rng.random_range(0.9..1.1)),
    }
}

/// One at the ends of what the board allows.
fn extreme(rng: &mut ChaCha8Rng) -> Claim {
    Claim {
        cold_ohm: rng.random_range(300.0..460.0),
        tcr: rng.random_range(0.9e-3..1.1e-2),
        drive_v: 3.5,
        rise_k: rng.random_range(150.0..225.0),
        sense: (
            rng.random_range(-25e-6..25e-6),
            rng.random_range(0.95..1.05),
        ),
    }
}

/// What blinded the check once, and others like it.
fn patterns(rng: &mut ChaCha8Rng) -> Pattern {
    let (volts, seed) = (rng.random_range(2.5..3.5), rng.random::<u32>());
    match rng.random_range(0..7) {
        // So many ticks high, so many low.
        0 => {
            let (on, off) = (rng.random_range(1..200), rng.random_range(1..40));
            Box::new(move |tick| if tick % (on + off) < on { 3.5 } else { 0.0 })
        }
        1 => {
            let (on, off) = (rng.random_range(1..8), rng.random_range(1..3));
            let low = rng.random_range(0.0..1.0);
            Box::new(move |tick| if tick % (on + off) < on { 3.5 } else { low })
        }
        2 => {
            let hz = 10_f64.powf(rng.random_range(0.0..3.7));
            Box::new(move |tick| {
                1.75 + 1.75 * (std::f64::consts::TAU * hz * f64::from(tick) * 1e-4).sin()
            })
        }
        // As if by dice, every so many ticks.
        3 => {
            let (hold, duty) = (rng.random_range(1..20), rng.random_range(0.3..1.0));
            Box::new(move |tick| {
                if dice(seed, tick / hold) < duty {
                    3.5
                } else {
                    0.0
                }
            })
        }
        4 => Box::new(move |tick| 3.5 * dice(seed, tick / 3)),
        // Warm for long, then as high as it goes.
        5 => {
            let (warm, tick_0) = (rng.random_range(0.5..2.5), rng.random_range(1000..9000));
            Box::new(move |tick| if tick % 10_000 < tick_0 { warm } else { 3.5 })
        }
        _ => Box::new(move |_| volts),
    }
}

/// A number of 0 to 1 that only `seed` and `index` decide.
fn dice(seed: u32, index: u32) -> f64 {
    let mut x = seed ^ index.wrapping_mul(0x9e37_79b9);
    x = (x ^ (x >> 16)).wrapping_mul(0x85eb_ca6b);
    x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
    f64::from(x ^ (x >> 16)) / f64::from(u32::MAX)
}

/// Seconds in which a mirror in vacuum comes to rest.
const LONG: u32 = 30_000;

fn most(hottest_k: f64, what: &str) {
    assert!(
        hottest_k <= f64::from(HOTTEST_RISE.0),
        "{what}: {hottest_k:.0} K"
    );
}

#[test]
fn no_drive_pattern_blinds_the_check_in_vacuum() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let five_of_six: Pattern = Box::new(|tick| if tick % 6 < 5 { 3.5 } else { 0.0 });
    let sine: Pattern =
        Box::new(|tick| 1.75 + 1.75 * (std::f64::consts::TAU * 0.25 * f64::from(tick) + 0.8).sin());
    let dice: Pattern = Box::new(|tick| if dice(5, tick) < 0.8 { 3.5 } else { 0.0 });
    for (name, pattern) in [
        ("five of six", five_of_six),
        ("2.5 kHz", sine),
        ("dice", dice),
    ] {
        let mut board = Board::of_the_line(Surroundings::VACUUM, &mut rng);
        for tick in 0..LONG {
            board.tick(pattern(tick));
        }
        println!(
            "{name}: {:.0} K, {} trips",
            board.hottest_k,
            board.trips.len()
        );
        most(board.hottest_k, name);
        assert!(
            board.trips.contains(&Fault::OverTemperature),
            "{name}: {:?}",
            board.trips.first()
        );
    }
}

/// Warm first, then as fast as the drive can be without a current that stands still.
#[test]
fn no_drive_pattern_is_too_quick_for_a_heater_that_is_warm() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut hottest_k = 0.0_f64;
    for high in [1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 20, 30, 50] {
        for _ in 0..6 {
            let surroundings = Surroundings::draw(&mut rng);
            let mut board = Board::of_the_line(surroundings, &mut rng);
            let warm_v = rng.random_range(0.3..2.5);
            for tick in 0..20_000 {
                let is_high = tick % (high + 1) < high;
                board.tick(match (tick < 10_000, is_high) {
                    (true, _) => warm_v,
                    (false, true) => 3.5,
                    (false, false) => 0.0,
                });
            }
            if board.hottest_k > hottest_k {
                hottest_k = board.hottest_k;
                println!(
                    "{hottest_k:.0} K: {high} of {}, from {warm_v:.1} V",
                    high + 1
                );
            }
        }
    }
    most(hottest_k, "the hottest of all");
}

#[test]
fn the_same_patterns_are_driven_in_air() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for _ in 0..200 {
        let mut board = Board::of_the_line(Surroundings::AIR, &mut rng);
        let pattern = patterns(&mut rng);
        for tick in 0..10_000 {
            board.tick(pattern(tick));
        }
        assert_eq!(board.trips, [], "{:.0} K", board.hottest_k);
    }
}

#[test]
fn nothing_accepted_and_nothing_driven_makes_a_heater_too_hot() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let (mut tried, mut refused, mut hottest_k) = (0, 0, 0.0_f64);
    let mut runs = 0;
    let is_long = long_runs::are_asked_for();
    let enough = if is_long { LONG_RUNS } else { RUNS };
    while runs < enough {
        let claim = if tried % 3 == 0 {
            random(&mut rng)
        } else {
            extreme(&mut rng)
        };
        tried += 1;
        let (Some(calibration), Some(sense)) = (claim.accepted(), claim.sense()) else {
            refused += 1;
            continue;
        };
        runs += 1;
        let surroundings = Surroundings::draw(&mut rng);
        let mut board = Board::of_the_line(surroundings, &mut rng);
        let (before, pattern) = (patterns(&mut rng), patterns(&mut rng));
        // Heated under the factory's calibration first, so that the new one never sees a cold heater.
        for tick in 0..rng.random_range(0..5_000) {
            board.tick(before(tick));
        }
        let is_reset = rng.random();
        if is_reset {
            board.restart(&calibration, sense);
        } else {
            board.use_calibration(&calibration, sense);
        }
        // Some hosts clear again and again, whatever has tripped.
        let clears_every = if rng.random() {
            rng.random_range(10..200)
        } else {
            u32::MAX
        };
        for tick in 0..10_000 {
            if tick % clears_every == clears_every - 1 {
                board.protection.clear();
            }
            board.tick(pattern(tick));
        }
        if board.hottest_k > hottest_k {
            hottest_k = board.hottest_k;
            println!(
                "{hottest_k:.1} K: {claim:?}, {surroundings:?}, {}, {} trips",
                if is_reset {
                    "reset while hot"
                } else {
                    "uploaded"
                },
                board.trips.len()
            );
        }
    }
    println!(
        "{tried} calibrations offered, {refused} refused; {runs} accepted ones driven for a second each, on four \
         heaters; hottest rise {hottest_k:.1} K"
    );
    most(hottest_k, "the hottest of all");
    assert!(refused > tried / 10, "the search leaves the board's limits");
}

/// Some ten seconds, and some three minutes where long runs are asked for.
const RUNS: u32 = 300;
const LONG_RUNS: u32 = 6000;
