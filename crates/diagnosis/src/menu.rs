//! Experiments that the board can run, each with the command that runs it and what it would read.

use crate::plan::{Channel, Observation, Plan};
use mirror_model::{ACTUATORS, Interval};

/// Noise of a current reading (A).
const NOISE_A: f64 = 2e-6;
/// Voltage at which idle actuators are sensed.
const SENSE_BIAS_V: f64 = 0.2;
/// Readings a cycle of a sine.
const READINGS_PER_CYCLE: usize = 100;
/// Frequencies of the sines that take the place of a chirp (Hz).
const CHIRP_HZ: [f64; 3] = [200.0, 500.0, 1000.0];

/// What a drive cannot tell, something beside the board may while it records.
pub(crate) const REFERENCE_STEP: &str =
    "host-tool record -o reference.csv --duration 10s --period 1ms";
pub(crate) const OTHER_ROOM: &str = "host-tool measure session --ambient 35 -o warmer";
pub(crate) const OVEN: &str = "host-tool measure sweep --max 0.4V --ambient 60 -o oven.csv";

/// Every command that a diagnosis may propose for drives up to `top` volts.
pub fn commands(top: f64) -> Vec<String> {
    let on_the_board = menu(top).into_iter().map(|experiment| experiment.command);
    let with_currents = with_currents(&Plan::default(), top).command;
    on_the_board
        .chain([with_currents])
        .chain([REFERENCE_STEP, OTHER_ROOM, OVEN].map(String::from))
        .collect()
}

/// An experiment that the board can run.
pub(crate) struct Experiment {
    pub(crate) command: String,
    pub(crate) what: &'static str,
    intervals: Vec<Interval>,
}

/// What the board can be made to drive, up to `top` volts.
pub(crate) fn menu(top: f64) -> Vec<Experiment> {
    let experiment = |command: String, what, intervals| Experiment {
        command: format!("host-tool measure {command}"),
        what,
        intervals,
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

/// The session once more, with the currents that were not measured.
pub(crate) fn with_currents(session: &Plan, top: f64) -> Experiment {
    Experiment {
        command: format!("host-tool measure session --max {top}V -o with-currents"),
        what: "measure the currents, too: the resistance is a thermometer",
        intervals: session.intervals.clone(),
    }
}

impl Experiment {
    /// What it would read: displacement and currents at the end of each interval.
    pub(crate) fn plan(&self, noise_um: f64) -> Plan {
        let mut plan = Plan {
            experiments: vec![self.command.clone()],
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
                experiment: 0,
                t_s,
            };
            let currents =
                (0..ACTUATORS).map(|actuator| observation(Channel::Current(actuator), NOISE_A));
            plan.observations
                .push(observation(Channel::Displacement, noise_um));
            plan.observations.extend(currents);
        }
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
