//! A mirror on a board that has another one's calibration: noticed by what its heaters' resistances differ from each other. And that a mirror under
//! its own calibration is not doubted.

use std::thread;

use closed_loop::{Loop, TICK_S, calibrate, usual_mirror};
use control_core::calibration::Parts;
use control_core::{CHANNELS, Calibration, Limit, Limits, Micrometre, Setpoint, Volt};
use emulated_board::{Device, Mirror};
use foreign_mirror::ForeignConfig;
use mirror_model::{Model, Preset};
use virtual_mirror::{Effect, Family, MirrorConfig, VirtualMirror};

/// No mirror under its own calibration is told to be this far off, and what may be another's is told as more (um).
const WIDE_UM: f64 = 60.0;

/// Two mirrors with what `calibrate` made of them (`hil/tests`).
fn two() -> [(MirrorConfig, Calibration); 2] {
    const PAPER: &str = include_str!("../../../../hil/tests/paper.toml");
    const OF_77: &str = include_str!("../../../../hil/tests/mirror-77.toml");
    let read = |text: &str| calibration::from_toml("a mirror's", text).expect("a calibration");
    [
        (MirrorConfig::paper(), read(PAPER)),
        (MirrorConfig::draw(Family::B, 77), read(OF_77)),
    ]
}

/// What was told of a mirror in use.
#[derive(Debug, Default)]
struct Told {
    /// The largest error of the piston, and the largest that its interval did not hold (um).
    largest_um: f64,
    beyond_um: f64,
    /// The widest interval (um).
    widest_um: f64,
    /// The time until `calibration-drifted` was told (s).
    drifted_s: Option<f64>,
}

/// A mirror on a board with this calibration that has just been switched on, and has checked the heaters as it does then.
fn switched_on<'a, M: Mirror>(
    calibration: &'a mut Calibration,
    config: &impl Device,
    mirror: M,
) -> Loop<'a, M> {
    let mut board = Loop::of(calibration, config.seed(), mirror);
    check(&mut board);
    check(&mut board);
    board
}

fn made(config: &MirrorConfig, room_k: f64, air: f64) -> VirtualMirror {
    let mut mirror = config.make().expect("a mirror");
    mirror.set_ambient(room_k);
    mirror.set_air_loss(air);
    mirror
}

/// So long at a setpoint; what is told then.
fn wait<M: Mirror>(board: &mut Loop<'_, M>, setpoint: Setpoint, seconds: f64) -> Limits {
    let ticks = (seconds / TICK_S) as usize;
    (0..ticks).fold(Limits::NONE, |_, _| board.tick(setpoint).1)
}

/// A check of the heaters as the board makes it, and the pause behind it (`protection`).
fn check<M: Mirror>(board: &mut Loop<'_, M>) -> Limits {
    wait(board, Setpoint::Drive([Volt(0.3); CHANNELS]), 2.5e-3);
    wait(board, Setpoint::Off, 0.25)
}

fn is_drifted(limits: Limits) -> bool {
    limits.contains(Limit::CalibrationDrifted)
}

fn width_um<M: Mirror>(board: &Loop<'_, M>) -> f64 {
    f64::from(board.uncertainty().expect("it is told").z.0)
}

/// Checks as a board makes them that drives nothing and doubts its heaters; whether it is told at one of them.
fn is_told_at_rest<M: Mirror>(board: &mut Loop<'_, M>, checks: usize) -> bool {
    (0..checks).any(|_| {
        wait(board, Setpoint::Off, 11.0);
        is_drifted(check(board))
    })
}

/// Positions all over the range, each held for a second and more.
fn used<M: Mirror>(board: &mut Loop<'_, M>, seconds: f64) -> Told {
    const STAY_S: f64 = 1.2;
    let top_um = f64::from(board.calibration().max_position().0).min(160.0);
    let mut told = Told::default();
    let places = [0.35, 0.9, 0.15, 0.65].into_iter().cycle();
    for (stay, place) in (1..=(seconds / STAY_S) as u32).zip(places) {
        let z_um = place * top_um;
        let off_um = (board.hold(z_um, STAY_S) - z_um).abs();
        let z = Setpoint::position(Micrometre(z_um as f32));
        let limits = board.tick(z).1;
        told.widest_um = told.widest_um.max(width_um(board));
        told.largest_um = told.largest_um.max(off_um);
        if off_um > width_um(board) {
            told.beyond_um = told.beyond_um.max(off_um);
        }
        if is_drifted(limits) && told.drifted_s.is_none() {
            told.drifted_s = Some(STAY_S * f64::from(stay));
        }
    }
    told
}

#[test]
fn another_mirror_is_noticed() {
    let [paper, of_77] = two();
    for ((config, _), (_, anothers), room_k) in [(&paper, &of_77, 18.0), (&of_77, &paper, -12.0)] {
        let mut anothers = *anothers;
        let mirror = made(config, room_k, 1.0);
        let told = used(
            &mut switched_on(&mut anothers, config, mirror.clone()),
            13.0,
        );
        println!("{}: {told:.2?}", config.name);
        assert!(
            told.beyond_um == 0.0 && told.drifted_s.is_some(),
            "{told:?}"
        );
        let mut idle = switched_on(&mut anothers, config, mirror);
        assert!(is_told_at_rest(&mut idle, 1));
        assert!(width_um(&idle) > WIDE_UM);
    }
}

#[test]
fn its_own_is_not_doubted_in_any_room_and_air() {
    for (config, mut own) in two() {
        for (room_k, air) in [(-12.0, 1.2), (18.0, 0.8)] {
            let mirror = made(&config, room_k, air);
            let mut board = switched_on(&mut own, &config, mirror);
            let told = used(&mut board, 10.0);
            println!("{} {room_k} K, {air}: {told:.2?}", config.name);
            assert!(
                told.drifted_s.is_none() && told.widest_um < WIDE_UM,
                "{told:?}"
            );
        }
    }
}

/// It was driven at one actuator for half a minute, and its plate and frame are as warm as that makes them: the power was gone, or the board reset.
fn assert_warmth_is_no_other_mirror<D: Device>(config: &D, own: &mut Calibration)
where
    D::Mirror: Clone,
{
    let mut board = switched_on(own, config, config.make().expect("a mirror"));
    let tilt = [Volt(3.5), Volt(0.0), Volt(0.0), Volt(0.0)];
    wait(&mut board, Setpoint::Drive(tilt), 30.0);
    let (warm, retained) = (board.mirror().clone(), board.retained());
    let mut reset = Loop::of(own, config.seed(), warm.clone());
    reset.recall(&retained);
    check(&mut reset);
    check(&mut reset);
    // Heat that its neighbours have of it may be told as a drift: these calibrations do not know what they share.
    let told = used(&mut reset, 12.0);
    println!("{}, reset: {told:.2?}", config.name());
    assert!(told.widest_um < WIDE_UM, "{told:?}");

    let mut idle = switched_on(own, config, warm.clone());
    println!("{}, without power: {} um", config.name(), width_um(&idle));
    assert!(!is_told_at_rest(&mut idle, 6));
    assert!(width_um(&idle) < WIDE_UM);
    let mut in_use = switched_on(own, config, warm);
    used(&mut in_use, 63.0);
    assert!(width_um(&in_use) < WIDE_UM);
}

#[test]
#[ignore = "long"]
fn nor_is_one_that_is_warm() {
    let [(config, mut own), _] = two();
    let config = config.with_effect(Effect::SubstrateWarming, 1.0);
    assert_warmth_is_no_other_mirror(&config, &mut own);
}

/// Mirrors of other equations than the project's own.
#[test]
#[ignore = "long"]
fn nor_are_foreign_ones() {
    let calibrated = on_each([1071, 1072].map(ForeignConfig::new), |config| {
        let mut own = calibrate(config).expect("a mirror").calibration;
        assert_warmth_is_no_other_mirror(config, &mut own);
        own
    });
    let (one, _) = &calibrated[0];
    let (_, mut anothers) = calibrated[1];
    let mirror = one.make().expect("a mirror");
    let mut idle = switched_on(&mut anothers, one, mirror);
    assert!(is_told_at_rest(&mut idle, 1));
}

/// Each device with what `measure` makes of it, at the same time.
fn on_each<D: Send + 'static, T: Send + 'static>(
    devices: impl IntoIterator<Item = D>,
    measure: fn(&D) -> T,
) -> Vec<(D, T)> {
    let measured = |device: D| {
        thread::spawn(move || {
            let measured = measure(&device);
            (device, measured)
        })
    };
    let threads: Vec<_> = devices.into_iter().map(measured).collect();
    threads
        .into_iter()
        .map(|thread| thread.join().expect("measured"))
        .collect()
}

/// Each of six, under the calibration of each of the others, and under its own.
#[test]
#[ignore = "long"]
fn so_it_is_on_mirrors_of_all_families() {
    let mut mirrors = vec![MirrorConfig::paper()];
    let families = [Family::A, Family::C, Family::E, Family::F, Family::G];
    mirrors.extend(
        (851..)
            .zip(families)
            .map(|(seed, family)| usual_mirror(family, seed)),
    );
    let calibrated = on_each(mirrors, |config| {
        calibrate(config).expect("a mirror").calibration
    });
    let (mut pairs, mut noticed, mut held) = (0, 0, 0);
    for (here, (config, _)) in calibrated.iter().enumerate() {
        for (there, (of, calibration)) in calibrated.iter().enumerate() {
            let mut calibration = *calibration;
            let mirror = made(config, 0.0, 1.0);
            let told = used(
                &mut switched_on(&mut calibration, config, mirror.clone()),
                13.0,
            );
            let mut idle = switched_on(&mut calibration, config, mirror);
            let is_told = is_told_at_rest(&mut idle, 2);
            println!(
                "{} under {}: {told:.2?}, at rest {is_told}",
                config.name, of.name
            );
            if here == there {
                assert!(told.drifted_s.is_none() && !is_told && told.widest_um < WIDE_UM);
            } else {
                pairs += 1;
                noticed += usize::from(is_told);
                held += usize::from(told.beyond_um == 0.0);
            }
        }
    }
    println!("of {pairs} noticed at rest: {noticed}, and all errors within intervals: {held}");
    // Of E and G, and of F and G, the heaters are alike to a percent.
    assert!(noticed >= 26 && held >= 26);
}

/// A gain of 0.3 %, as boards have it, is none; one of 3 %, which only a board has that nobody has calibrated, is told.
#[test]
fn a_file_from_another_board_is_another_mirrors_where_that_reads_otherwise() {
    let [(config, own), _] = two();
    for (gain, is_told) in [(0.003, false), (0.03, true)] {
        let mut parts: Parts = *own.parts();
        for (actuator, sign) in parts.actuators.iter_mut().zip([1.0, -1.0, 1.0, -1.0]) {
            actuator.cold_resistance.0 *= 1.0 + sign * gain;
        }
        let mut read = Calibration::new(parts).expect("a mirror's");
        let mut board = switched_on(&mut read, &config, made(&config, 0.0, 1.0));
        assert_eq!(is_told_at_rest(&mut board, 1), is_told, "{gain}");
    }
}

/// The factory's calibration, which knows no slow pole, drove it hot; then it got its own.
#[test]
fn a_mirror_that_gets_its_calibration_while_it_is_warm_is_known_to_be() {
    let start = Model::from(Preset::Reconciled);
    let factory = calibration::tabulate(&start).expect("it tabulates");
    for (config, own) in two() {
        for (held_s, cooled_s) in [(60.0, 0.1), (60.0, 3.0), (4.0, 3.0)] {
            let (mut factory, mut own) = (factory.calibration, own);
            let mut board = Loop::new(&mut factory, &config).expect("a mirror");
            wait(&mut board, Setpoint::Drive([Volt(3.0); CHANNELS]), held_s);
            wait(&mut board, Setpoint::Off, cooled_s);
            board.exchange(&mut own);
            check(&mut board);
            check(&mut board);
            for z_um in [20.0, 100.0, 10.0] {
                let off_um = board.hold(z_um, 1.0) - z_um;
                let told = board.surroundings().expect("it is known");
                println!(
                    "{}, {held_s} s, {cooled_s} s: {off_um:.3} of {:.3} um, {told:.3?}",
                    config.name,
                    width_um(&board)
                );
                assert!(off_um.abs() < width_um(&board));
                // Three deviations, of what is no change of the room nor of the air.
                assert!(told.rise.0.abs() < 3.0 * told.rise_deviation.0);
                assert!(told.loss.abs() < 3.0 * told.loss_deviation);
            }
        }
    }
}
