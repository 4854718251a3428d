//! Poses that an instrument of two axes has read, as a table.

use std::path::Path;

use calibration::{PlatePose, PosePoint};

use crate::commands::measure::spots::possible;
use crate::error::{ToolError, UnusableInput};

/// Columns of a table: what was asked for, for how long, and what an instrument read.
const COLUMNS: [&str; 7] = [
    "asked_z_um",
    "asked_tilt_x_deg",
    "asked_tilt_y_deg",
    "held_s",
    "z_um",
    "tilt_x_deg",
    "tilt_y_deg",
];

/// A fit of so many poses takes ten seconds, and of twice as many four times as long.
const MOST_POSES: usize = 1000;

/// The poses of a table with these columns in any order, row after row. A row without a reading was held only.
pub(super) fn table(file: &Path) -> Result<Vec<PosePoint>, ToolError> {
    let text = input_file::read_text(file, input_file::MOST_MADE)?;
    let points = parsed(&text).and_then(|points| {
        let pistons = points
            .iter()
            .map(|point| [point.asked.z_um, point.reached.unwrap_or_default().z_um]);
        possible(&pistons.collect::<Vec<_>>()).map(|()| points)
    });
    points.map_err(|reason| {
        ToolError::from(UnusableInput::PoseTable {
            file: file.to_owned(),
            reason,
        })
    })
}

fn parsed(text: &str) -> Result<Vec<PosePoint>, String> {
    let is_content = |line: &&str| !line.trim().is_empty() && !line.starts_with('#');
    let mut lines = text.lines().filter(is_content);
    let header: Vec<&str> = lines
        .next()
        .unwrap_or_default()
        .split(',')
        .map(str::trim)
        .collect();
    let mut places = [0; COLUMNS.len()];
    for (place, name) in places.iter_mut().zip(COLUMNS) {
        let found = header.iter().position(|column| *column == name);
        *place = found.ok_or_else(|| format!("it has no column {name}"))?;
    }
    let mut points = Vec::new();
    for line in lines {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let number = |column: usize| -> Result<f64, String> {
            let cell = cells.get(places[column]).copied().unwrap_or_default();
            let number = cell.parse().ok().filter(|number: &f64| number.is_finite());
            number
                .ok_or_else(|| format!("`{cell}` in `{line}` is no number for {}", COLUMNS[column]))
        };
        let pose = |first: usize, second: usize, third: usize| {
            Ok::<_, String>(PlatePose {
                z_um: number(first)?,
                tilt_x_rad: number(second)?.to_radians(),
                tilt_y_rad: number(third)?.to_radians(),
            })
        };
        let is_read = (4..7).any(|column| {
            cells
                .get(places[column])
                .is_some_and(|cell| !cell.is_empty())
        });
        points.push(PosePoint {
            asked: pose(0, 1, 2)?,
            held_s: match number(3)? {
                s if s < 0.0 => return Err(format!("`{line}` was held for {s} s")),
                s => s,
            },
            reached: is_read.then(|| pose(4, 5, 6)).transpose()?,
            told_k: None,
        });
    }
    match points.len() > MOST_POSES {
        true => Err(format!(
            "it has {} poses; {MOST_POSES} are taken, evenly over range and tilts",
            points.len()
        )),
        false => Ok(points),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_its_columns_in_any_order() {
        let header =
            "held_s,asked_z_um,asked_tilt_x_deg,asked_tilt_y_deg,z_um,tilt_y_deg,tilt_x_deg";
        let points = parsed(&format!(
            "# an autocollimator\n{header}\n2,60,0,0.5,60.1,0.4,0.1\n1,20,0,0,,,\n"
        ));
        let points = points.expect("a table");
        assert_eq!(points.len(), 2);
        assert!((points[0].reached.expect("read").tilt_y_rad.to_degrees() - 0.4).abs() < 1e-12);
        assert_eq!(points[1].reached, None);
        for (text, said) in [
            ("asked_z_um\n1\n", "no column asked_tilt_x_deg"),
            (
                &format!("{header}\n2,60,0,x,60,0,0\n"),
                "no number for asked_tilt_y_deg",
            ),
            (
                &format!("{header}\n2,60,0,0,60,nan,0\n"),
                "no number for tilt_y_deg",
            ),
            (
                &format!("{header}\n-2,60,0,0,60,0,0\n"),
                "was held for -2 s",
            ),
            (
                &format!("{header}\n{}", "2,60,0,0,60,0,0\n".repeat(1001)),
                "it has 1001 poses",
            ),
        ] {
            let error = parsed(text).expect_err("no table");
            assert!(error.contains(said), "{error}");
        }
    }
}
