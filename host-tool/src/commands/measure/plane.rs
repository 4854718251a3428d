//! `measure plane`: the tilt of the plate from a scan of points over it, the paper's second procedure.

use std::fmt;
use std::fs;
use std::path::Path;

use diagnosis::Plane;
use serde::Serialize;

use crate::error::ToolError;
use crate::report;

#[derive(Serialize)]
struct Report {
    points: usize,
    #[serde(flatten)]
    plane: Plane,
}

/// Reads a scan and prints the plane through it.
pub(crate) fn run(path: &Path, json: bool) -> Result<(), ToolError> {
    let text = fs::read_to_string(path).map_err(|source| ToolError::Read {
        path: path.to_owned(),
        source,
    })?;
    let unusable = |reason: String| ToolError::Scan {
        path: path.to_owned(),
        reason,
    };
    let points = parse(&text).map_err(unusable)?;
    let plane = Plane::through(&points).ok_or_else(|| {
        unusable(format!(
            "its {} points span no plane; scan a square, such as 5 by 5 points over 100 um",
            points.len()
        ))
    })?;
    let report = Report {
        points: points.len(),
        plane,
    };
    report::print(&report, json);
    Ok(())
}

/// Lines of x, y and z. Comments and a header are passed over.
fn parse(text: &str) -> Result<Vec<[f64; 3]>, String> {
    let mut points = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let is_header = points.is_empty() && line.starts_with(|c: char| c.is_ascii_alphabetic());
        if line.trim().is_empty() || line.starts_with('#') || is_header {
            continue;
        }
        let numbers: Vec<f64> = line
            .split(',')
            .map_while(|cell| cell.trim().parse().ok())
            .filter(|value: &f64| value.is_finite())
            .collect();
        match (<[f64; 3]>::try_from(numbers), line.split(',').count()) {
            (Ok(point), 3) => points.push(point),
            _ => return Err(format!("line {number}, `{line}`, is not three numbers")),
        }
    }
    Ok(points)
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Plane {
            tilt_x_deg,
            tilt_y_deg,
            z_um,
            rms_um,
        } = self.plane;
        writeln!(
            f,
            "tilt       {tilt_x_deg:+.4} deg about x, {tilt_y_deg:+.4} deg about y"
        )?;
        writeln!(
            f,
            "height     {z_um:.3} um, {} points {rms_um:.3} um rms off the plane",
            self.points
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_that_are_no_points_are_told() {
        for bad in ["1,2", "1,2,x", "1,2,nan", "1,2,3,4"] {
            let said = parse(&format!("x_um,y_um,z_um\n0,0,1\n{bad}\n")).expect_err("unusable");
            assert!(said.starts_with("line 3"), "{said}");
        }
        assert_eq!(parse("# a scan\nx,y,z\n1,2,3\n"), Ok(vec![[1.0, 2.0, 3.0]]));
    }
}
