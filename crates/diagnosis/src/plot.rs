//! The picture of a comparison: for each experiment the measured and modelled displacement, and the residual below.

use crate::fit::predict;
use crate::plan::{Channel, Plan};
use mirror_model::{Model, Runaway};
use plotters::coord::Shift;
use plotters::prelude::*;
use std::ops::Range;
use thiserror::Error;

const PANEL: (u32, u32) = (420, 400);
const COLUMNS: usize = 4;
const MEASURED: RGBColor = RGBColor(40, 90, 160);
const MODELLED: RGBColor = RGBColor(210, 90, 30);
/// Experiments whose rows last so long are drawn against the drive, others against time.
const STEADY_S: f64 = 0.5;

/// Why no picture was drawn.
#[derive(Debug, Error)]
pub enum PlotError {
    /// The model has no finite answer.
    #[error(transparent)]
    Runaway(#[from] Runaway),
    /// There is nothing to draw.
    #[error("these files hold no displacement to draw")]
    Nothing,
    /// The drawing library gave up.
    #[error("the picture could not be drawn: {0}")]
    Drawing(String),
}

/// One experiment's displacement: where, measured, modelled.
struct Panel {
    title: String,
    axis: &'static str,
    rows: Vec<(f64, f64, f64)>,
}

/// An SVG picture of a model beside a session, as a file's text.
///
/// # Errors
/// See [`PlotError`].
pub fn svg(model: &Model, plan: &Plan) -> Result<String, PlotError> {
    let panels = panels(model, plan)?;
    if panels.is_empty() {
        return Err(PlotError::Nothing);
    }
    let columns = panels.len().min(COLUMNS);
    let size = (
        PANEL.0 * columns as u32,
        PANEL.1 * panels.len().div_ceil(columns) as u32,
    );
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        draw(&root, &panels, columns).map_err(|error| PlotError::Drawing(error.to_string()))?;
    }
    Ok(text)
}

fn panels(model: &Model, plan: &Plan) -> Result<Vec<Panel>, Runaway> {
    let predicted = predict(model, plan)?;
    let panel = |index: usize| {
        let all = plan.observations.iter().zip(&predicted);
        let chosen: Vec<_> = all
            .filter(|(o, _)| o.experiment == index && o.channel == Channel::Displacement)
            .collect();
        let steady = chosen
            .iter()
            .all(|(o, _)| plan.intervals[o.interval].duration_s >= STEADY_S);
        let drive = |o: &crate::plan::Observation| plan.drive(o).into_iter().fold(0.0, f64::max);
        let rows = chosen
            .iter()
            .map(|(o, p)| (if steady { drive(o) } else { o.t_s }, o.value, **p))
            .collect();
        Panel {
            title: plan.experiments[index].clone(),
            axis: if steady { "V" } else { "s" },
            rows,
        }
    };
    Ok((0..plan.experiments.len())
        .map(panel)
        .filter(|panel| !panel.rows.is_empty())
        .collect())
}

type Drawn = Result<(), Box<dyn std::error::Error>>;

fn draw(root: &DrawingArea<SVGBackend, Shift>, panels: &[Panel], columns: usize) -> Drawn {
    root.fill(&WHITE)?;
    let areas = root.split_evenly((panels.len().div_ceil(columns), columns));
    for (panel, area) in panels.iter().zip(&areas) {
        let (upper, lower) = area.split_vertically(PANEL.1 * 3 / 5);
        curves(&upper, panel)?;
        residual(&lower, panel)?;
    }
    root.present()?;
    Ok(())
}

fn curves(area: &DrawingArea<SVGBackend, Shift>, panel: &Panel) -> Drawn {
    let both = panel.rows.iter().flat_map(|row| [row.1, row.2]);
    let title = format!(
        "{}: z in um, measured (points) and modelled (line)",
        panel.title
    );
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 14))
        .margin(8)
        .x_label_area_size(20)
        .y_label_area_size(48)
        .build_cartesian_2d(range(panel.rows.iter().map(|row| row.0)), range(both))?;
    chart.configure_mesh().light_line_style(WHITE).draw()?;
    chart.draw_series(
        panel
            .rows
            .iter()
            .map(|row| Circle::new((row.0, row.1), 2, MEASURED.filled())),
    )?;
    chart.draw_series(LineSeries::new(
        panel.rows.iter().map(|row| (row.0, row.2)),
        &MODELLED,
    ))?;
    Ok(())
}

fn residual(area: &DrawingArea<SVGBackend, Shift>, panel: &Panel) -> Drawn {
    let left = panel.rows.iter().map(|row| (row.0, row.1 - row.2));
    let mut chart = ChartBuilder::on(area)
        .caption(
            format!("measured less modelled, um, against {}", panel.axis),
            ("sans-serif", 12),
        )
        .margin(8)
        .x_label_area_size(20)
        .y_label_area_size(48)
        .build_cartesian_2d(
            range(panel.rows.iter().map(|row| row.0)),
            range(left.clone().map(|row| row.1).chain([0.0])),
        )?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .y_labels(5)
        .draw()?;
    chart.draw_series(left.map(|point| Circle::new(point, 2, MODELLED.filled())))?;
    Ok(())
}

/// All values with a little room; never empty, even if all are the same.
fn range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    let room = 0.05 * (high - low).max(1e-6);
    low - room..high + room
}

#[cfg(test)]
mod tests {
    use super::*;
    use measurement::{MeasurementFile, Session};
    use mirror_model::Preset;

    fn plan(text: &str) -> Plan {
        Plan::new(&Session {
            files: vec![(
                "a.csv".into(),
                MeasurementFile::parse("a.csv", text).unwrap(),
            )],
        })
    }

    #[test]
    fn a_picture_has_the_points_and_the_line() {
        let picture = svg(
            &Preset::Paper.into(),
            &plan("t_s,V_V,z_um\n1,0,0\n2,1,26\n3,2,90\n"),
        )
        .unwrap();
        assert!(
            picture.starts_with("<svg")
                && picture.contains("<circle")
                && picture.contains("<polyline")
        );
    }

    #[test]
    fn without_a_displacement_there_is_nothing_to_draw() {
        let currents = plan("t_s,V_V,I_A\n1,0,0\n2,1,2.6e-3\n");
        assert!(matches!(
            svg(&Preset::Paper.into(), &currents),
            Err(PlotError::Nothing)
        ));
    }
}
