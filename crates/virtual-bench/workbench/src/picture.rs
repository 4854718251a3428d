//! The README's picture: where the mirror goes when it is asked for a position.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use charts::{Look, Panel, Series, sheet};

/// Where the mirror went when it was asked for a position.
pub(crate) struct Reached {
    pub(crate) asked_um: f64,
    pub(crate) error_um: f64,
}

/// Draws asked against reached, and the error beside it.
pub(crate) fn draw(path: &Path, points: &[Reached]) -> Result<()> {
    let series = |name: &str, look, um: fn(&Reached) -> f64| Series {
        name: name.into(),
        look,
        points: points
            .iter()
            .map(|point| (point.asked_um, um(point)))
            .collect(),
    };
    let panel = |title: &str, y: &str, series| Panel {
        title: title.into(),
        x: "asked (µm)".into(),
        y: y.into(),
        series,
    };
    let positions = panel(
        "set-z on the emulated board, factory table",
        "z (µm)",
        vec![
            series("asked", Look::Model, |point| point.asked_um),
            series("reached", Look::Measured, |point| {
                point.asked_um + point.error_um
            }),
        ],
    );
    let errors = panel(
        "what is left",
        "error (µm)",
        vec![series("reached less asked", Look::Residual, |point| {
            point.error_um
        })],
    );
    fs::create_dir_all(path.parent().context("the picture has no directory")?)?;
    Ok(fs::write(path, sheet(&[vec![positions, errors]]))?)
}
