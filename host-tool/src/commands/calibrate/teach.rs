//! From the identified mirror's tables to a calibration that was corrected by what the mirror did under it.

use calibration::{JUMP_S, StaticPoint, corrected, jumps, refined};
use control_core::Calibration;
use measurement::Session;
use mirror_protocol::{CalibrationUse, Quantity, Shape, Waveform};

use super::effort::Effort;
use super::trial::{complete, z_of};
use crate::board::Board;
use crate::commands::measure::experiment::{Experiment, Reading};
use crate::commands::measure::run::Lab;
use crate::error::ToolError;
use crate::quantity::Span;
use crate::report::decimal;

/// Positions that the tables are corrected at, evenly over the range.
const POINTS: usize = 33;
/// From one of them to the next that is measured: the way jumps about as in use, where what the mirror remembers of the
/// way does not always point to the same side.
const JUMP: usize = 14;
/// A position is held so long before it is read.
const DWELL: Span = Span { s: 2.0 };
/// Corrections, each under the tables of the one before.
pub(super) const ROUNDS: usize = 2;
/// Sines of positions (Hz), for what jumps do not tell: heat and friction while the mirror keeps moving; their middle and
/// amplitude as shares of the range, their cycles, the share of these in which the mirror is still on its way there, and
/// their readings.
const SINES_HZ: [f64; 4] = [1.0, 5.0, 20.0, 100.0];
const SINE: (f64, f64) = (0.25, 0.12);
const SINE_CYCLES: u32 = 6;
const ON_ITS_WAY: f64 = 1.0 / 3.0;
const SINE_SAMPLES: u32 = 600;
/// The range that is used of what the highest drive reaches: up there nothing is left to correct with.
pub(super) const RANGE: f64 = 0.99;

/// The range of `calibration` that is used (um).
fn top(calibration: &Calibration) -> f64 {
    RANGE * decimal(calibration.max_position().0)
}

/// What refines a calibration that reaches up to `top_um`, read at every tick: jumps all over the range, and sines.
pub(super) fn moves(
    effort: &Effort,
    top_um: f64,
    tick_hz: u32,
) -> Result<Vec<Experiment>, ToolError> {
    let shares = jumps().into_iter().take(effort.jumps);
    let positions: Vec<f64> = shares.map(|share| share * top_um).collect();
    let jumps = Experiment::moves("moves", &positions, Span { s: JUMP_S }, tick_hz)?;
    let sines = SINES_HZ.map(|hz| sine(hz, top_um, tick_hz));
    Ok([jumps.after(effort.jumps_after_s)]
        .into_iter()
        .chain(sines)
        .collect())
}

/// What corrects the tables of a calibration that reaches up to `top_um`, read at rest. There and back: every position is
/// reached once from below and once from above.
pub(super) fn rests(top_um: f64, tick_hz: u32) -> Result<Experiment, ToolError> {
    let asked = there_and_back(top_um);
    Ok(Experiment::positions("correcting", &asked, DWELL, tick_hz)?.after(10.0))
}

/// Tries `calibration` on the board, moves the mirror all over its range under it, and refines it by what the mirror did.
/// The refined one is on trial then. With it comes what its stages leave of the displacement (um, root mean square).
pub(super) async fn refine(
    lab: &mut Lab<'_>,
    board: &Board,
    effort: &Effort,
    calibration: Calibration,
) -> Result<(Calibration, f64), ToolError> {
    let on_trial = CalibrationUse::OnTrial;
    board.use_calibration(&calibration, on_trial).await?;
    let mut session = Session::default();
    for experiment in moves(effort, top(&calibration), lab.tick_hz())? {
        let mut file = complete(lab.measure(&experiment).await)?;
        if let Reading::Curve = experiment.reading {
            // It begins with a jump from rest.
            let settled_s = file.rows.last().map_or(0.0, |row| row.t_s) * ON_ITS_WAY;
            let unsettled = file.rows.iter_mut().filter(|row| row.t_s < settled_s);
            unsettled.for_each(|row| row.z_um = None);
        }
        session
            .files
            .push((format!("{}.csv", experiment.name), file));
    }
    let work = move || refined(&calibration, &session);
    let refined = lab.aside("refining", work).await??;
    board
        .use_calibration(&refined.calibration, on_trial)
        .await?;
    Ok((refined.calibration, refined.residual_rms_um))
}

/// A sine of positions in the lower half of the range.
fn sine(frequency_hz: f64, top_um: f64, tick_hz: u32) -> Experiment {
    let waveform = Waveform {
        quantity: Quantity::Position,
        shape: Shape::Sine {
            frequency_hz: frequency_hz as f32,
        },
        offset: (SINE.0 * top_um) as f32,
        amplitude: (SINE.1 * top_um) as f32,
        cycles: SINE_CYCLES,
        ends_off: true,
    };
    let name = format!("moves_{frequency_hz}");
    Experiment::positions_along(&name, waveform, Vec::new(), SINE_SAMPLES, tick_hz)
        .along_a_position()
        .after(2.0)
}

/// Tries `calibration` on the board, and bends its tables by what the board reaches at rest under it. The corrected one is
/// on trial then.
pub(super) async fn correct(
    lab: &mut Lab<'_>,
    board: &Board,
    mut calibration: Calibration,
) -> Result<Calibration, ToolError> {
    let on_trial = CalibrationUse::OnTrial;
    board.use_calibration(&calibration, on_trial).await?;
    for _ in 0..ROUNDS {
        let top_um = top(&calibration);
        let asked = there_and_back(top_um);
        let reached = z_of(lab, &rests(top_um, lab.tick_hz())?).await?;
        let z = |row: usize| reached[row].1;
        let points: Vec<StaticPoint> = (0..POINTS)
            .map(|step| StaticPoint {
                asked_um: asked[step],
                reached_um: (z(step) + z(2 * POINTS - 1 - step)) / 2.0,
            })
            .collect();
        calibration = corrected(&calibration, &points)?;
        board.use_calibration(&calibration, on_trial).await?;
    }
    Ok(calibration)
}

/// The positions of [`rests`] (um).
fn there_and_back(top_um: f64) -> Vec<f64> {
    let position = |point: usize| top_um * (point + 1) as f64 / POINTS as f64;
    let way: Vec<usize> = (0..POINTS).map(|step| step * JUMP % POINTS).collect();
    let back = way.iter().rev();
    way.iter()
        .chain(back)
        .map(|&point| position(point))
        .collect()
}
