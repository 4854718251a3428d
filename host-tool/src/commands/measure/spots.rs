//! Where on a plate a sensor's spot goes: points of a file, or as they are typed.

use std::path::Path;

use measurement::Plane;
use quantities::Length;

use super::keyboard::Keyboard;
use super::readings::{LONGEST_UM, finite, is_possible};
use crate::error::{ToolError, UnusableInput};
use crate::verbosity::say;

/// A point on the plate, from its centre (um).
pub(crate) type Spot = [f64; 2];

/// The points of a scan.
pub(crate) struct Spots {
    known: Vec<Spot>,
    /// More come from the keyboard.
    open: bool,
}

impl Spots {
    /// Those of a file, or, without one, those that will be typed.
    pub(crate) fn new(path: Option<&Path>) -> Result<Self, ToolError> {
        let Some(path) = path else {
            return Ok(Self {
                known: Vec::new(),
                open: true,
            });
        };
        let text = input_file::read_text(path, input_file::MOST_MADE)?;
        let unusable = |reason: String| {
            ToolError::from(UnusableInput::Spots {
                path: path.to_owned(),
                reason,
            })
        };
        let known: Vec<Spot> = parse(&text).map_err(unusable)?;
        possible(&known).map_err(unusable)?;
        let flat: Vec<_> = known.iter().map(|&[x, y]| [x, y, 0.0]).collect();
        match Plane::through(&flat) {
            Some(_) => Ok(Self { known, open: false }),
            None => Err(unusable(format!(
                "its {} points span no plane",
                known.len()
            ))),
        }
    }

    /// The points that are known before any was typed.
    pub(crate) fn known(&self) -> &[Spot] {
        &self.known
    }

    /// Has the spot moved to the point `index`, and waits until it is there; `None` after the last one.
    pub(crate) async fn reach(
        &mut self,
        index: usize,
        keyboard: &mut Keyboard,
    ) -> Result<Option<Spot>, ToolError> {
        if let Some(&[x, y]) = self.known.get(index) {
            let (number, count) = (index + 1, self.known.len());
            let question = format!(
                "point {number} of {count}: move the spot to x {x} um, y {y} um, then Enter"
            );
            keyboard.ask(&question).await?;
            return Ok(Some([x, y]));
        }
        while self.open {
            let question = "where is the spot? x and y in um, such as -50 25; nothing when all points are read";
            let answer = keyboard.ask(question).await?;
            if answer.trim().is_empty() {
                // From now on they are the same at every voltage.
                self.open = false;
            } else if let Some(spot) = numbers(&answer) {
                match possible(&[spot]) {
                    Ok(()) => {
                        self.known.push(spot);
                        return Ok(Some(spot));
                    }
                    Err(reason) => say(reason),
                }
            }
        }
        Ok(None)
    }
}

/// Lines of numbers, in um where a header says nothing else. Comments are passed over.
pub(super) fn parse<const N: usize>(text: &str) -> Result<Vec<[f64; N]>, String> {
    let mut found = Vec::new();
    let mut units_um = [1.0; N];
    for (number, line) in (1..).zip(text.lines()) {
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        if found.is_empty() && line.starts_with(|c: char| c.is_ascii_alphabetic()) {
            units_um = header(line).map_err(|why| format!("line {number}, `{line}`, {why}"))?;
            continue;
        }
        let words = ["no", "one number", "two numbers", "three numbers"][N];
        let bad = || format!("line {number}, `{line}`, is not {words}");
        let read: [f64; N] = numbers(line).ok_or_else(bad)?;
        found.push(std::array::from_fn(|column| {
            read[column] * units_um[column]
        }));
    }
    Ok(found)
}

/// The units in the names of the columns x, y and z (um), such as `x_mm` or `x [mm]`; without one it is um.
fn header<const N: usize>(line: &str) -> Result<[f64; N], String> {
    let axes = &["x", "y", "z"][..N];
    let expected = || format!("does not name {} in this order", axes.join(", "));
    let names: Vec<&str> = match line.contains(',') {
        true => line.split(',').collect(),
        false => line.split_whitespace().collect(),
    };
    let names: [&str; N] = names.try_into().map_err(|_| expected())?;
    let mut units_um = [1.0; N];
    for ((name, axis), unit_um) in names.into_iter().zip(axes).zip(&mut units_um) {
        let name = name.trim().to_lowercase();
        let rest = name.strip_prefix(axis).ok_or_else(expected)?;
        let unit = rest.trim_matches(|c: char| !c.is_alphanumeric());
        if !unit.is_empty() {
            let length: Result<Length, _> = format!("1 {unit}").parse();
            *unit_um = length
                .map_err(|_| format!("has `{unit}`, which is no unit of length"))?
                .um;
        }
    }
    Ok(units_um)
}

/// A scan is one, at one voltage: `# V_V=` says which where the tool wrote it.
pub(super) fn check_one_scan(text: &str) -> Result<(), String> {
    let mut volts = text.lines().filter_map(|line| line.strip_prefix("# V_V="));
    let first = volts.next();
    match volts.find(|other| Some(*other) != first) {
        None => Ok(()),
        Some(other) => Err(format!(
            "it holds scans at {} V and at {other} V, each of which has a plane of its own; give each a file",
            first.unwrap_or_default()
        )),
    }
}

/// Names the first length that is no plate's and no sensor's.
pub(crate) fn possible<const N: usize>(points: &[[f64; N]]) -> Result<(), String> {
    let lengths = (1..)
        .zip(points)
        .flat_map(|(number, point)| point.iter().map(move |um| (number, um)));
    match lengths.into_iter().find(|(_, um)| !is_possible(**um)) {
        None => Ok(()),
        Some((number, um)) => Err(format!(
            "point {number} has {um} um, more than the {LONGEST_UM} um that a plate or its sensor may be away; it looks like nm: divide by 1000"
        )),
    }
}

/// Numbers between commas or blanks, exactly so many.
fn numbers<const N: usize>(line: &str) -> Option<[f64; N]> {
    let cells: Option<Vec<f64>> = if line.contains(',') {
        line.split(',').map(finite).collect()
    } else {
        line.split_whitespace().map(finite).collect()
    };
    cells?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn lines_that_are_no_points_are_told() {
        for bad in ["1,2", "1,2,x", "1,2,nan", "1,2,3,4", "1,,3"] {
            let said =
                parse::<3>(&format!("x_um,y_um,z_um\n0,0,1\n{bad}\n")).expect_err("unusable");
            assert!(said.starts_with("line 3"), "{said}");
        }
        assert_eq!(parse("# a scan\nx,y,z\n1,2,3\n"), Ok(vec![[1.0, 2.0, 3.0]]));
        assert_eq!(parse("-50 25\n"), Ok(vec![[-50.0, 25.0]]));
    }

    #[test]
    fn a_header_tells_units_and_none_that_is_another_is_passed_over() {
        let read = parse("x_mm,y_mm,z_um\n0.1,-0.2,3\n").expect("a scan");
        assert_eq!(read, vec![[100.0, -200.0, 3.0]]);
        assert_eq!(parse("X y_nm\n1 5000\n"), Ok(vec![[1.0, 5.0]]));
        assert_eq!(parse("x [µm], y (mm)\n1,5\n"), Ok(vec![[1.0, 5e3]]));
        for bad in ["x_deg,y_um", "y,x", "x,y,z", "points"] {
            let said = parse::<2>(&format!("{bad}\n1,2\n")).expect_err("no such columns");
            assert!(said.starts_with(&format!("line 1, `{bad}`,")), "{said}");
        }
    }

    #[test]
    fn two_scans_are_no_plane() {
        let scan = |volts: &str| format!("# V_V={volts}\nx_um,y_um,z_um\n0,0,1\n");
        assert_eq!(check_one_scan(&scan("0")), Ok(()));
        assert_eq!(check_one_scan(&(scan("1") + &scan("1"))), Ok(()));
        let said = check_one_scan(&(scan("0") + &scan("1"))).expect_err("two");
        assert!(said.contains("at 0 V and at 1 V"), "{said}");
    }

    #[test]
    fn nanometres_are_told_by_their_size() {
        let said = possible(&[[-50.0, 25.0, 101.2], [50.0, 25.0, 120_000.0]]).expect_err("nm");
        assert!(said.starts_with("point 2 has 120000 um"), "{said}");
        assert!(said.ends_with("it looks like nm: divide by 1000"), "{said}");
        // A stage and a sensor's own zero are within it.
        assert_eq!(possible(&[[-250.0, 250.0, 9_900.0]]), Ok(()));
    }

    proptest! {
        #[test]
        fn points_come_back_as_they_were_written(points: Vec<[i16; 2]>) {
            let text: String = points.iter().map(|[x, y]| format!("{x},{y}\n")).collect();
            let expected: Vec<Spot> = points.iter().map(|point| point.map(f64::from)).collect();
            prop_assert_eq!(parse(&text), Ok(expected));
        }
    }
}
