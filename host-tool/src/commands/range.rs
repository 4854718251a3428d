//! `range`: the poses that the mirror reaches under the calibration in use.

use std::f64::consts::TAU;
use std::fmt;
use std::path::PathBuf;

use calibration::Reach;
use plotters::prelude::*;
use serde::Serialize;

use super::pose::reach;
use crate::board::Board;
use crate::error::ToolError;
use crate::new_file::NewFile;
use crate::picture::{INK, MEASURED, panel};
use crate::report::{self, decimal};

/// Tilts that are told, besides none, as parts of the largest.
const TILTS: u32 = 8;
/// Pistons along a curve of the picture, and directions along an outline.
const POINTS: u32 = 120;
/// Outlines are drawn at these parts of the range.
const OUTLINES: [f64; 3] = [0.1, 0.25, 0.5];
const SIZE: (u32, u32) = (1200, 400);

#[derive(Serialize)]
struct Range {
    max_position_um: f64,
    /// `None` where the calibration does not know the plate's levers.
    tilts: Option<Vec<Tilt>>,
    picture: Option<PathBuf>,
}

/// From which piston to which a tilt is reached.
#[derive(Serialize)]
struct Tilt {
    tilt_deg: f64,
    /// Where it is about the x axis.
    about_x_um: Option<(f64, f64)>,
    /// Where it is about the y axis.
    about_y_um: Option<(f64, f64)>,
}

pub(super) async fn run(
    board: &Board,
    picture: Option<PathBuf>,
    force: bool,
    json: bool,
) -> Result<(), ToolError> {
    let calibration = board.calibration().await?;
    let reach = reach(&calibration);
    let top_um = decimal(calibration.max_position_um);
    if picture.is_some() && !reach.knows_tilts() {
        return Err(ToolError::LeversUnknown);
    }
    let file = picture.map(|path| NewFile::picture(path, force));
    let file = file.transpose()?;
    let mut range = Range {
        max_position_um: top_um,
        tilts: reach.knows_tilts().then(|| tilts(&reach, top_um)),
        picture: None,
    };
    if let Some(file) = file {
        let svg = draw(&reach, top_um).map_err(|error| ToolError::Picture {
            reason: error.to_string(),
        })?;
        range.picture = Some(file.write(&svg)?);
    }
    report::print(&range, json);
    Ok(())
}

fn tilts(reach: &Reach, top_um: f64) -> Vec<Tilt> {
    let middle = |direction| reach.largest_tilt_rad(0.5 * top_um, direction);
    let most_rad = middle((1.0, 0.0)).max(middle((0.0, 1.0)));
    let tilt = |step: u32| {
        let rad = most_rad * f64::from(step) / f64::from(TILTS);
        let either = |reached: Option<(f64, f64)>, other: Option<(f64, f64)>| {
            // That of both directions of a plate whose levers are uneven.
            let ((a, b), (c, d)) = (reached?, other?);
            (a.max(c) <= b.min(d)).then_some((a.max(c), b.min(d)))
        };
        Tilt {
            tilt_deg: rad.to_degrees(),
            about_x_um: either(reach.pistons_um(rad, 0.0), reach.pistons_um(-rad, 0.0)),
            about_y_um: either(reach.pistons_um(0.0, rad), reach.pistons_um(0.0, -rad)),
        }
    };
    (0..=TILTS).map(tilt).collect()
}

fn draw(reach: &Reach, top_um: f64) -> Result<String, Box<dyn std::error::Error>> {
    let mut svg = String::new();
    let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let panels = area.split_evenly((1, 3));
    for (place, (about, direction)) in [("x", (1.0, 0.0)), ("y", (0.0, 1.0))]
        .into_iter()
        .enumerate()
    {
        let side = |sign: f64| -> Vec<(f64, f64)> {
            let at = |step: u32| {
                let z_um = top_um * f64::from(step) / f64::from(POINTS);
                let rad = reach.largest_tilt_rad(z_um, (sign * direction.0, sign * direction.1));
                (z_um, sign * rad.to_degrees())
            };
            (0..=POINTS).map(at).collect()
        };
        let (up, down) = (side(1.0), side(-1.0));
        panel(
            &panels[place],
            &format!("largest tilts about {about}"),
            ("z (um)", "tilt (deg)"),
            &[(&up, MEASURED), (&down, MEASURED)],
            &[],
        )?;
    }
    let outlines = OUTLINES.map(|part| {
        let at = |step: u32| {
            let (sine, cosine) = (TAU * f64::from(step) / f64::from(POINTS)).sin_cos();
            let deg = reach
                .largest_tilt_rad(part * top_um, (cosine, sine))
                .to_degrees();
            (deg * cosine, deg * sine)
        };
        (0..=POINTS).map(at).collect::<Vec<_>>()
    });
    let lines = [
        (outlines[0].as_slice(), INK),
        (outlines[1].as_slice(), INK),
        (outlines[2].as_slice(), MEASURED),
    ];
    let heights = OUTLINES
        .map(|part| format!("{:.0}", part * top_um))
        .join(", ");
    panel(
        &panels[2],
        &format!("largest tilts at {heights} um"),
        ("about x (deg)", "about y (deg)"),
        &lines,
        &[],
    )?;
    area.present()?;
    drop(panels);
    drop(area);
    Ok(svg)
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "piston     0 to {:.1} um", self.max_position_um)?;
        let Some(tilts) = &self.tilts else {
            return writeln!(
                f,
                "tilts      unknown: the calibration in use does not know the plate's levers"
            );
        };
        writeln!(f, "{:<13}{:>19}   {:>19}", "tilt", "about x", "about y")?;
        let reached = |pistons: Option<(f64, f64)>| match pistons {
            Some((low, high)) => format!("{low:>6.1} to {high:>6.1} um"),
            None => format!("{:>19}", "-"),
        };
        for tilt in tilts {
            writeln!(
                f,
                "{:>8.3} deg {}   {}",
                tilt.tilt_deg,
                reached(tilt.about_x_um),
                reached(tilt.about_y_um)
            )?;
        }
        match &self.picture {
            Some(picture) => writeln!(f, "drawn      in {}", picture.display()),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use control_core::Micrometre;
    use control_core::calibration::Plate;

    #[test]
    fn is_printed_as_in_the_golden_file() {
        let top_um = 170.0;
        let reach = Reach::new(Plate::cross(Micrometre(480.0)), top_um);
        let range = Range {
            max_position_um: top_um,
            tilts: Some(tilts(&reach, top_um)),
            picture: None,
        };
        assert_eq!(
            range.to_string(),
            include_str!("../../tests/golden/range.txt")
        );
        let svg = draw(&reach, top_um).expect("a picture");
        assert!(svg.contains("largest tilts about y"), "{svg}");
    }
}
