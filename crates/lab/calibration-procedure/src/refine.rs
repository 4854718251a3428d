//! From the identified mirror's tables to a calibration that is corrected by what the mirror does under it.

use calibration::{StaticPoint, corrected, refined};
use control_core::Calibration;
use experiments::Reading;
use experiments::calibration::{self as played, Effort, ON_ITS_WAY, POINTS, RANGE};
use measurement::Session;

use crate::bench::{Bench, Part};
use crate::trial::Series;

/// Corrections at rest, each under the tables of the one before: the second takes out what the first one's curve between
/// its points has left.
pub(crate) const ROUNDS: usize = 2;

/// The range of `calibration` that is used (um).
fn top_um(calibration: &Calibration) -> f64 {
    RANGE * f64::from(calibration.max_position().0)
}

/// Puts `calibration` on trial, moves the mirror all over its range under it, and refines it by what the mirror did. The
/// refined one is on trial then. With it comes what its stages leave of the displacement (um, root mean square).
pub(crate) async fn by_moves<B: Bench>(
    bench: &mut B,
    effort: &Effort,
    calibration: Calibration,
) -> Result<(Calibration, f64), B::Error> {
    bench.put_on_trial(&calibration).await?;
    let mut session = Session::default();
    for experiment in played::moves(effort, top_um(&calibration)) {
        let mut file = bench.measure(Part::Refining, &experiment).await?;
        if let Reading::Evenly { .. } = experiment.reading {
            // It begins with a jump from rest.
            let settled_s = file.rows.last().map_or(0.0, |row| row.t_s) * ON_ITS_WAY;
            let unsettled = file.rows.iter_mut().filter(|row| row.t_s < settled_s);
            unsettled.for_each(|row| row.z_um = None);
        }
        let name = format!("{}.csv", experiment.name);
        session.files.push((name, file));
    }
    let work = move || refined(&calibration, &session);
    let refined = bench.compute("refining", work).await??;
    bench.put_on_trial(&refined.calibration).await?;
    Ok((refined.calibration, refined.residual_rms_um))
}

/// Puts `calibration` on trial, and bends its tables by what the mirror reaches at rest under it. The corrected one is on
/// trial then.
pub(crate) async fn by_rests<B: Bench>(
    bench: &mut B,
    mut calibration: Calibration,
) -> Result<Calibration, B::Error> {
    bench.put_on_trial(&calibration).await?;
    for _ in 0..ROUNDS {
        let rests = played::rests(top_um(&calibration));
        let reached = Series::measure(bench, Part::Refining, &rests).await?;
        // Each position was reached from one side on the way there, and from the other on the way back.
        let (there, back) = reached.points.split_at(reached.points.len().min(POINTS));
        let points: Vec<StaticPoint> = there
            .iter()
            .zip(back.iter().rev())
            .map(|(there, back)| StaticPoint {
                asked_um: there.asked_um,
                reached_um: (there.reached_um + back.reached_um) / 2.0,
            })
            .collect();
        calibration = corrected(&calibration, &points)?;
        bench.put_on_trial(&calibration).await?;
    }
    Ok(calibration)
}
