//! What positioning reaches on the paper's mirror, and on four that are drawn from families.

use std::thread;

use anyhow::{Context, Result};
use closed_loop::surroundings::{self, Around, Reached, calibrated_in_another_room};
use closed_loop::uncertainty::{Kept, Use, random_moves};
use closed_loop::{Precision, calibrate, figures, precision, usual_mirror};
use control_core::Calibration;
use virtual_mirror::{Family, MirrorConfig, PaperNumbers};

use crate::poses::Poses;

/// Loops are measured over the span that 1 V +- 0.5 V has without compensation, at these frequencies.
const LOOP_HZ: [f64; 4] = [0.1, 1.0, 20.0, 100.0];
const LOW_V: f64 = 0.5;
const HIGH_V: f64 = 1.5;
/// So long a random course tells how far f32 is from f64 (s).
const PRECISION_S: f64 = 120.0;

/// What was measured of one mirror.
struct Evidence {
    name: String,
    at_rest: figures::Static,
    steps: Vec<figures::Step>,
    creep: f64,
    loops: Vec<figures::Width>,
    triangle_um: f64,
    precision: Precision,
    rooms: Vec<Room>,
    moves: Kept,
    poses: Poses,
}

/// What is reached in other surroundings.
struct Room {
    around: Around,
    /// Largest error where the mirror is left to them, and where they are compensated (um).
    left_um: f64,
    compensated_um: f64,
    /// The same after what a room is worth was measured in another one.
    known_um: f64,
}

/// 10 to 40 degC around the 22 of a laboratory; and air that takes a fifth more or less of the heat.
const SURROUNDINGS: [Around; 6] = {
    const fn room(rise_k: f64) -> Around {
        Around { rise_k, air: 1.0 }
    }
    const fn air(air: f64) -> Around {
        Around { rise_k: 0.0, air }
    }
    [
        room(0.0),
        room(-12.0),
        room(9.0),
        room(18.0),
        air(1.2),
        air(0.8),
    ]
};

/// Mirrors of the families, with what the paper's has beyond them.
fn mirrors() -> Vec<MirrorConfig> {
    let drawn = [
        (Family::C, 741),
        (Family::E, 742),
        (Family::F, 743),
        (Family::G, 744),
    ];
    let drawn = drawn.map(|(family, seed)| usual_mirror(family, seed));
    [vec![MirrorConfig::paper()], drawn.to_vec()].concat()
}

/// Calibrates every mirror from what is measured of it, and prints what positioning reaches then.
pub(crate) fn run() -> Result<()> {
    let threads: Vec<_> = mirrors()
        .into_iter()
        .map(|config| thread::spawn(move || measure(&config)))
        .collect();
    let evidence: Vec<Evidence> = threads
        .into_iter()
        .map(|thread| thread.join().ok().context("a measurement panicked")?)
        .collect::<Result<_>>()?;
    let uncompensated = PaperNumbers::measure(&MirrorConfig::paper())?;
    print(&evidence, &uncompensated);
    Ok(())
}

fn measure(config: &MirrorConfig) -> Result<Evidence> {
    let mut calibration = calibrate(config)?.calibration;
    let mirror = &mut calibration;
    let top_um = f64::from(mirror.max_position().0).min(170.0);
    let pairs = [
        (10.0, 0.98 * top_um),
        (0.98 * top_um, 10.0),
        (20.0, 90.0),
        (90.0, 20.0),
        (60.0, 75.0),
        (75.0, 60.0),
    ];
    let span = span(mirror, config)?;
    let loops = LOOP_HZ
        .into_iter()
        .map(|hz| figures::loop_width(mirror, config, span, hz))
        .collect::<Result<_, _>>()?;
    Ok(Evidence {
        name: config.name.clone(),
        at_rest: figures::at_rest(mirror, config)?,
        steps: figures::steps(mirror, config, &pairs)?,
        creep: figures::creep(mirror, config, (20.0, 90.0))?,
        loops,
        triangle_um: figures::triangle(mirror, config, (40.0, 80.0), 20.0)?,
        precision: precision(mirror, config, PRECISION_S, config.seed)?,
        rooms: rooms(mirror, config)?,
        moves: Kept::of(&random_moves(
            mirror,
            config,
            Use {
                moves: 15,
                rooms: 8,
                seed: config.seed,
            },
        )?),
        poses: Poses::measure(config)?,
    })
}

fn rooms(calibration: &mut Calibration, config: &MirrorConfig) -> Result<Vec<Room>> {
    let mut known = calibrated_in_another_room(calibration, config)?;
    let mut measured = Vec::new();
    for around in SURROUNDINGS {
        measured.push(Room {
            around,
            left_um: worst_um(&surroundings::errors(calibration, config, around, false)?),
            compensated_um: worst_um(&surroundings::errors(calibration, config, around, true)?),
            known_um: worst_um(&surroundings::errors(&mut known, config, around, true)?),
        });
    }
    Ok(measured)
}

/// The largest error where the surroundings leave a position within reach (um).
fn worst_um(reached: &[Reached]) -> f64 {
    let within = reached.iter().filter(|reached| reached.is_within_reach());
    within.map(|it| it.error_um.abs()).fold(0.0, f64::max)
}

/// Where the mirror rests at the two voltages (um).
fn span(calibration: &Calibration, config: &MirrorConfig) -> Result<(f64, f64)> {
    let mut mirror = virtual_mirror::VirtualMirror::new(config)?;
    let mut rest = |volts| {
        mirror.advance([volts; 4], 10.0);
        mirror.state().z_um
    };
    let top_um = f64::from(calibration.max_position().0);
    Ok((rest(LOW_V), rest(HIGH_V).min(top_um)))
}

fn print(evidence: &[Evidence], uncompensated: &PaperNumbers) {
    let row = |what: &str, before: String, must: &str, value: &dyn Fn(&Evidence) -> String| {
        let values: Vec<String> = evidence.iter().map(value).collect();
        println!("| {what} | {before} | {} | {must} |", values.join(" | "));
    };
    let names: Vec<&str> = evidence.iter().map(|mirror| mirror.name.as_str()).collect();
    println!(
        "| figure | paper, uncompensated | {} | required |",
        names.join(" | ")
    );
    println!("|---|---|{}---|", "---|".repeat(names.len()));
    row("static error, rms", "-".into(), "0.05 um", &|e| {
        format!("{:.3} um", e.at_rest.rms_um)
    });
    row("static error, largest", "-".into(), "0.15 um", &|e| {
        format!("{:.3} um{}", e.at_rest.largest_um, e.at_rest.left_out())
    });
    for i in 0..evidence.first().map_or(0, |first| first.steps.len()) {
        let step = &evidence[0].steps[i];
        let what = format!("t95 {:.0} to {:.0} um (limit)", step.from_um, step.to_um);
        let before = format!("{:.0} ms for 2 V", uncompensated.t95_ms);
        row(&what, before, "15 ms, or the limit and 10 %", &|e| {
            let step = &e.steps[i];
            format!("{:.1} ms ({:.1})", 1e3 * step.t95_s, 1e3 * step.limit_s)
        });
    }
    row("overshoot, largest of these", "-".into(), "1 %", &|e| {
        let beyond = e.steps.iter().map(|step| step.overshoot);
        format!("{:.2} %", 1e2 * beyond.fold(0.0, f64::max))
    });
    row("creep from 1 s to 30 s", "-".into(), "0.2 %", &|e| {
        format!("{:.2} %", 1e2 * e.creep)
    });
    for (i, (hz, must)) in LOOP_HZ
        .into_iter()
        .zip(["0.1", "0.15", "0.25", "0.4"])
        .enumerate()
    {
        let before = format!("{:.1} um", uncompensated.loops[i].width_um);
        let must = format!("{must} um");
        let what = format!("loop at {hz} Hz (ideal-controller bound)");
        row(&what, before, &must, &|e| told(&e.loops[i]));
        if evidence.iter().any(|e| e.loops[i].cooling.is_some()) {
            let what = format!("loop at {hz} Hz over the part of it that can cool");
            row(&what, "-".into(), &must, &|e| within(&e.loops[i]));
        }
    }
    row(
        "20 Hz triangle of 40 um, rms error",
        "-".into(),
        "0.5 um",
        &|e| format!("{:.2} um", e.triangle_um),
    );
    for (i, around) in SURROUNDINGS.into_iter().enumerate() {
        let (what, must) = match around.air == 1.0 {
            true => (format!("room {:+} K", around.rise_k), "0.5 um"),
            false => (
                format!("air takes {:+.0} %", 1e2 * (around.air - 1.0)),
                "0.3 um",
            ),
        };
        let what = format!("{what}: largest error left to it / compensated / ratio measured");
        row(&what, "-".into(), must, &|e| {
            let room = &e.rooms[i];
            debug_assert_eq!(room.around, around);
            format!(
                "{:.2} / {:.2} / {:.2} um",
                room.left_um, room.compensated_um, room.known_um
            )
        });
    }
    row(
        "random moves in eight rooms: within their interval / interval by error / settled too early",
        "-".into(),
        "95 +- 2 % / 2 / 1 %",
        &|e| {
            let by_error = e.moves.interval_rms_um / e.moves.error_rms_um;
            let (covered, early) = (1e2 * e.moves.covered, 1e2 * e.moves.too_early);
            format!("{covered:.0} % / {by_error:.1} / {early:.0} %")
        },
    );
    row(
        "tilt of a level plate from 0 to 170 um, peak to peak: by its piston / by poses",
        "-".into(),
        "0.005 deg",
        &|e| e.poses.at_rest(),
    );
    row(
        "the same along a sine of 20 Hz from 60 to 100 um",
        "-".into(),
        "0.02 deg",
        &|e| e.poses.along_a_sine(),
    );
    row(
        "random poses: tilts and piston, rms",
        "-".into(),
        "0.005 deg, 0.05 um",
        &|e| e.poses.errors(),
    );
    row(
        "f32 core against f64 (single ticks' drives)",
        "-".into(),
        "5 nm",
        &|e| {
            let Precision {
                mirror_um,
                drive_um,
            } = e.precision;
            format!("{:.1} nm ({:.1})", 1e3 * mirror_um, 1e3 * drive_um)
        },
    );
}

/// A loop's width, and what opened it; where the mirror cannot cool as fast, what one leaves who knows it.
fn told(width: &figures::Width) -> String {
    let names: Vec<_> = width.limits.iter().map(|limit| limit.name()).collect();
    let limited = if names.is_empty() {
        String::new()
    } else {
        format!(", {}", names.join(", "))
    };
    let ideal = width.cooling.map_or(String::new(), |cooling| {
        format!(" ({:.2})", cooling.ideal_um)
    });
    format!("{:.2} um{limited}{ideal}", width.width_um)
}

/// The loop over the part of the span where the mirror cools as fast as it is asked to.
fn within(width: &figures::Width) -> String {
    let (um, share) = width.cooling.map_or((width.width_um, 1.0), |cooling| {
        (cooling.width_um, cooling.share)
    });
    format!("{um:.2} um over {:.0} %", 1e2 * share)
}
