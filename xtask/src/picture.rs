//! The README's picture: where the mirror goes when it is asked for a position.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use crate::bench::Reached;

const SIZE: (u32, u32) = (760, 420);
const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
const REACHED: RGBColor = RGBColor(0x1f, 0x77, 0xb4);
const ERROR: RGBColor = RGBColor(0xd6, 0x27, 0x28);

/// Draws asked against reached, and the error below.
pub(crate) fn draw(path: &Path, points: &[Reached]) -> Result<()> {
    if let Some(directory) = path.parent() {
        fs::create_dir_all(directory)?;
    }
    let area = SVGBackend::new(path, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let (above, below) = area.split_vertically(250);
    let top_um = points.last().context("nothing was measured")?.asked_um;
    let range = 0.0..top_um * 1.02;

    let title = "set-z on the emulated board, factory table";
    let reached = |point: &Reached| point.asked_um + point.error_um;
    let (low, high) = (0.0, top_um * 1.1);
    panel(
        &above,
        title,
        "reached (um)",
        "",
        range.clone(),
        low..high,
        |chart| {
            let line = points.iter().map(|point| (point.asked_um, point.asked_um));
            chart.draw_series(LineSeries::new(line, INK.mix(0.3)))?;
            let dots = points
                .iter()
                .map(|point| Circle::new((point.asked_um, reached(point)), 4, REACHED.filled()));
            chart.draw_series(dots)?;
            Ok(())
        },
    )?;

    let largest = points
        .iter()
        .map(|point| point.error_um.abs())
        .fold(0.1, f64::max)
        * 1.2;
    panel(
        &below,
        "",
        "error (um)",
        "asked (um)",
        range,
        -largest..largest,
        |chart| {
            chart.draw_series(LineSeries::new([(0.0, 0.0), (top_um, 0.0)], INK.mix(0.3)))?;
            let line = points.iter().map(|point| (point.asked_um, point.error_um));
            chart.draw_series(LineSeries::new(line, ERROR.stroke_width(2)))?;
            Ok(())
        },
    )?;
    area.present()?;
    Ok(())
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn panel<'b>(
    area: &Area<'b>,
    title: &str,
    y_name: &str,
    x_name: &str,
    x: std::ops::Range<f64>,
    y: std::ops::Range<f64>,
    fill: impl FnOnce(&mut Chart<'_, 'b>) -> Result<()>,
) -> Result<()> {
    let mut builder = ChartBuilder::on(area);
    builder
        .margin(12)
        .x_label_area_size(34)
        .y_label_area_size(58);
    if !title.is_empty() {
        builder.caption(title, ("sans-serif", 18, &INK));
    }
    let mut chart = builder.build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(INK.mix(0.12))
        .axis_style(INK)
        .x_desc(x_name)
        .y_desc(y_name)
        .y_labels(6)
        .draw()?;
    fill(&mut chart)
}
