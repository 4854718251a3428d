//! Sessions: what is measured of one mirror on one day.

use crate::experiment::Experiment;

/// The highest drive of the paper's procedures (V), in shares of which the session's other drives are stated.
const PAPER_MAX_V: f64 = 3.5;
/// Drive of the step (V), mean and amplitude of the sines (V) and their frequencies (Hz) in the paper's procedures.
const STEP_V: f64 = 2.0;
const SINE_V: (f64, f64) = (1.0, 0.5);
const SINES_HZ: [f64; 4] = [0.1, 1.0, 20.0, 100.0];
/// Before the step and the slowest sine, and before each other experiment, the mirror cools so long (s): 20 s let the
/// slowest known heat, that of the substrate, fall to a twentieth.
const COOLING_S: f64 = 20.0;
const SHORT_COOLING_S: f64 = 5.0;
/// What a sweep or a step is read at first (Hz): every second tick of the board.
const STEP_RATE_HZ: f64 = 5e3;

/// Highest drive (V) and steps of a sweep that heats next to nothing: 0.4 mW, 0.4 K.
pub(crate) const COLD_SWEEP: (f64, u32) = (0.4, 8);
/// How much warmer an oven is than the room (K), in turn: what any oven holds, and every film bears.
pub const OVEN_K: [f64; 2] = [20.0, 40.0];
/// Surroundings take so long to be what a thermometer says (s).
pub const SETTLING_S: f64 = 60.0;
/// Heights that a stage goes to and back from (um): over the mirror's own range.
pub(crate) const HEIGHTS_UM: [f64; 9] = [0.0, 40.0, 80.0, 120.0, 160.0, 120.0, 80.0, 40.0, 0.0];

/// What a fit and a diagnosis want, up to `max_v`: sweep, step, four sines, each actuator alone, and the sweep again,
/// coarser. It takes five minutes.
pub fn session(max_v: f64) -> Vec<Experiment> {
    let mut experiments = session_in_common(max_v);
    experiments.extend([
        Experiment::single(max_v, 7, 1.0).after(SHORT_COOLING_S),
        Experiment::sweep(max_v, 7, 1.0, 1)
            .named("repeat")
            .after(7.0),
    ]);
    experiments
}

/// The part of it in which all actuators move alike, which is what a piston calibration inverts.
pub fn session_in_common(max_v: f64) -> Vec<Experiment> {
    let volts = |paper_v: f64| millivolts(max_v * paper_v / PAPER_MAX_V);
    let sine = |hz: f64| {
        let cooling_s = if hz < 1.0 { COOLING_S } else { SHORT_COOLING_S };
        Experiment::sine(volts(SINE_V.0), volts(SINE_V.1), hz, 3).after(cooling_s)
    };
    let held = [
        Experiment::sweep(max_v, 35, 1.0, 1),
        Experiment::step(volts(STEP_V), 30.0, STEP_RATE_HZ).after(COOLING_S),
    ];
    held.into_iter().chain(SINES_HZ.map(sine)).collect()
}

/// The session, sweeps that heat next to nothing in an oven at two temperatures, and a ladder of reference steps: what no
/// drive shows.
pub fn with_oven_and_reference(max_v: f64) -> Vec<Experiment> {
    let oven = |rise_k: f64| {
        Experiment::sweep(COLD_SWEEP.0, COLD_SWEEP.1, 1.0, 1)
            .named(&format!("oven_{rise_k}"))
            .after(SETTLING_S)
            .with_ambient_rise(rise_k)
    };
    let mut experiments = session(max_v);
    experiments.extend(OVEN_K.map(oven));
    experiments.push(Experiment::reference(&HEIGHTS_UM, 1.0).after(SETTLING_S));
    experiments
}

/// Rounded as the board's drives are.
fn millivolts(volts: f64) -> f64 {
    (1e3 * volts).round() / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_session_has_the_paper_s_drives_and_takes_five_minutes() {
        let experiments = session(3.5);
        let names: Vec<&str> = experiments.iter().map(|e| e.name.as_str()).collect();
        assert_eq!(
            names,
            [
                "sweep", "step", "sine_0p1", "sine_1", "sine_20", "sine_100", "single", "repeat"
            ]
        );
        let total_s: f64 = experiments.iter().map(Experiment::duration_s).sum();
        approx::assert_relative_eq!(total_s, 304.18, max_relative = 1e-9);
        let (_, step_v) = experiments[1].runs[0].signal.range();
        assert_eq!(step_v, 2.0);
        assert_eq!(experiments[4].runs[0].signal.range(), (0.5, 1.5));
    }

    #[test]
    fn no_drive_is_above_the_highest() {
        for experiment in session(2.9) {
            for run in experiment.runs {
                let (low, high) = run.signal.range();
                assert!((0.0..=2.9).contains(&low) && (0.0..=2.9).contains(&high));
            }
        }
    }
}
