//! What positioning reaches on mirrors of other equations than the project's own.

use std::thread;

use anyhow::{Context, Result};
use clap::Parser;
use closed_loop::{Loop, calibrate_then, figures};
use control_core::CHANNELS;
use foreign_mirror::ForeignConfig;

/// The move that is compared with its limit (um).
const FAR_UM: (f64, f64) = (10.0, 155.0);
/// Where loops and triangles are (um), and the loops' frequencies with what is required of each (um).
const LOOP_UM: (f64, f64) = (60.0, 100.0);
const LOOPS: [(f64, f64); 3] = [(0.1, 0.1), (1.0, 0.15), (20.0, 0.25)];
const TRIANGLE_UM: (f64, f64) = (40.0, 80.0);
const TRIANGLE_HZ: f64 = 20.0;
const CREEP_UM: (f64, f64) = (20.0, 90.0);
/// How long it stays at the ends of a way over the whole range (s).
const STAY_S: f64 = 1.0;
/// From a reset to the first tick (s), as `hil/tests/silicon.rs` measures it, and how long the power is gone.
const START_S: f64 = 10e-3;
const POWER_GONE_S: f64 = 0.1;

/// Which mirrors are measured.
#[derive(Parser)]
#[command(name = "cargo xtask bench foreign --", no_binary_name = true)]
struct ForeignArguments {
    /// Seed of the first of the four; those of the others follow. Nothing was developed on 901 to 904.
    #[arg(long, default_value_t = 901)]
    first_seed: u64,
    /// Only these of the four, by number.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=4))]
    only: Vec<u64>,
}

/// What was measured of one mirror.
struct ForeignEvidence {
    name: String,
    /// The first moves after `calibrate`, those after a reset then, those after the board's power was gone then, those after that and a
    /// way over the whole range, and those from rest.
    at_rest: [figures::Static; 5],
    up: figures::Step,
    down: figures::Step,
    creep: f64,
    loops: [figures::Width; LOOPS.len()],
    triangle_um: f64,
}

/// The usual mirror, and what others may have of it, by seeds from this one on.
fn mirrors(first_seed: u64) -> [ForeignConfig; 4] {
    let usual = |number: u64, what: &str| {
        let mirror = ForeignConfig::new(first_seed + number);
        ForeignConfig {
            name: format!("{}{what}", mirror.name),
            ..mirror
        }
    };
    [
        usual(0, ""),
        ForeignConfig {
            resonance_hz: 300.0,
            quality: 3.0,
            slowness: 10.0,
            ..usual(1, ": 300 Hz, slow")
        },
        ForeignConfig {
            resonance_hz: 1000.0,
            quality: 50.0,
            creep: 0.05,
            ..usual(2, ": 1 kHz, creeping")
        },
        ForeignConfig {
            resonance_hz: 3000.0,
            quality: 20.0,
            slowness: 0.1,
            weakness: 0.2,
            ..usual(3, ": 3 kHz, fast, weak")
        },
    ]
}

/// Calibrates every mirror from what is measured of it, and prints what positioning reaches then.
pub(crate) fn run(arguments: &[String]) -> Result<()> {
    let ForeignArguments { first_seed, only } = ForeignArguments::try_parse_from(arguments)?;
    let chosen = (1..).zip(mirrors(first_seed));
    let chosen = chosen.filter(|(number, _)| only.is_empty() || only.contains(number));
    let threads: Vec<_> = chosen
        .map(|(_, config)| thread::spawn(move || measure(config)))
        .collect();
    let evidence: Vec<(String, Result<ForeignEvidence>)> = threads
        .into_iter()
        .map(|thread| thread.join().ok().context("a measurement panicked"))
        .collect::<Result<_>>()?;
    let mut measured = Vec::new();
    for (name, evidence) in evidence {
        match evidence {
            Ok(evidence) => measured.push(evidence),
            Err(error) => println!("{name}: {error}"),
        }
    }
    print(&measured);
    Ok(())
}

fn measure(config: ForeignConfig) -> (String, Result<ForeignEvidence>) {
    let name = config.name.clone();
    (name, evidence(&config))
}

fn evidence(config: &ForeignConfig) -> Result<ForeignEvidence> {
    let (calibrated, (first, mut used, retained)) = calibrate_then(config, |mirror| {
        let first = figures::next_moves(mirror);
        let used = mirror.mirror().clone();
        (first, used, mirror.retained())
    })?;
    let mut calibration = calibrated.calibration;
    let mirror = &mut calibration;
    let mut started = used.clone();
    started.step([0.0; CHANNELS], START_S);
    let mut reset = Loop::of(mirror, config.seed, started);
    reset.recall(&retained);
    let reset = figures::next_moves(&mut reset);
    used.step([0.0; CHANNELS], POWER_GONE_S);
    let powered = figures::next_moves(&mut Loop::of(mirror, config.seed, used.clone()));
    let mut over_the_range = Loop::of(mirror, config.seed, used);
    let top_um = f64::from(over_the_range.calibration().max_position().0);
    for z_um in [top_um, 0.0] {
        over_the_range.hold(z_um, STAY_S);
    }
    let swept = figures::next_moves(&mut over_the_range);
    let (low_um, high_um) = FAR_UM;
    let pairs = [(low_um, high_um), (high_um, low_um)];
    let [up, down] = figures::steps(mirror, config, &pairs)?
        .try_into()
        .ok()
        .context("two steps were asked for")?;
    Ok(ForeignEvidence {
        name: config.name.clone(),
        at_rest: [
            first,
            reset,
            powered,
            swept,
            figures::at_rest(mirror, config)?,
        ],
        up,
        down,
        creep: figures::creep(mirror, config, CREEP_UM)?,
        loops: [
            figures::loop_width(mirror, config, LOOP_UM, LOOPS[0].0)?,
            figures::loop_width(mirror, config, LOOP_UM, LOOPS[1].0)?,
            figures::loop_width(mirror, config, LOOP_UM, LOOPS[2].0)?,
        ],
        triangle_um: figures::triangle(mirror, config, TRIANGLE_UM, TRIANGLE_HZ)?,
    })
}

fn print(evidence: &[ForeignEvidence]) {
    let row = |what: &str, must: &str, value: &dyn Fn(&ForeignEvidence) -> String| {
        let values: Vec<String> = evidence.iter().map(value).collect();
        println!("| {what} | {} | {must} |", values.join(" | "));
    };
    let names: Vec<&str> = evidence.iter().map(|mirror| mirror.name.as_str()).collect();
    println!("| figure | {} | required |", names.join(" | "));
    println!("|---|{}---|", "---|".repeat(names.len()));
    let moves = [
        "after `calibrate`",
        "after a reset",
        "after the power was gone",
        "after that and a way to the top and back",
        "from rest",
    ];
    for (i, after) in moves.into_iter().enumerate() {
        let what = format!("static error of the first moves {after}, rms / largest");
        row(&what, "0.05 / 0.15 um", &|e| {
            let at_rest = &e.at_rest[i];
            let (rms_um, largest_um) = (at_rest.rms_um, at_rest.largest_um);
            format!("{rms_um:.3} / {largest_um:.3} um{}", at_rest.left_out())
        });
    }
    let step = |step: &figures::Step| {
        let [t95_ms, limit_ms] = [step.t95_s, step.limit_s].map(|s| 1e3 * s);
        format!(
            "{t95_ms:.1} ms ({limit_ms:.1}, {:+.0} %)",
            1e2 * (t95_ms / limit_ms - 1.0)
        )
    };
    let must = "the limit and 10 %";
    let (low, high) = FAR_UM;
    row(&format!("t95 {low} to {high} um (limit)"), must, &|e| {
        step(&e.up)
    });
    row(&format!("t95 {high} to {low} um (limit)"), must, &|e| {
        step(&e.down)
    });
    row("overshoot, the larger of these", "1 %", &|e| {
        format!("{:.2} %", 1e2 * e.up.overshoot.max(e.down.overshoot))
    });
    row("creep from 1 s to 30 s", "0.2 %", &|e| {
        format!("{:.2} %", 1e2 * e.creep)
    });
    for (i, (hz, must)) in LOOPS.into_iter().enumerate() {
        let what = format!("loop at {hz} Hz (ideal-controller bound where it cannot cool)");
        row(&what, &format!("{must} um"), &|e| {
            let width = &e.loops[i];
            let ideal = width.cooling.map_or(String::new(), |cooling| {
                format!(" ({:.2})", cooling.ideal_um)
            });
            format!("{:.2} um{ideal}", width.width_um)
        });
    }
    row("20 Hz triangle of 40 um, rms error", "0.15 um", &|e| {
        format!("{:.2} um", e.triangle_um)
    });
}
