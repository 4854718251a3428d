//! Experiments that a board and its bench can run, each with the command that runs it and what it would read.

use crate::plan::{Channel, Observation, OwnZero, Plan};
use mirror_model::{ACTUATORS, Interval};

/// Noise of a current reading (A).
const NOISE_A: f64 = 2e-6;
/// Voltage at which idle actuators are sensed.
const SENSE_BIAS_V: f64 = 0.2;
/// Readings a cycle of a sine.
const READINGS_PER_CYCLE: usize = 100;
/// Frequencies of the sines that take the place of a chirp (Hz).
const CHIRP_HZ: [f64; 3] = [200.0, 500.0, 1000.0];

/// The room where a session does not say how warm it was (degC).
pub(crate) const ROOM_C: f64 = 22.0;
/// How much warmer another room is, and an oven (K).
const OTHER_ROOM_K: f64 = 13.0;
const OVEN_K: f64 = 38.0;
/// A drive that heats next to nothing (V).
const COLD_V: f64 = 0.4;
/// Heights that a stage goes to (um), and back.
const HEIGHTS_UM: [u32; 4] = [0, 50, 100, 150];
/// Time that surroundings take to be what a thermometer says (s).
const SETTLING_S: f64 = 60.0;

/// Every command that a diagnosis may propose for drives up to `top` volts.
pub fn commands(top: f64) -> Vec<String> {
    let on_the_board = menu(top).into_iter().map(|experiment| experiment.command);
    let with_currents = with_currents(&Plan::default(), top).command;
    on_the_board
        .chain([with_currents])
        .chain(beside(top, ROOM_C).map(|experiment| experiment.command))
        .collect()
}

/// An experiment that the board, or its bench, can run.
pub(crate) struct Experiment {
    pub(crate) command: String,
    pub(crate) what: &'static str,
    intervals: Vec<Interval>,
    /// The first interval in which something else than the board moves the mirror too: on a clock of its own, after a sweep
    /// that a session has already.
    apart: Option<usize>,
}

/// What the board can be made to drive, up to `top` volts.
pub(crate) fn menu(top: f64) -> Vec<Experiment> {
    let experiment = |command: String, what, intervals| Experiment {
        command: format!("host-tool measure {command}"),
        what,
        intervals,
        apart: None,
    };
    let volts = |share: f64| (1e3 * share * top).round() / 1e3;
    let (middle, swing) = (volts(0.5), volts(0.2));
    let mut menu = vec![
        experiment(
            format!("single --max {top}V"),
            "heat one actuator and sense an idle one",
            single(top),
        ),
        experiment(
            format!("step --to {}V --hold 60s", volts(0.7)),
            "hold a step for a minute, then rest",
            step(volts(0.7), 60.0, 2e-4),
        ),
        experiment(
            format!("step --to {}V --hold 1s --rate 10kHz", volts(0.6)),
            "sample a step fast",
            step(volts(0.6), 1.0, 1e-4),
        ),
        experiment(
            format!("sweep --max {top}V --repeat 2"),
            "repeat the sweep",
            (0..2).flat_map(|_| sweep(top)).collect(),
        ),
        experiment(
            format!("sine --mean {middle}V --amplitude {swing}V --frequency 0.01Hz"),
            "minor loops, slow enough for all heat to settle",
            sine(middle, swing, 0.01),
        ),
    ];
    menu.extend(CHIRP_HZ.map(|hz| {
        experiment(
            format!("sine --mean {middle}V --amplitude {swing}V --frequency {hz}Hz"),
            "a fast sine, one frequency of a chirp",
            sine(middle, swing, hz),
        )
    }));
    menu
}

/// What no drive does: on the bench, after a sweep up to `top` volts in surroundings at `first_c`.
pub(crate) fn beside(top: f64, first_c: f64) -> [Experiment; 3] {
    let after_a_sweep = |command: String, what, more: Vec<Interval>| {
        let sweep: Vec<_> = sweep(top).collect();
        Experiment {
            command: format!("host-tool measure {command}"),
            what,
            apart: Some(sweep.len()),
            intervals: [sweep, more].concat(),
        }
    };
    let warmer = |ambient_k: f64, max_v: f64| {
        let rest = Interval::held([0.0; ACTUATORS], SETTLING_S);
        let warm = |interval| Interval {
            ambient_k,
            ..interval
        };
        std::iter::once(rest)
            .chain(sweep(max_v))
            .map(warm)
            .collect()
    };
    let at = |warmer_k: f64| (first_c + warmer_k).round();
    let heights = HEIGHTS_UM.map(|um| format!("{um}um")).join(" ");
    [
        after_a_sweep(
            format!("reference {heights} -o reference.csv"),
            "reference steps of the sensor's target on a stage, at rest",
            reference(),
        ),
        after_a_sweep(
            format!(
                "sweep --max {top}V --ambient {} -o warmer.csv",
                at(OTHER_ROOM_K)
            ),
            "a sweep with the room at another, known temperature",
            warmer(OTHER_ROOM_K, top),
        ),
        after_a_sweep(
            format!("sweep --max {COLD_V}V --ambient {} -o oven.csv", at(OVEN_K)),
            "an oven at a known temperature with the heaters next to off",
            warmer(OVEN_K, COLD_V),
        ),
    ]
}

/// Up and down again over the heights.
fn reference() -> Vec<Interval> {
    let up_and_down = HEIGHTS_UM
        .into_iter()
        .chain(HEIGHTS_UM.into_iter().rev().skip(1));
    up_and_down
        .map(|um| Interval {
            reference_um: f64::from(um),
            ..Interval::held([0.0; ACTUATORS], 1.0)
        })
        .collect()
}

/// The session once more, with the currents that were not measured.
pub(crate) fn with_currents(session: &Plan, top: f64) -> Experiment {
    Experiment {
        command: format!("host-tool measure session --max {top}V -o with-currents"),
        what: "measure the currents, too: the resistance is a thermometer",
        intervals: session.intervals.clone(),
        apart: None,
    }
}

impl Experiment {
    /// What it would read: displacement and currents at the end of each interval.
    pub(crate) fn plan(&self, noise_um: f64) -> Plan {
        let mut plan = Plan {
            experiments: vec!["sweep".into(), self.command.clone()],
            intervals: self.intervals.clone(),
            ..Plan::default()
        };
        let mut t_s = 0.0;
        for (interval, piece) in self.intervals.iter().enumerate() {
            t_s += piece.duration_s;
            let observation = |channel, noise| Observation {
                interval,
                channel,
                value: 0.0,
                noise,
                experiment: usize::from(self.apart.is_none_or(|first| interval >= first)),
                t_s,
            };
            let currents =
                (0..ACTUATORS).map(|actuator| observation(Channel::Current(actuator), NOISE_A));
            plan.observations
                .push(observation(Channel::Displacement, noise_um));
            plan.observations.extend(currents);
        }
        let own_zero = self.apart.map(|_| OwnZero::new(1..2, &plan.observations));
        plan.own_zeros.extend(own_zero);
        plan
    }
}

fn sweep(top: f64) -> impl Iterator<Item = Interval> {
    let ladder = (0..=35).chain((0..35).rev());
    ladder.map(move |step| Interval::held([top * f64::from(step) / 35.0; ACTUATORS], 1.0))
}

fn single(top: f64) -> Vec<Interval> {
    let alone = |hot: usize, step: u32| {
        let mut drive = [SENSE_BIAS_V; ACTUATORS];
        drive[hot] = top * f64::from(step) / 7.0;
        Interval::held(drive, 1.0)
    };
    let rest = Interval::held([0.0; ACTUATORS], 2.0);
    (0..ACTUATORS)
        .flat_map(|hot| {
            let steps = (0..=7).map(move |step| alone(hot, step));
            steps.chain(std::iter::once(rest))
        })
        .collect()
}

/// Read at first every `first_s`, then a twentieth later each time.
fn step(to: f64, hold_s: f64, first_s: f64) -> Vec<Interval> {
    let edge = |volts: f64| {
        let mut passed = 0.0;
        let mut pieces = Vec::new();
        while passed < hold_s * (1.0 - 1e-9) {
            let piece = (0.05 * passed).max(first_s).min(hold_s - passed);
            pieces.push(Interval::held([volts; ACTUATORS], piece));
            passed += piece;
        }
        pieces
    };
    [edge(to), edge(0.0)].concat()
}

/// Three cycles after 5 s at the mean.
fn sine(mean: f64, amplitude: f64, hz: f64) -> Vec<Interval> {
    let at = |reading: usize| {
        let phase = std::f64::consts::TAU * reading as f64 / READINGS_PER_CYCLE as f64;
        [mean + amplitude * phase.sin(); ACTUATORS]
    };
    let cycles = (0..3 * READINGS_PER_CYCLE).map(|reading| Interval {
        duration_s: 1.0 / (hz * READINGS_PER_CYCLE as f64),
        from_v: at(reading),
        to_v: at(reading + 1),
        ..Interval::default()
    });
    std::iter::once(Interval::held(at(0), 5.0))
        .chain(cycles)
        .collect()
}
