//! Stages found in what a mirror did: one of a few lines here, which shares no code with what is tested.

use std::sync::LazyLock;

use calibration::{RefineError, Refined, refined, tabulate};
use control_core::calibration::{Heat, Memory};
use control_core::{Ampere, CHANNELS, Calibration, Controller, Micrometre, Setpoint, TICK, Volt};
use experiments::calibration::jump_shares;
use measurement::{MeasurementFile, Row, Session};
use mirror_model::{Model, Preset};

const TICK_S: f64 = TICK.0 as f64;
/// Parts of a tick that the mirror is advanced in.
const PARTS: u32 = 10;
const JUMP_S: f64 = 1.0;
/// Weights and time constants (s) of the mirror's thermal poles.
const POLES: [(f64, f64); 3] = [(0.6, 1.5e-3), (0.3, 0.04), (0.1, 3.0)];
/// Its heaters, cold (ohm), and their growth (1/K).
const COLD_OHM: [f64; CHANNELS] = [352.0, 361.0, 358.0, 371.0];
const XI_PER_K: f64 = 3.7e-3;
/// Temperature rise per power at rest (K/W).
const K_PER_W: f64 = 6000.0;

/// A mirror of three poles in every actuator, of which the fastest may slow down as it warms, beams that follow its heaters, and one play in which a part
/// of its motion hangs.
#[derive(Default)]
struct Mirror {
    lags_k: [[f64; POLES.len()]; CHANNELS],
    /// Growth of the fastest one's heat capacity (1/K).
    capacity_growth_per_k: f64,
    beams_k: [f64; CHANNELS],
    /// Time constant with which the beams follow (s); 0: at once.
    beam_lag_s: f64,
    /// Part of the motion that hangs in the play, and half the play (um).
    hangs: f64,
    half_um: f64,
    held_um: f64,
}

impl Mirror {
    fn rise_k(&self, actuator: usize) -> f64 {
        let lags = self.lags_k[actuator].iter().zip(POLES);
        lags.map(|(lag, (weight, _))| weight * lag).sum()
    }

    fn current_a(&self, actuator: usize, volts: f64) -> f64 {
        volts / (COLD_OHM[actuator] * (1.0 + XI_PER_K * self.rise_k(actuator)))
    }

    fn tick(&mut self, volts: [f64; CHANNELS]) {
        let step_s = TICK_S / f64::from(PARTS);
        for _ in 0..PARTS {
            for (actuator, volts) in volts.into_iter().enumerate() {
                let heating_k = K_PER_W * volts * self.current_a(actuator, volts);
                let growth = self.capacity_growth_per_k * self.rise_k(actuator);
                let capacities = [1.0 + growth, 1.0, 1.0];
                let lags = self.lags_k[actuator].iter_mut().zip(POLES);
                for ((lag, (_, time_s)), capacity) in lags.zip(capacities) {
                    *lag += step_s / (capacity * time_s) * (heating_k - *lag);
                }
                let ahead_k = self.rise_k(actuator) - self.beams_k[actuator];
                self.beams_k[actuator] += step_s / self.beam_lag_s.max(step_s) * ahead_k;
            }
        }
        let x_um = self.still_um();
        self.held_um = self.held_um.clamp(x_um - self.half_um, x_um + self.half_um);
    }

    /// Displacement without memory: 1.1 um a kelvin, and bent.
    fn still_um(&self) -> f64 {
        let mean_k = self.beams_k.iter().sum::<f64>() / CHANNELS as f64;
        mean_k * (1.1 + 4e-4 * mean_k)
    }

    fn z_um(&self) -> f64 {
        let x_um = self.still_um();
        x_um + self.hangs * (self.held_um - x_um)
    }
}

/// The calibration that nothing was measured for.
fn first() -> Calibration {
    let model = Model::from(Preset::Reconciled);
    tabulate(&model).expect("a calibration").calibration
}

/// Goes to positions on a board with `calibration`, which reads everything at every so many ticks; returns it with the
/// errors at the end of each stay (um).
fn played(
    mirror: &mut Mirror,
    calibration: &Calibration,
    positions_um: &[f64],
    every: usize,
) -> (MeasurementFile, Vec<f64>) {
    let mut calibration = *calibration;
    let mut controller = Controller::new(&mut calibration);
    let mut file = MeasurementFile::default();
    file.keys.set("drive", "position");
    file.keys.set("noise_z_nm", "5");
    let mut volts = [0.0; CHANNELS];
    let mut currents = [Ampere(0.0); CHANNELS];
    let stay = (JUMP_S / TICK_S) as usize;
    let mut errors = Vec::new();
    for (tick, &z) in positions_um
        .iter()
        .flat_map(|z| std::iter::repeat_n(z, stay))
        .enumerate()
    {
        let before = volts;
        let setpoint = Setpoint::position(Micrometre(z as f32));
        let step = controller.step(setpoint, before.map(|v| Volt(v as f32)), currents);
        volts = step.drives.map(|drive| f64::from(drive.0));
        currents = std::array::from_fn(|i| Ampere(mirror.current_a(i, volts[i]) as f32));
        if tick % stay < 100 || tick % every == 0 {
            let mean_v: [f64; CHANNELS] = std::array::from_fn(|i| 0.5 * (before[i] + volts[i]));
            file.rows.push(Row {
                t_s: tick as f64 * TICK_S,
                voltage_v: mean_v,
                current_a: std::array::from_fn(|i| Some(mirror.current_a(i, mean_v[i]))),
                z_um: Some(mirror.z_um()),
                ..Row::default()
            });
        }
        mirror.tick(volts);
        if tick % stay == stay - 1 {
            errors.push(mirror.z_um() - z);
        }
    }
    (file, errors)
}

/// What moves all over the range refine.
fn session(mirror: &mut Mirror, calibration: &Calibration) -> Session {
    let top_um = 0.9 * f64::from(calibration.max_position().0);
    let positions: Vec<f64> = jump_shares().take(20).map(|share| share * top_um).collect();
    let (file, _) = played(mirror, calibration, &positions, 300);
    Session {
        files: vec![("moves.csv".into(), file)],
    }
}

fn found(mirror: &mut Mirror) -> Refined {
    let first = first();
    refined(&first, &session(mirror, &first)).expect("refined")
}

/// What is found of the mirror without a play, which most tests ask for.
static PLAIN: LazyLock<Refined> = LazyLock::new(|| found(&mut Mirror::default()));

/// The part of the way that poles have gone after a time.
fn gone(heat: &Heat, after_s: f64) -> f64 {
    let lags = heat.fast.iter().chain(&heat.slow);
    let gone = lags.map(|lag| {
        let time_s = f64::from(lag.time.0).max(1e-9);
        f64::from(lag.weight) * (1.0 - (-after_s / time_s).exp())
    });
    gone.sum()
}

#[test]
fn poles_resistances_and_shape_are_found() {
    let first = first();
    let refined = &*PLAIN;
    let left_um = refined.residual_rms_um;
    // What is required of positions at rest (`docs/requirements.md`).
    assert!(left_um < 0.05, "{left_um}");
    let heat = &refined.calibration.parts().heat;
    for after_s in [0.5e-3, 1.5e-3, 5e-3, 0.02, 0.06, 0.2, 1.0, 3.0] {
        let true_poles = POLES.into_iter();
        let truth: f64 = true_poles
            .map(|(weight, time_s)| weight * (1.0 - f64::exp(-after_s / time_s)))
            .sum();
        let said = gone(heat, after_s);
        // Other poles may follow the same course. A third of the band of 5 % in which a step counts as arrived.
        assert!(
            (said - truth).abs() < 0.015,
            "{said} of {truth} after {after_s} s"
        );
    }
    for (actuator, true_ohm) in refined.calibration.actuators().iter().zip(COLD_OHM) {
        let ohm = f64::from(actuator.cold_resistance.0);
        // 0.5 % are 1.4 K by the coefficient; an uncalibrated board knows its temperatures to 11 K.
        assert!((ohm / true_ohm - 1.0).abs() < 0.005, "{ohm} of {true_ohm}");
    }
    // And a board with it goes where it is told, at places that it was not refined at.
    let places: Vec<f64> = (0..8).map(|i| f64::from(i * 5 % 8) * 15.0 + 8.0).collect();
    let left = |calibration: &Calibration| {
        let (_, errors) = played(&mut Mirror::default(), calibration, &places, 10_000);
        errors.into_iter().map(f64::abs).fold(0.0, f64::max)
    };
    let (before_um, after_um) = (left(&first), left(&refined.calibration));
    assert!(before_um > 1.0, "{before_um} um is too little to refine");
    // The largest is no more than the rms may be.
    assert!(after_um < 0.05, "{after_um} um of {before_um}");
}

#[test]
fn a_play_is_found_and_where_there_is_none_none() {
    let weight = |memory: &Memory| memory.plays.iter().map(|play| play.weight).sum::<f32>();
    let (hangs, half_um) = (0.03, 6.0);
    let with = found(&mut Mirror {
        hangs,
        half_um,
        ..Mirror::default()
    });
    let (none, some) = [&*PLAIN, &with]
        .map(|refined| weight(&refined.calibration.parts().memory))
        .into();
    // A fifteenth of what there is in the other mirror, and of the width of its loop.
    let tolerance = 0.002 / hangs;
    assert!(f64::from(none) < 0.002, "{none}");
    assert!((f64::from(some) / hangs - 1.0).abs() < tolerance, "{some}");
    let plays = &with.calibration.parts().memory.plays;
    let widths_um = plays.map(|play| f64::from(play.weight * play.radius.0));
    let radius_um = widths_um.iter().sum::<f64>() / f64::from(some);
    assert!((radius_um / half_um - 1.0).abs() < tolerance, "{plays:?}");
}

#[test]
#[ignore = "long"]
fn beams_that_follow_their_heaters_are_found() {
    let late = found(&mut Mirror {
        beam_lag_s: 2e-4,
        ..Mirror::default()
    });
    let beam_lag_s = |refined: &Refined| f64::from(refined.calibration.parts().heat.beam_lag.0);
    // Half a tick: what a tick holds is a straight line to the fit.
    let tolerance_s = 0.5 * TICK_S;
    assert!(beam_lag_s(&PLAIN) < tolerance_s);
    assert!((beam_lag_s(&late) - 2e-4).abs() < tolerance_s, "{late:?}");
}

#[test]
#[ignore = "long"]
fn a_heat_capacity_that_grows_is_found() {
    let growth_per_k = 5e-3;
    let growing = found(&mut Mirror {
        capacity_growth_per_k: growth_per_k,
        ..Mirror::default()
    });
    let time_growth = |refined: &Refined| f64::from(refined.calibration.parts().heat.time_growth.0);
    // What the fastest pole, of this weight, takes besides, in the kelvins of the stages.
    let (weight, time_s) = POLES[0];
    let kelvin = f64::from(growing.calibration.actuators()[0].thermal_resistance.0) / K_PER_W;
    let expected = growth_per_k * time_s / (weight * kelvin);
    // While the fastest is on its way the next, of half its weight, has gone a 27th of its own: 2 % of what is stored; the rest is what
    // the stages' rise is bent by.
    let off = time_growth(&growing) / expected - 1.0;
    assert!(off.abs() < 0.1, "{off}");
    assert!(time_growth(&PLAIN).abs() < 0.1 * expected);
}

#[test]
fn missing_readings_change_nothing_but_their_number() {
    let first = first();
    let mut gaps = session(&mut Mirror::default(), &first);
    let rows = &mut gaps.files[0].1.rows;
    for row in rows.iter_mut().skip(2).step_by(3) {
        row.z_um = None;
    }
    for row in rows.iter_mut().skip(3).step_by(7) {
        row.current_a[1] = None;
    }
    let with_gaps = refined(&first, &gaps).expect("refined");
    let [with, without] = [&with_gaps, &*PLAIN].map(|refined| {
        // As above.
        assert!(refined.residual_rms_um < 0.05, "{refined:?}");
        refined.calibration.actuators()[1].cold_resistance.0
    });
    // The resistance is kept from the row before, 0.1 ms or 30 ms ago: some more moves along the heater's line.
    assert!((with / without - 1.0).abs() < 0.005, "{with} of {without}");
}

#[test]
fn what_cannot_refine_is_refused_for_what_it_lacks() {
    let first = first();
    let whole = session(&mut Mirror::default(), &first);
    let refused = |change: &dyn Fn(&mut Vec<Row>)| {
        let mut session = whole.clone();
        change(&mut session.files[0].1.rows);
        refined(&first, &session).expect_err("nothing to refine with")
    };
    assert_eq!(refused(&|rows| rows.clear()), RefineError::TooFew(0));
    assert_eq!(
        refused(&|rows| rows.truncate(150)),
        RefineError::TooFew(150)
    );
    let blind = refused(&|rows| rows.iter_mut().for_each(|row| row.z_um = None));
    assert_eq!(blind, RefineError::TooFew(0));
    // A sensor that stands still, and one that was plugged in elsewhere.
    let stuck = refused(&|rows| rows.iter_mut().for_each(|row| row.z_um = Some(40.0)));
    assert_eq!(stuck, RefineError::NoFit);
    let upside_down = refused(&|rows| {
        let turned = |row: &mut Row| row.z_um = row.z_um.map(|z| 200.0 - z);
        rows.iter_mut().for_each(turned);
    });
    assert_eq!(upside_down, RefineError::NoFit);
    // Without currents nobody knows what heats it, but for the five readings before the first drive.
    let unheated = refused(&|rows| {
        rows.iter_mut()
            .for_each(|row| row.current_a = [None; CHANNELS]);
    });
    assert_eq!(unheated, RefineError::TooFew(5));
}
