//! The README's picture: where the mirror goes when it is asked for a position.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, anyhow};
use host_tool::picture::{ERROR, INK, MEASURED, panel};
use plotters::prelude::*;

const SIZE: (u32, u32) = (760, 420);
const UPPER_HEIGHT: u32 = 240;

/// Where the mirror went when it was asked for a position.
pub(crate) struct Reached {
    pub(crate) asked_um: f64,
    pub(crate) error_um: f64,
}

/// Draws asked against reached, and the error below.
pub(crate) fn draw(path: &Path, points: &[Reached]) -> Result<()> {
    fs::create_dir_all(path.parent().context("the picture has no directory")?)?;
    let area = SVGBackend::new(path, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let (upper, lower) = area.split_vertically(UPPER_HEIGHT);

    let asked: Vec<_> = points
        .iter()
        .map(|point| (point.asked_um, point.asked_um))
        .collect();
    let reached: Vec<_> = points
        .iter()
        .map(|point| (point.asked_um, point.asked_um + point.error_um))
        .collect();
    let error: Vec<_> = points
        .iter()
        .map(|point| (point.asked_um, point.error_um))
        .collect();
    let zero: Vec<_> = points.iter().map(|point| (point.asked_um, 0.0)).collect();

    let title = "set-z on the emulated board, factory table";
    let names = ("asked (um)", "reached (um)");
    panel(
        &upper,
        title,
        names,
        &[(&asked, INK)],
        &[(&reached, MEASURED)],
    )
    .and_then(|()| {
        let names = ("asked (um)", "error (um)");
        panel(
            &lower,
            "reached less asked",
            names,
            &[(&zero, INK), (&error, ERROR)],
            &[],
        )
    })
    .map_err(|error| anyhow!("{error}"))?;
    area.present()?;
    Ok(())
}
