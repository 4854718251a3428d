//! What positioning would leave on a mirror that is a model: the drives that the core would give along a standard path,
//! and where the model goes under them.

use control_core::calibration::{Heat, Memory, Parts};
use control_core::{
    Ampere, CHANNELS, Calibration, Controller, Micrometre, PwmCode, Setpoint, TICK,
};
use mirror_model::effect::Acts;
use mirror_model::{ACTUATORS, Interval, Model, Runaway, Simulation};

use crate::{TabulateError, tabulate};

/// Step control of the simulation, whose steps are as short as a tick anyway.
const RESOLUTION: f64 = 0.5;
/// Positions of the path in parts of the range: it moves to each in `MOVE_S` and stays there.
const RESTS: [f64; 3] = [0.6, 0.9, 0.3];
const MOVE_S: f64 = 0.2;
const REST_S: f64 = 0.5;
/// Then sines about the last position: amplitude in parts of the range, frequency, periods.
const SINES: [(f64, f64, f64); 2] = [(0.1, 1.0, 2.0), (0.05, 20.0, 4.0)];

/// How far the mirror is from where it is asked to be.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Left {
    /// Root mean square along the path.
    pub rms_um: f64,
    /// The largest.
    pub largest_um: f64,
}

/// What is left along the standard path.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Rehearsal {
    /// With the tables for rest alone.
    pub at_rest: Left,
    /// With the stages in time, too.
    pub in_time: Left,
}

/// Moves a mirror that is `nature` with a board that knows `known`: minimum-jerk trajectories, rests, and sines of 1 and 20 Hz.
///
/// What a sensor does to its reading is left out: it is where the mirror goes that counts.
///
/// # Errors
/// Where `known` gives no calibration, or `nature` has no finite answer.
pub fn rehearse(nature: &Model, known: &Model) -> Result<Rehearsal, TabulateError> {
    let in_time = tabulate(known)?.calibration;
    let at_rest = Calibration::new(Parts {
        heat: Heat::INSTANT,
        memory: Memory::NONE,
        ..*in_time.parts()
    })?;
    let mut mirror = nature.clone();
    mirror
        .effects
        .retain(|active| active.effect.info().acts != Acts::Reading);
    Ok(Rehearsal {
        at_rest: moved(&mirror, at_rest)?,
        in_time: moved(&mirror, in_time)?,
    })
}

fn moved(mirror: &Model, mut calibration: Calibration) -> Result<Left, Runaway> {
    let top_um = f64::from(calibration.max_position().0);
    let mut controller = Controller::new(&mut calibration);
    let mut simulation = Simulation::new(mirror, RESOLUTION);
    let mut applied = [PwmCode(0); CHANNELS];
    let mut currents = [Ampere(0.0); CHANNELS];
    let (mut squares, mut largest_um, mut ticks) = (0.0, 0.0_f64, 0usize);
    let path: Vec<f64> = path().collect();
    let ahead = f64::from(controller.track_delay_ticks());
    for (tick, part) in path.iter().enumerate() {
        let setpoint =
            Setpoint::track(Micrometre((at(&path, tick as f64 + ahead) * top_um) as f32));
        applied = controller
            .step(setpoint, applied.map(PwmCode::drive), currents)
            .codes;
        let volts: [f64; ACTUATORS] = applied.map(|code| f64::from(code.drive().0));
        let output = simulation.run(&Interval::held(volts, f64::from(TICK.0)))?;
        currents = output.current_a.map(|ampere| Ampere(ampere as f32));
        let off_um = output.z_um - part * top_um;
        squares += off_um * off_um;
        largest_um = largest_um.max(off_um.abs());
        ticks += 1;
    }
    Ok(Left {
        rms_um: (squares / ticks as f64).sqrt(),
        largest_um,
    })
}

/// Where the mirror shall be at the end of each tick, in parts of the range.
fn path() -> impl Iterator<Item = f64> {
    let tick_s = f64::from(TICK.0);
    let ticks = move |seconds: f64| {
        (1..=(seconds / tick_s).round() as usize).map(move |tick| tick as f64 * tick_s)
    };
    let from = [0.0, RESTS[0], RESTS[1]];
    let moves = from.into_iter().zip(RESTS).flat_map(move |(from, to)| {
        let way = ticks(MOVE_S).map(move |t| from + (to - from) * minimum_jerk(t / MOVE_S));
        way.chain(ticks(REST_S).map(move |_| to))
    });
    let middle = RESTS[2];
    let sines = SINES.into_iter().flat_map(move |(amplitude, hz, periods)| {
        ticks(periods / hz)
            .map(move |t| middle + amplitude * (std::f64::consts::TAU * hz * t).sin())
    });
    moves.chain(sines)
}

/// The path at a time between ticks; it stays at its end.
fn at(path: &[f64], tick: f64) -> f64 {
    let last = path.len() - 1;
    let (before, after) = ((tick as usize).min(last), (tick as usize + 1).min(last));
    path[before] + tick.fract() * (path[after] - path[before])
}

/// The minimum-jerk trajectory from 0 to 1 (Flash and Hogan 1985).
fn minimum_jerk(part: f64) -> f64 {
    part.powi(3) * (10.0 - 15.0 * part + 6.0 * part * part)
}
