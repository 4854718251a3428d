//! Before and after in one picture: error at rest, a step, the errors along two sines, and along a triangle.

use plotters::prelude::*;

use super::trial::Trial;
use crate::error::ToolError;
use crate::picture::{ERROR, INK, MEASURED, panel};

const SIZE: (u32, u32) = (1200, 640);
/// A step is shown so long.
const STEP_S: f64 = 0.6;

/// The picture: two rows, before above and after below.
pub(super) fn before_and_after(before: &Trial, after: &Trial) -> Result<String, ToolError> {
    let mut svg = String::new();
    draw(&mut svg, before, after).map_err(|error| ToolError::Picture {
        reason: error.to_string(),
    })?;
    Ok(svg)
}

fn draw(svg: &mut String, before: &Trial, after: &Trial) -> Result<(), Box<dyn std::error::Error>> {
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let panels = area.split_evenly((2, 4));
    for (row, (when, trial)) in [("before", before), ("after", after)]
        .into_iter()
        .enumerate()
    {
        let mut rest: Vec<_> = trial
            .rest
            .iter()
            .map(|(asked, reached)| (*asked, reached - asked))
            .collect();
        rest.sort_by(|a, b| a.0.total_cmp(&b.0));
        panel(
            &panels[4 * row],
            &format!("error at rest, {when}"),
            ("asked (um)", "error (um)"),
            &[],
            &[(&rest, ERROR)],
        )?;
        let step: Vec<_> = trial
            .step
            .iter()
            .filter(|(t, _)| *t < STEP_S)
            .map(|(t, z)| (1e3 * t, *z))
            .collect();
        let target = [(0.0, trial.step_um.1), (1e3 * STEP_S, trial.step_um.1)];
        panel(
            &panels[4 * row + 1],
            &format!("a step, {when}"),
            ("time (ms)", "z (um)"),
            &[(&target, INK), (&step, MEASURED)],
            &[],
        )?;
        let error = |pairs: &[(f64, f64)]| -> Vec<_> {
            let left = |(asked, reached): &(f64, f64)| (*asked, reached - asked);
            pairs.iter().map(left).collect()
        };
        panel(
            &panels[4 * row + 2],
            &format!("error along 1 and 20 Hz, {when}"),
            ("asked (um)", "error (um)"),
            &[
                (&error(&trial.curve), ERROR),
                (&error(&trial.slow_loop), MEASURED),
            ],
            &[],
        )?;
        panel(
            &panels[4 * row + 3],
            &format!("error along a 20 Hz triangle, {when}"),
            ("asked (um)", "error (um)"),
            &[(&error(&trial.triangle), ERROR)],
            &[],
        )?;
    }
    area.present()?;
    drop(panels);
    drop(area);
    Ok(())
}
