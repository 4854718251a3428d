//! The tool's own command lines, for what the lab proposes as data.

use diagnosis::{Next, Proposal};
use experiments::Measurement;

use crate::cli::defaults::{
    AMPLITUDE, CYCLES, DWELL, FREQUENCY, HOLD, MAX, MEAN, RATE, REFERENCE_FILE, SINGLE_STEPS,
    STEP_TO, SWEEP_STEPS,
};

/// How to do what a diagnosis proposes.
pub fn next_line(next: &Next) -> String {
    match next {
        Next::Measure(proposal) => proposal_line(proposal),
        Next::ReadAbout(effect) => format!("host-tool effect show {effect}"),
    }
}

/// How to make a measurement in given surroundings, under the name that is proposed.
pub fn proposal_line(proposal: &Proposal) -> String {
    let mut line = measure_line(&proposal.measurement);
    if let Some(ambient_c) = proposal.ambient_c {
        line += &format!(" --ambient {ambient_c}");
    }
    if let Some(name) = proposal.name {
        let file = match proposal.measurement {
            Measurement::Session { .. } => name.to_owned(),
            _ => format!("{name}.csv"),
        };
        line += &option("-o", &file, REFERENCE_FILE);
    }
    line
}

/// How to make a measurement. What is left out stays what it is.
pub fn measure_line(measurement: &Measurement) -> String {
    let volts = |v: f64| format!("{v}V");
    let seconds = |s: f64| format!("{s}s");
    let options = match measurement {
        Measurement::Sweep {
            max_v,
            steps,
            dwell_s,
            cycles,
        } => [
            "sweep".to_owned(),
            option("--max", &volts(*max_v), MAX),
            option("--steps", &steps.to_string(), &SWEEP_STEPS.to_string()),
            option("--dwell", &seconds(*dwell_s), DWELL),
            option("--repeat", &cycles.to_string(), "1"),
        ]
        .concat(),
        Measurement::Step {
            to_v,
            hold_s,
            rate_hz,
        } => [
            "step".to_owned(),
            option("--to", &volts(*to_v), STEP_TO),
            option("--hold", &seconds(*hold_s), HOLD),
            option("--rate", &hertz(*rate_hz), RATE),
        ]
        .concat(),
        Measurement::Sine {
            mean_v,
            amplitude_v,
            frequency_hz,
            cycles,
        } => [
            "sine".to_owned(),
            option("--mean", &volts(*mean_v), MEAN),
            option("--amplitude", &volts(*amplitude_v), AMPLITUDE),
            option("--frequency", &hertz(*frequency_hz), FREQUENCY),
            option("--cycles", &cycles.to_string(), &CYCLES.to_string()),
        ]
        .concat(),
        Measurement::Single {
            max_v,
            steps,
            dwell_s,
        } => [
            "single".to_owned(),
            option("--max", &volts(*max_v), MAX),
            option("--steps", &steps.to_string(), &SINGLE_STEPS.to_string()),
            option("--dwell", &seconds(*dwell_s), DWELL),
        ]
        .concat(),
        Measurement::Held {
            volts: all,
            dwell_s,
        } => [
            format!(
                "held {}",
                all.iter().map(|v| volts(*v)).collect::<Vec<_>>().join(" ")
            ),
            option("--dwell", &seconds(*dwell_s), DWELL),
        ]
        .concat(),
        Measurement::Session { max_v } => {
            format!("session{}", option("--max", &volts(*max_v), MAX))
        }
        Measurement::Reference {
            heights_um,
            dwell_s,
        } => {
            let heights: Vec<String> = heights_um.iter().map(|um| format!("{um}um")).collect();
            let settle = option("--settle", &seconds(*dwell_s), DWELL);
            format!("reference {}{settle}", heights.join(" "))
        }
    };
    format!("host-tool measure {options}")
}

/// An option, unless it is what it would be without.
fn option(name: &str, value: &str, default: &str) -> String {
    if value == default {
        String::new()
    } else {
        format!(" {name} {value}")
    }
}

fn hertz(hz: f64) -> String {
    if hz >= 1e3 {
        format!("{}kHz", hz / 1e3)
    } else {
        format!("{hz}Hz")
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::{Arguments, Command, Measure};

    /// The measurement that a command line asks for.
    fn asked(line: &str) -> Measurement {
        let arguments = Arguments::try_parse_from(line.split(' '));
        let arguments = arguments.unwrap_or_else(|error| panic!("{line}: {error}"));
        match arguments.command {
            Command::Measure(Measure::Experiment(experiment)) => experiment.measurement(),
            Command::Measure(Measure::Reference(reference)) => Measurement::Reference {
                heights_um: reference.heights.iter().map(|height| height.um).collect(),
                dwell_s: reference.settle.s,
            },
            other => panic!("{line} is {other:?}"),
        }
    }

    #[test]
    fn every_line_asks_for_its_measurement() {
        // A session goes to a folder, which has no default.
        let folder = |proposal: &Proposal| match proposal.measurement {
            Measurement::Session { .. } => proposal.name.is_some(),
            _ => true,
        };
        for top_v in [3.5, 3.3, 2.85] {
            for proposal in diagnosis::proposals(top_v) {
                assert!(folder(&proposal), "{proposal:?}");
                assert_eq!(asked(&proposal_line(&proposal)), proposal.measurement);
            }
        }
        let held = Measurement::Held {
            volts: vec![0.0, 1.5],
            dwell_s: 0.05,
        };
        assert_eq!(asked(&measure_line(&held)), held);
    }

    #[test]
    fn what_is_usual_is_left_out() {
        let step = |hold_s| Measurement::Step {
            to_v: 2.0,
            hold_s,
            rate_hz: 5e3,
        };
        assert_eq!(measure_line(&step(30.0)), "host-tool measure step");
        assert_eq!(
            measure_line(&step(60.0)),
            "host-tool measure step --hold 60s"
        );
    }
}
