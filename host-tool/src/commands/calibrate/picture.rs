//! Before and after in one picture: error at rest, a step, the errors along two sines, and along a triangle.

use calibration_procedure::{Point, Series, Trial};
use plotters::prelude::*;

use crate::error::ToolError;
use crate::picture::{Area, Curve, ERROR, INK, MEASURED, panel};

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
        let of_row = &panels[4 * row..];
        let error = |area: &Area, what: &str, lines: &[Curve], points: &[Curve]| {
            panel(
                area,
                &format!("{what}, {when}"),
                ("asked (um)", "error (um)"),
                lines,
                points,
            )
        };
        let mut rest = errors(&trial.rest);
        rest.sort_by(|a, b| a.0.total_cmp(&b.0));
        error(&of_row[0], "error at rest", &[], &[(&rest, ERROR)])?;
        let shown = trial.step.points.iter().filter(|point| point.t_s < STEP_S);
        let ms = |point: &Point, um: f64| (1e3 * point.t_s, um);
        let asked: Vec<_> = shown
            .clone()
            .map(|point| ms(point, point.asked_um))
            .collect();
        let reached: Vec<_> = shown.map(|point| ms(point, point.reached_um)).collect();
        panel(
            &of_row[1],
            &format!("a step, {when}"),
            ("time (ms)", "z (um)"),
            &[(&asked, INK), (&reached, MEASURED)],
            &[],
        )?;
        let (fast, slow) = (errors(&trial.fast_sine), errors(&trial.slow_sine));
        let both = [(fast.as_slice(), ERROR), (slow.as_slice(), MEASURED)];
        error(&of_row[2], "error along 1 and 20 Hz", &both, &[])?;
        let triangle = errors(&trial.triangle);
        let one = [(triangle.as_slice(), ERROR)];
        error(&of_row[3], "error along a 20 Hz triangle", &one, &[])?;
    }
    area.present()?;
    drop(panels);
    drop(area);
    Ok(())
}

/// Where the mirror was asked to be, and how far from it it was (um).
fn errors(series: &Series) -> Vec<(f64, f64)> {
    let error = |point: &Point| (point.asked_um, point.error_um());
    series.points.iter().map(error).collect()
}
