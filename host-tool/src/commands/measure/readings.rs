//! Readings of a sensor over time, as text and as displacements of rows.

use measurement::MeasurementFile;

/// No plate of these mirrors is so wide, and no sensor that sees one so far from it (um): a centimetre, as a calibration's longest motion
/// (`control_core`, `plausible.rs`). The paper's plate has half a millimetre.
pub(crate) const LONGEST_UM: f64 = 1e4;

/// Whether a number may be a reading of a mirror (um). By 9.91E37 an instrument says that it has none.
pub(super) fn is_possible(um: f64) -> bool {
    um.abs() <= LONGEST_UM
}

/// Beyond this a number stands for none, as 9.91E37 does; a centimetre in nanometres is far below.
const NO_READING_UM: f64 = 1e9;

/// Numbers of a sensor that are no readings of a mirror.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Impossible {
    pub(crate) numbers: usize,
    smallest_um: f64,
    pub(crate) largest_um: f64,
}

impl Impossible {
    pub(crate) const NONE: Self = Self {
        numbers: 0,
        smallest_um: f64::INFINITY,
        largest_um: 0.0,
    };

    /// Those among the readings.
    pub(crate) fn among(readings: &[(f64, f64)]) -> Self {
        let sizes = readings.iter().map(|(_, um)| um.abs());
        sizes
            .filter(|um| !is_possible(*um))
            .fold(Self::NONE, |found, um| Self {
                numbers: found.numbers + 1,
                smallest_um: found.smallest_um.min(um),
                largest_um: found.largest_um.max(um),
            })
    }

    /// These and those.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            numbers: self.numbers + other.numbers,
            smallest_um: self.smallest_um.min(other.smallest_um),
            largest_um: self.largest_um.max(other.largest_um),
        }
    }

    /// Takes them out of rows that were read already.
    pub(super) fn out_of(file: &mut MeasurementFile) -> Self {
        let read = file
            .rows
            .iter()
            .filter_map(|row| Some((row.t_s, row.z_um?)));
        let found = Self::among(&read.collect::<Vec<_>>());
        for row in &mut file.rows {
            row.z_um = row.z_um.filter(|um| is_possible(*um));
        }
        found
    }

    /// Whether they move as a mirror does: what a sensor sends where it has lost one is the same number each time, or much larger.
    pub(crate) fn is_of_another_unit(&self) -> bool {
        self.smallest_um < self.largest_um && self.largest_um < NO_READING_UM
    }
}

pub(crate) fn finite(text: &str) -> Option<f64> {
    text.trim()
        .parse()
        .ok()
        .filter(|value: &f64| value.is_finite())
}

/// A number of micrometres as a sensor tells it, with its unit or without.
pub(super) fn micrometres(text: &str) -> Option<f64> {
    let text = text.trim();
    let number = ["um", "µm", "μm"]
        .iter()
        .find_map(|unit| text.strip_suffix(unit));
    finite(number.unwrap_or(text))
}

/// The time and the reading of a line, as they are written: parted by a comma, or by a semicolon where commas are decimal.
fn parted(line: &str) -> Option<(String, String)> {
    let decimal = |text: &str| text.replace(',', ".");
    match line.split_once(';') {
        Some((t, z)) => Some((decimal(t), decimal(z))),
        None => line
            .split_once(',')
            .map(|(t, z)| (t.to_owned(), z.to_owned())),
    }
}

/// Seconds and micrometres of a text with a line for each, in the order of time. Comments and a header are passed over.
pub(crate) fn parse(text: &str) -> Result<Vec<(f64, f64)>, String> {
    let mut readings: Vec<(f64, f64)> = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        let pair = parted(line).and_then(|(t, z)| Some((finite(&t)?, micrometres(&z)?)));
        match (pair, readings.last()) {
            (Some((t_s, _)), Some((before_s, _))) if t_s <= *before_s => {
                return Err(format!(
                    "line {number}, `{line}`, is not later than the one before"
                ));
            }
            (Some(pair), _) => readings.push(pair),
            (None, None) if line.starts_with(|c: char| c.is_ascii_alphabetic()) => {}
            (None, _) => return Err(format!("line {number}, `{line}`, is not two numbers")),
        }
    }
    Ok(readings)
}

/// Whether a sensor says by this that it has no reading: by nothing, or by a number that is none.
pub(super) fn is_none(text: &str) -> bool {
    let is_no_number = |text: &str| text.parse().is_ok_and(|um: f64| !um.is_finite());
    text.trim().is_empty() || is_no_number(text.trim())
}

/// A sensor's recording: seconds and micrometres as [`parse`] reads them, without the lines in which the sensor had no
/// reading, where there is a time and then nothing, or no finite number.
pub(super) fn recorded(text: &str) -> Result<Vec<(f64, f64)>, String> {
    let is_lost =
        |line: &&str| parted(line).is_some_and(|(t, z)| finite(&t).is_some() && is_none(&z));
    // An empty line keeps the numbers of those after it.
    let read = text
        .lines()
        .map(|line| if is_lost(&line) { "" } else { line });
    parse(&read.collect::<Vec<_>>().join("\n"))
}

/// So many times the usual time between two readings is a gap, in which nobody knows where the mirror was.
const GAP: f64 = 3.0;

/// Gives each row the displacement at its time, on a straight line between two readings; rows outside
/// the readings, or in a gap of them, stay without.
pub(super) fn merge(readings: &[(f64, f64)], file: &mut MeasurementFile) {
    let mut apart_s: Vec<f64> = readings
        .windows(2)
        .map(|pair| pair[1].0 - pair[0].0)
        .collect();
    apart_s.sort_by(f64::total_cmp);
    let gap_s = GAP * apart_s.get(apart_s.len() / 2).copied().unwrap_or(0.0);
    let at = |t_s: f64| {
        let after = readings.partition_point(|(t, _)| *t < t_s);
        let (t1, z1) = *readings.get(after)?;
        if t1 == t_s {
            return Some(z1);
        }
        let (t0, z0) = *readings.get(after.checked_sub(1)?)?;
        (t1 - t0 <= gap_s).then(|| z0 + (t_s - t0) / (t1 - t0) * (z1 - z0))
    };
    let zero = at(0.0).unwrap_or(readings[0].1);
    let Some(first) = file.rows.first().copied() else {
        return;
    };
    for row in &mut file.rows {
        // Rests between waveforms count for the sensor.
        let elapsed_s = match (row.t_global_s, first.t_global_s) {
            (Some(now), Some(first_s)) => first.t_s + now - first_s,
            _ => row.t_s,
        };
        row.z_um = at(elapsed_s).map(|z| z - zero);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use measurement::Row;
    use proptest::prelude::*;

    fn file(times: &[f64]) -> MeasurementFile {
        MeasurementFile {
            rows: times
                .iter()
                .map(|&t_s| Row {
                    t_s,
                    ..Row::default()
                })
                .collect(),
            ..MeasurementFile::default()
        }
    }

    #[test]
    fn rows_lie_on_lines_between_readings_and_count_from_the_first() {
        let readings = parse("# a recording\nt_s,z_um\n0,5\n1,7\n3,11\n").unwrap();
        let mut file = file(&[0.5, 1.0, 2.0, 3.5]);
        merge(&readings, &mut file);
        let z: Vec<_> = file.rows.iter().map(|row| row.z_um).collect();
        assert_eq!(z, [Some(1.0), Some(2.0), Some(4.0), None]);
    }

    #[test]
    fn a_reading_that_was_lost_is_passed_over_and_a_gap_is_left_open() {
        let text = "t_s,z_um\n0,1\n1,nan\n2,3\n3,\n4,inf\n5,-NaN\n6,7\n7,8\n8,9\n9,10\n10,11\n";
        let readings = recorded(text).unwrap();
        let times: Vec<f64> = readings.iter().map(|(t_s, _)| *t_s).collect();
        assert_eq!(times, [0.0, 2.0, 6.0, 7.0, 8.0, 9.0, 10.0]);
        let mut file = file(&[1.0, 4.0, 6.5]);
        merge(&readings, &mut file);
        let z: Vec<_> = file.rows.iter().map(|row| row.z_um).collect();
        assert_eq!(z, [Some(1.0), None, Some(6.5)]);
        let said = recorded("0,1\n1,nan\n2,x\n").unwrap_err();
        assert!(said.starts_with("line 3, `2,x`"), "{said}");
    }

    #[test]
    fn decimal_commas_and_units_are_read_where_they_are_clear() {
        let text = "t;z\n-0,5;1,25\n0;nan\n1,5; 2,5 um\n2.5;-3\n";
        assert_eq!(
            recorded(text).unwrap(),
            [(-0.5, 1.25), (1.5, 2.5), (2.5, -3.0)]
        );
        for (told, um) in [
            ("12.3", Some(12.3)),
            (" -12.3 um\r\n", Some(-12.3)),
            ("1e2µm", Some(100.0)),
            ("12.3 nm", None),
            ("12,3", None),
            ("0.5,12.3", None),
            ("um", None),
        ] {
            assert_eq!(micrometres(told), um, "{told}");
        }
    }

    #[test]
    fn a_recording_that_is_none_is_told_by_its_line() {
        for (text, line) in [
            ("0,1\n1\n", "line 2, `1`"),
            ("0,1\n1,nan\n", "line 2, `1,nan`"),
            ("0,1\n0,2\n", "line 2, `0,2`, is not later"),
            ("t,z\n0,1\nx,y\n", "line 3, `x,y`"),
            ("t,z\n0,1\nt,z\n1,2\n", "line 3, `t,z`"),
            ("0;1.234,5\n", "line 1, `0;1.234,5`"),
            ("0,5,12,3\n", "line 1, `0,5,12,3`"),
        ] {
            let said = parse(text).unwrap_err();
            assert!(said.starts_with(line), "{said}");
        }
    }

    #[test]
    fn numbers_of_another_unit_are_told_from_those_that_stand_for_none() {
        let of = |um: &[f64]| {
            let readings: Vec<_> = um.iter().map(|um| (0.0, *um)).collect();
            Impossible::among(&readings)
        };
        // From rest to 160 um, in nm, and the other way round.
        for sign in [1.0, -1.0] {
            let nm = of(&[0.0, 20.0, 4e4, 1.6e5].map(|um| sign * um));
            assert_eq!((nm.numbers, nm.largest_um), (2, 1.6e5));
            assert!(nm.is_of_another_unit());
        }
        for lost in [
            &[1.0, 2.0][..],
            &[1.0, 9.91e37, 9.91e37],
            &[-1e30, 9.91e37],
            &[32_767.0, 32_767.0, 12.0],
        ] {
            assert!(!of(lost).is_of_another_unit(), "{lost:?}");
        }
    }

    proptest! {
        #[test]
        fn what_was_recorded_comes_back_at_its_times(
            z in proptest::collection::vec(-100.0_f64..100.0, 2..50),
        ) {
            let text: String = z.iter().enumerate().map(|(i, z)| format!("{i},{z:?}\n")).collect();
            let times: Vec<f64> = (0..z.len()).map(|i| i as f64).collect();
            let mut file = file(&times);
            merge(&parse(&text).unwrap(), &mut file);
            for (row, z_um) in file.rows.iter().zip(&z) {
                prop_assert!((row.z_um.unwrap() - (z_um - z[0])).abs() < 1e-9);
            }
        }

        #[test]
        fn any_text_is_readings_in_the_order_of_time_or_a_sentence(
            text in "[0-9a-z,.\\n# -]{0,60}",
        ) {
            match parse(&text) {
                Ok(readings) => {
                    prop_assert!(readings.iter().all(|(t, z)| t.is_finite() && z.is_finite()));
                    prop_assert!(readings.windows(2).all(|pair| pair[0].0 < pair[1].0));
                }
                Err(said) => prop_assert!(said.starts_with("line "), "{}", said),
            }
        }
    }
}
