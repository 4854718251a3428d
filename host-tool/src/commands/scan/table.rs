//! A table of poses over time, as a user writes it.

use std::path::Path;

use mirror_protocol::{POINTS, POSE_POINTS};

use crate::commands::measure::readings::finite;
use crate::error::{ToolError, UnusableInput};

/// What a table's columns may be called, and what they hold. The tilt about x is elsewhere called tip.
const COLUMNS: [(&str, Column); 6] = [
    ("t_s", Column::Time),
    ("z_um", Column::Piston),
    ("tilt_x_deg", Column::TiltX),
    ("tip_deg", Column::TiltX),
    ("tilt_y_deg", Column::TiltY),
    ("tilt_deg", Column::TiltY),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Column {
    Time,
    Piston,
    TiltX,
    TiltY,
}

/// A row: time (s), piston (um), tilts about x and y (deg).
type Row = (f64, [f64; 3]);

/// Positions at equal steps of time, as a board plays them.
#[derive(Clone, Debug)]
pub(super) struct Sampled {
    /// Pistons (um).
    pub(super) z_um: Vec<f64>,
    /// Tilts about x and y (deg), where the table has any.
    pub(super) tilts_deg: Option<[Vec<f64>; 2]>,
    /// Control ticks from one to the next.
    pub(super) dwell_ticks: u32,
    /// How far the straight lines between them pass by a row of the table at most: piston (um), and either tilt (deg).
    pub(super) missed: (f64, f64),
}

/// A table's poses, on a board with so many ticks a second.
pub(super) fn read(path: &Path, tick_hz: u32) -> Result<Sampled, ToolError> {
    let text = input_file::read_text(path, input_file::MOST_MADE)?;
    let unusable = |reason: String| {
        ToolError::from(UnusableInput::Waveform {
            path: path.to_owned(),
            reason,
        })
    };
    let (rows, is_tilted) = parse(&text).map_err(unusable)?;
    sample(&rows, is_tilted, tick_hz).map_err(|reason| unusable(reason.into()))
}

/// The rows, and whether the table has tilts.
fn parse(text: &str) -> Result<(Vec<Row>, bool), String> {
    let mut columns = vec![Column::Time, Column::Piston];
    let mut rows: Vec<Row> = Vec::new();
    let mut is_begun = false;
    for (number, line) in (1..).zip(text.lines().map(str::trim)) {
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let is_header = !is_begun && is_header(line);
        is_begun = true;
        if is_header {
            columns = header(line)?;
            continue;
        }
        let row = row(&columns, line).map_err(|what| format!("line {number}, `{line}`: {what}"))?;
        if let Some((before_s, _)) = rows.last() {
            in_order(*before_s, row.0).map_err(|what| format!("line {number} {what}"))?;
        }
        rows.push(row);
    }
    let is_tilted = columns.contains(&Column::TiltX) || columns.contains(&Column::TiltY);
    Ok((rows, is_tilted))
}

/// Whether a first line names columns: a spreadsheet may have put the names into quotes.
fn is_header(line: &str) -> bool {
    line.trim_start_matches('"')
        .starts_with(|c: char| c.is_ascii_alphabetic())
}

fn header(line: &str) -> Result<Vec<Column>, String> {
    let mut columns = Vec::new();
    for name in cells(line) {
        let Some((_, column)) = COLUMNS.iter().find(|(known, _)| *known == name) else {
            let known = COLUMNS.map(|(name, _)| name).join(", ");
            return Err(format!("there is no column `{name}`; there are {known}"));
        };
        if columns.contains(column) {
            return Err(format!("the column `{name}` says what another one says"));
        }
        columns.push(*column);
    }
    for (name, column) in [("t_s", Column::Time), ("z_um", Column::Piston)] {
        if !columns.contains(&column) {
            return Err(format!("it has no column `{name}`"));
        }
    }
    Ok(columns)
}

/// The cells of a line, without the quotes that a spreadsheet may have put around them.
fn cells(line: &str) -> impl Iterator<Item = &str> {
    line.split(',').map(|cell| cell.trim().trim_matches('"'))
}

fn row(columns: &[Column], line: &str) -> Result<Row, String> {
    let cells: Vec<&str> = cells(line).collect();
    if cells.len() != columns.len() {
        let (count, needed) = (cells.len(), columns.len());
        return Err(format!("it has {count} cells, and {needed} are needed"));
    }
    let (mut t_s, mut pose) = (0.0, [0.0; 3]);
    for (column, cell) in columns.iter().zip(cells) {
        let value = match cell {
            "" => Err("a cell is empty; a waveform has no gaps".into()),
            cell => finite(cell).ok_or_else(|| format!("`{cell}` is no finite number")),
        }?;
        match column {
            Column::Time => t_s = value,
            Column::Piston => pose[0] = value,
            Column::TiltX => pose[1] = value,
            Column::TiltY => pose[2] = value,
        }
    }
    Ok((t_s, pose))
}

fn in_order(before_s: f64, now_s: f64) -> Result<(), String> {
    if now_s > before_s {
        Ok(())
    } else if now_s == before_s {
        Err(format!("has the time of the line before, {now_s} s"))
    } else {
        Err(format!("goes back in time, from {before_s} s to {now_s} s"))
    }
}

/// Points may be farther apart than the board's table makes necessary, by one tick or by so many, twice as far at most: the way that passes by
/// the rows least has their corners on points where that can be.
const WAYS: u32 = 16;
/// What rounding makes of a corner that is met (um, deg).
const ROUNDING: f64 = 1e-9;

/// As dense as the board's table allows, or a little less where that meets the rows better, and no denser than the control ticks.
fn sample(rows: &[Row], is_tilted: bool, tick_hz: u32) -> Result<Sampled, &'static str> {
    let [(first_s, _), .., (last_s, _)] = rows[..] else {
        return Err("it has fewer than two points");
    };
    let most = if is_tilted { POSE_POINTS } else { POINTS };
    let ticks = (last_s - first_s) * f64::from(tick_hz);
    let densest = (ticks / (most - 1) as f64).ceil().max(1.0);
    if (ticks / densest).round() < 1.0 || densest > f64::from(u32::MAX) {
        return Err("it is shorter than a control tick, or longer than 100 h");
    }
    let densest = densest as u32;
    let ways = densest..=densest.saturating_add(densest.min(WAYS));
    let sampled = ways
        .filter(|dwell| (ticks / f64::from(*dwell)).round() >= 1.0)
        .map(|dwell| sampled_every(dwell, rows, ticks))
        .min_by(|a, b| {
            let missed = |it: &Sampled| it.missed.0.hypot(it.missed.1).max(ROUNDING);
            missed(a).total_cmp(&missed(b))
        });
    let sampled = sampled.ok_or("it is shorter than a control tick")?;
    Ok(Sampled {
        tilts_deg: sampled.tilts_deg.filter(|_| is_tilted),
        ..sampled
    })
}

/// With so many ticks from one point to the next.
fn sampled_every(dwell_ticks: u32, rows: &[Row], ticks: f64) -> Sampled {
    let (first_s, last_s) = (rows[0].0, rows[rows.len() - 1].0);
    let steps = (ticks / f64::from(dwell_ticks)).round();
    let times_s =
        (0..=steps as u32).map(|step| first_s + (last_s - first_s) * f64::from(step) / steps);
    let poses: Vec<Row> = times_s.map(|t_s| (t_s, at(rows, t_s))).collect();
    let mut missed = [0.0_f64; 3];
    for (t_s, pose) in rows {
        let played = at(&poses, *t_s);
        for (missed, (asked, played)) in missed.iter_mut().zip(pose.iter().zip(played)) {
            *missed = missed.max((asked - played).abs());
        }
    }
    let column = |axis: usize| poses.iter().map(|(_, pose)| pose[axis]).collect();
    Sampled {
        z_um: column(0),
        tilts_deg: Some([column(1), column(2)]),
        dwell_ticks,
        missed: (missed[0], missed[1].max(missed[2])),
    }
}

/// On the straight line between two rows.
fn at(rows: &[Row], t_s: f64) -> [f64; 3] {
    let after = rows.partition_point(|(t, _)| *t < t_s);
    let after = after.clamp(1, rows.len() - 1);
    let ((t0, from), (t1, to)) = (rows[after - 1], rows[after]);
    let part = ((t_s - t0) / (t1 - t0)).clamp(0.0, 1.0);
    std::array::from_fn(|axis| from[axis] + part * (to[axis] - from[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sampled(text: &str) -> Result<Sampled, String> {
        let (rows, is_tilted) = parse(text)?;
        sample(&rows, is_tilted, 10_000).map_err(str::to_owned)
    }

    #[test]
    fn a_spreadsheet_may_quote_and_indent() {
        let plain = parse("t_s,z_um\n0,1\n0.5,2\n").expect("a table");
        assert_eq!(
            parse("\"t_s\",\"z_um\"\n\"0\",\"1\"\n0.5,2\n").as_ref(),
            Ok(&plain)
        );
        assert_eq!(
            parse("  t_s , z_um \r\n 0 , 1\r\n 0.5,2 \n").as_ref(),
            Ok(&plain)
        );
    }

    #[test]
    fn a_table_that_is_no_waveform_is_told_why() {
        for (text, reason) in [
            ("", "fewer than two points"),
            ("t_s,z_um\n0,1\n", "fewer than two points"),
            ("0,1\n1\n", "line 2, `1`: it has 1 cells, and 2 are needed"),
            ("1,1\n0,2\n", "line 2 goes back in time, from 1 s to 0 s"),
            (
                "0,1\n0.5,1\n0.5,2\n",
                "line 3 has the time of the line before, 0.5 s",
            ),
            ("0,1\n1,nan\n", "line 2, `1,nan`: `nan` is no finite number"),
            ("0,1\n1,1e999\n", "`1e999` is no finite number"),
            (
                "t_s,z_um,tip_deg,tilt_deg\n0,1,0,0\n1,1,,0\n",
                "line 3, `1,1,,0`: a cell is empty",
            ),
            ("0,1,0,0\n1,1,0,0\n", "it has 4 cells, and 2 are needed"),
            (
                "t_s,z_um,roll\n0,1,0\n",
                "there is no column `roll`; there are t_s, z_um, tilt_x_deg",
            ),
            (
                "t_s,z_um,tip_deg,tilt_x_deg\n",
                "`tilt_x_deg` says what another one says",
            ),
            ("t_s,tip_deg\n0,1\n", "it has no column `z_um`"),
            ("0,1\n1e-6,2\n", "shorter than a control tick"),
        ] {
            let said = sampled(text).expect_err("unusable");
            assert!(said.contains(reason), "{said}");
        }
    }

    #[test]
    fn columns_are_known_by_their_names_in_any_order() {
        let text = "# mine\ntilt_deg,z_um,t_s,tip_deg\n0.1,60,0,-0.2\n0.3,80,0.0002,-0.4\n";
        let found = sampled(text).expect("a waveform");
        let [tip, tilt] = found.tilts_deg.expect("tilts");
        assert_eq!(
            (found.z_um, tip, tilt),
            (
                vec![60.0, 70.0, 80.0],
                vec![-0.2, -0.30000000000000004, -0.4],
                vec![0.1, 0.2, 0.3]
            )
        );
        assert_eq!(found.dwell_ticks, 1);
    }

    #[test]
    fn corners_lie_on_points_where_they_can() {
        let found = sampled("0,40\n0.5,60\n1,40\n").expect("a waveform");
        assert!(found.missed.0 < 1e-6, "{found:?}");
        assert!(found.z_um.len() > 80, "{}", found.z_um.len());
    }

    #[test]
    fn what_a_board_has_no_room_for_is_told_by_how_far_it_is_missed() {
        // Every other of 400 rows is at the top; 170 points cannot be.
        let rows = (0..400).map(|i| format!("{},{},0\n", f64::from(i) * 0.01, 10 * (i % 2)));
        let found = sampled(&format!("t_s,z_um,tip_deg\n{}", rows.collect::<String>()));
        assert!(found.expect("a waveform").missed.0 > 1.0);
    }

    proptest! {
        #[test]
        fn a_waveform_keeps_its_ends_and_its_length(
            z in proptest::collection::vec(0.0_f64..170.0, 2..700), step_s in 1e-3_f64..1.0,
        ) {
            let text: String = z
                .iter()
                .enumerate()
                .map(|(i, z)| format!("{:?},{z:?}\n", i as f64 * step_s))
                .collect();
            let Sampled { z_um, dwell_ticks, .. } = sampled(&text).expect("a waveform");
            prop_assert!(z_um.len() <= POINTS);
            prop_assert!((z_um[0] - z[0]).abs() < 1e-9);
            prop_assert!((z_um[z_um.len() - 1] - z[z.len() - 1]).abs() < 1e-9);
            let asked = (z.len() - 1) as f64 * step_s * 1e4;
            let played = (z_um.len() - 1) as f64 * f64::from(dwell_ticks);
            prop_assert!((played - asked).abs() <= f64::from(dwell_ticks), "{played} for {asked}");
        }

        #[test]
        fn any_text_is_a_waveform_or_a_sentence(text in "[0-9a-z,.\\n# _-]{0,60}") {
            if let Ok(found) = sampled(&text) {
                prop_assert!(found.z_um.iter().all(|z| z.is_finite()));
            }
        }
    }
}
