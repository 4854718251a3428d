//! `range`: the poses that the mirror reaches under the calibration in use.

use std::f64::consts::TAU;
use std::fmt;
use std::path::PathBuf;

use calibration::Reach;
use charts::{Look, Panel, Series, sheet};
use serde::Serialize;

use super::pose::{from_um, reach};
use super::room::{self, Room};
use crate::board::View;
use crate::error::{BeyondBoard, ToolError};
use crate::new_file::NewFile;
use crate::report;

/// Tilts that are told, besides none, as parts of the largest.
const TILTS: u32 = 8;
/// Pistons along a curve of the picture, and directions along an outline.
const POINTS: u32 = 120;
/// Ends that the room leaves less certain than this are told to be (um): a position may be so far off in any room (docs/requirements.md).
const TOLD_UM: f64 = 0.5;
/// Outlines are drawn at these parts of the range.
const OUTLINES: [f64; 3] = [0.1, 0.25, 0.5];

#[derive(Serialize)]
struct Range {
    /// Where the mirror rests in its present surroundings: a heater cannot cool.
    lowest_position_um: f64,
    max_position_um: f64,
    /// `None` where the calibration cannot tell.
    room: Option<Room>,
    /// How far both may be from there for what is not known of the room, a standard deviation; `None` where it is not compensated.
    ends_deviation_um: Option<f64>,
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
    board: &View,
    picture: Option<PathBuf>,
    force: bool,
    json: bool,
) -> Result<(), ToolError> {
    let status = board.status().await?;
    let reach = reach(board, &status).await?;
    let file = picture.map(|path| NewFile::picture(path, force));
    let file = file.transpose()?;
    if file.is_some() && !reach.knows_tilts() {
        return Err(BeyondBoard::NoTiltsToDraw.into());
    }
    let mut range = Range::of(&reach, Room::of(&status));
    if let Some(file) = file {
        range.picture = Some(file.write(&draw(&reach))?);
    }
    report::print(&range, json);
    Ok(())
}

impl Range {
    fn of(reach: &Reach, room: Option<Room>) -> Self {
        let (lowest_position_um, max_position_um) = reach.level_um();
        Self {
            lowest_position_um,
            max_position_um,
            room,
            ends_deviation_um: reach.ends_deviation_um(),
            tilts: reach.knows_tilts().then(|| tilts(reach)),
            picture: None,
        }
    }
}

fn tilts(reach: &Reach) -> Vec<Tilt> {
    let (low_um, top_um) = reach.level_um();
    let middle = |direction| reach.largest_tilt_rad(0.5 * (low_um + top_um), direction);
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

fn draw(reach: &Reach) -> String {
    let (low_um, top_um) = reach.level_um();
    let place_um = |part: f64| low_um + part * (top_um - low_um);
    let of_direction = |about: &str, direction: (f64, f64)| {
        let side = |sign: f64| -> Vec<(f64, f64)> {
            let at = |step: u32| {
                let z_um = place_um(f64::from(step) / f64::from(POINTS));
                let rad = reach.largest_tilt_rad(z_um, (sign * direction.0, sign * direction.1));
                (z_um, sign * rad.to_degrees())
            };
            (0..=POINTS).map(at).collect()
        };
        Panel {
            title: format!("largest tilts about {about}"),
            x: "z (µm)".into(),
            y: format!("tilt about {about} (°)"),
            series: vec![
                line(0, "one way".into(), side(1.0)),
                line(1, "the other".into(), side(-1.0)),
            ],
        }
    };
    let outline = |(number, part): (usize, f64)| {
        let at = |step: u32| {
            let (sine, cosine) = (TAU * f64::from(step) / f64::from(POINTS)).sin_cos();
            let rad = reach.largest_tilt_rad(place_um(part), (cosine, sine));
            (rad.to_degrees() * cosine, rad.to_degrees() * sine)
        };
        let name = format!("at {:.0} µm", place_um(part));
        line(number, name, (0..=POINTS).map(at).collect())
    };
    let outlines = Panel {
        title: "largest tilts in all directions".into(),
        x: "tilt about x (°)".into(),
        y: "tilt about y (°)".into(),
        series: OUTLINES.into_iter().enumerate().map(outline).collect(),
    };
    sheet(&[
        vec![of_direction("x", (1.0, 0.0)), of_direction("y", (0.0, 1.0))],
        vec![outlines],
    ])
}

fn line(number: usize, name: String, points: Vec<(f64, f64)>) -> Series {
    Series {
        name,
        look: Look::Line(number),
        points,
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lowest = from_um(self.lowest_position_um);
        writeln!(f, "piston     {lowest} to {:.1} um", self.max_position_um)?;
        if self.lowest_position_um > 0.0 {
            writeln!(f, "room       {}", room::line(self.room.as_ref()))?;
        }
        let doubt_um = self.ends_deviation_um.filter(|um| *um > TOLD_UM);
        if let (Some(room), Some(um)) = (&self.room, doubt_um) {
            writeln!(
                f,
                "doubt      the room is not known to better than ± {:.1} K yet, so the ends are ± {um:.1} um",
                room.deviation_k()
            )?;
        }
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
    use crate::board::tests::status;
    use control_core::Micrometre;
    use control_core::calibration::Plate;
    use mirror_protocol::Telemetry;

    #[test]
    fn is_printed_as_in_the_golden_file() {
        let top_um = 170.0;
        let reach = Reach::new(Plate::cross(Micrometre(480.0)), top_um);
        assert_eq!(
            Range::of(&reach, None).to_string(),
            include_str!("../../tests/golden/range.txt")
        );
        let svg = draw(&reach);
        assert!(svg.contains("largest tilts about y"), "{svg}");
    }

    #[test]
    fn what_is_not_known_of_the_room_is_told_of_its_ends() {
        let mut status = status(Telemetry {
            room: Some(mirror_protocol::Room {
                rise_ck: 0,
                deviation_ck: 1500,
            }),
            ..Telemetry::default()
        });
        status.health.loss = Some(mirror_protocol::Loss {
            change: 0.0,
            deviation: 0.1,
        });
        let reach = Reach::new(Plate::cross(Micrometre(480.0)), 170.0);
        let told = |um: f64| {
            let mut range = Range::of(&reach, Room::of(&status));
            range.ends_deviation_um = Some(um);
            range.to_string()
        };
        let doubt = "doubt      the room is not known to better than ± 15.0 K yet, so the ends are ± 26.8 um\n";
        assert!(told(26.8).contains(doubt), "{}", told(26.8));
        assert!(!told(0.4).contains("doubt"), "{}", told(0.4));
    }

    #[test]
    fn in_a_warm_room_it_begins_where_the_mirror_rests() {
        let reach = Reach::new(Plate::cross(Micrometre(480.0)), 170.0).above(18.3);
        let told = Range::of(&reach, None).to_string();
        assert!(
            told.starts_with("piston     18.3 to 170.0 um\nroom "),
            "{told}"
        );
        assert!(told.contains("18.3 to  170.0 um"), "{told}");
    }
}
