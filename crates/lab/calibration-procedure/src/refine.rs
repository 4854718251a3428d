//! From the identified mirror's tables to a calibration that is corrected by what the mirror does under it.

use calibration::{RefineError, Refined, StaticPoint, corrected, refined};
use control_core::Calibration;
use experiments::Reading;
use experiments::calibration::{self as played, Effort, ON_ITS_WAY, RANGE};
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
/// refined one is on trial then, if there is one.
pub(crate) async fn by_moves<B: Bench>(
    bench: &mut B,
    effort: &Effort,
    calibration: Calibration,
) -> Result<Result<Refined, RefineError>, B::Error> {
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
    let refined = bench.compute("refining", work).await?;
    if let Ok(refined) = &refined {
        bench.put_on_trial(&refined.calibration).await?;
    }
    Ok(refined)
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
        calibration = corrected(&calibration, &there_and_back(&reached))?;
        bench.put_on_trial(&calibration).await?;
    }
    Ok(calibration)
}

/// The positions that were reached from one side on the way there and from the other on the way back, and the means of both.
/// One that was read on one way only shows its memory as well, and bears no weight.
fn there_and_back(reached: &Series) -> Vec<StaticPoint> {
    let mut points = reached.points.clone();
    points.sort_by(|a, b| a.asked_um.total_cmp(&b.asked_um));
    points
        .chunk_by(|a, b| a.asked_um == b.asked_um)
        .filter_map(|pair| match pair {
            [one, other] => Some(StaticPoint {
                asked_um: one.asked_um,
                reached_um: (one.reached_um + other.reached_um) / 2.0,
            }),
            _ => None,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::Point;

    /// A mirror that is 0.1 um short of everything from below and as much too far from above, and one reading that is missing:
    /// those after it keep their own positions.
    #[test]
    fn a_missing_reading_shifts_no_other() {
        let point = |asked_um: f64, off_um: f64| Point {
            t_s: 0.0,
            asked_um,
            reached_um: asked_um + off_um,
        };
        let ways = [10.0, 40.0, 20.0, 30.0];
        let there = ways.iter().map(|um| point(*um, -0.1));
        let back = ways.iter().rev().map(|um| point(*um, 0.1));
        let missing = 1;
        let points = there.chain(back).enumerate();
        let points = points
            .filter(|(index, _)| *index != missing)
            .map(|(_, point)| point);
        let corrected = there_and_back(&Series {
            points: points.collect(),
        });
        let asked: Vec<f64> = corrected.iter().map(|point| point.asked_um).collect();
        assert_eq!(asked, [10.0, 20.0, 30.0]);
        for point in corrected {
            assert!(
                (point.reached_um - point.asked_um).abs() < 1e-9,
                "{point:?}"
            );
        }
    }
}
