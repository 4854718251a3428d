//! A table of poses over time, as a user writes it.

use std::path::Path;

use mirror_protocol::{POINTS, POSE_POINTS};
use quantities::Span;

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
    /// Control ticks from the table's first row to its last.
    pub(super) ticks: f64,
    /// How far the straight lines between them pass by a row of the table at most: piston (um), and either tilt (deg).
    pub(super) missed: (f64, f64),
    /// Control ticks that are between two of them at least, for the board to have room.
    least_ticks: u32,
    /// The row, from 0, of which most is missed, as a part of what the table goes through.
    worst: (usize, f64),
}

/// A table of which a larger part of its way is missed would be driven as another course. A choice.
const OTHER_COURSE: f64 = 0.05;

impl Sampled {
    /// Control ticks that it takes.
    pub(super) fn played_ticks(&self) -> f64 {
        (self.z_um.len() - 1) as f64 * f64::from(self.dwell_ticks)
    }

    /// Whether it takes another time than the table, by more than whole ticks make necessary.
    pub(super) fn takes_another_time(&self) -> bool {
        (self.played_ticks() - self.ticks).abs() > 0.5 + ROUNDING
    }

    /// Whether more is missed than rounding and the board's 16 bits leave.
    pub(super) fn is_missed(&self) -> bool {
        self.missed.0 > 0.01 || self.missed.1 > 1e-4
    }
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
    let sampled = sample(&rows, is_tilted, tick_hz).map_err(|reason| unusable(reason.into()))?;
    if !sampled.is_missed() || sampled.worst.1 <= OTHER_COURSE {
        return Ok(sampled);
    }
    let (row, step_s) = closest(&rows, sampled.worst.0);
    let tick = |ticks: f64| Span {
        s: ticks / f64::from(tick_hz),
    };
    Err(UnusableInput::TooFine {
        path: path.to_owned(),
        line: line(&text, row),
        step: tick((step_s * f64::from(tick_hz)).round()),
        least: tick(f64::from(sampled.least_ticks)),
        missed_um: sampled.missed.0,
        missed_deg: sampled.missed.1,
    }
    .into())
}

/// Of the steps to a row and from it the shorter one (s), and the row that it leads to.
fn closest(rows: &[Row], row: usize) -> (usize, f64) {
    let steps = [row, row + 1].into_iter().filter_map(|to| {
        let before = to.checked_sub(1)?;
        Some((to, rows.get(to)?.0 - rows[before].0))
    });
    let shortest = steps.min_by(|(_, a), (_, b)| a.total_cmp(b));
    shortest.unwrap_or_default()
}

/// The line, from 1, that a row, from 0, stands in.
fn line(text: &str, row: usize) -> usize {
    let lines = (1..).zip(text.lines().map(str::trim));
    let mut filled = lines.filter(|(_, line)| is_filled(line)).peekable();
    let is_headed = filled.peek().is_some_and(|(_, line)| is_header(line));
    let mut rows = filled.skip(usize::from(is_headed));
    rows.nth(row).map_or(0, |(number, _)| number)
}

fn is_filled(line: &str) -> bool {
    !line.is_empty() && !line.starts_with('#')
}

/// The rows, and whether the table has tilts.
fn parse(text: &str) -> Result<(Vec<Row>, bool), String> {
    let mut columns = vec![Column::Time, Column::Piston];
    let mut rows: Vec<Row> = Vec::new();
    let mut is_begun = false;
    for (number, line) in (1..).zip(text.lines().map(str::trim)) {
        if !is_filled(line) {
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
        let Some((_, column)) = COLUMNS.iter().find(|(known, _)| **known == name) else {
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

/// The cells of a line, without the quotes that a spreadsheet may have put around them. Where it puts semicolons between them a comma is a
/// decimal one.
fn cells(line: &str) -> Vec<String> {
    let has_semicolons = line.contains(';');
    let delimiter = if has_semicolons { ';' } else { ',' };
    let cells = line.split(delimiter);
    let cells = cells.map(|cell| cell.trim().trim_matches('"'));
    cells
        .map(|cell| match has_semicolons {
            true => cell.replace(',', "."),
            false => cell.to_owned(),
        })
        .collect()
}

fn row(columns: &[Column], line: &str) -> Result<Row, String> {
    let cells = cells(line);
    if cells.len() != columns.len() {
        let (count, needed) = (cells.len(), columns.len());
        return Err(format!("it has {count} cells, and {needed} are needed"));
    }
    let (mut t_s, mut pose) = (0.0, [0.0; 3]);
    for (column, cell) in columns.iter().zip(cells) {
        let value = match cell.as_str() {
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

/// Points may be farther apart than the board's table makes necessary, by one tick or by so many, or by as many as meet the table's length, twice as
/// far at most: the way that passes by the rows least has their corners on points where that can be.
const WAYS: usize = 16;
/// What rounding makes of a corner that is met (um, deg), and of a length (ticks).
const ROUNDING: f64 = 1e-9;
/// A tick counter of 32 bits overflows after 119 h.
const LONGEST_S: f64 = 100.0 * 3600.0;

/// As dense as the board's table allows, or a little less where that meets the rows better, and no denser than the control ticks.
fn sample(rows: &[Row], is_tilted: bool, tick_hz: u32) -> Result<Sampled, &'static str> {
    let [(first_s, _), .., (last_s, _)] = rows[..] else {
        return Err("it has fewer than two points");
    };
    let most = if is_tilted { POSE_POINTS } else { POINTS };
    let ticks = (last_s - first_s) * f64::from(tick_hz);
    if ticks.round() < 1.0 || last_s - first_s > LONGEST_S {
        return Err("it is shorter than a control tick, or longer than 100 h");
    }
    let densest = (ticks / (most - 1) as f64).ceil().max(1.0) as u32;
    let ways = densest..=densest.saturating_mul(2);
    let is_met = |dwell: &u32| ticks.round() % f64::from(*dwell) == 0.0;
    let sampled = ways
        .clone()
        .take(WAYS)
        .chain(ways.skip(WAYS).filter(is_met).take(WAYS))
        .filter(|dwell| (ticks / f64::from(*dwell)).round() >= 1.0)
        .map(|dwell| sampled_every(dwell, rows, (ticks, tick_hz)))
        .min_by(|a, b| {
            let missed = |it: &Sampled| it.missed.0.hypot(it.missed.1).max(ROUNDING);
            missed(a).total_cmp(&missed(b))
        });
    let sampled = sampled.ok_or("it is shorter than a control tick")?;
    Ok(Sampled {
        tilts_deg: sampled.tilts_deg.filter(|_| is_tilted),
        least_ticks: densest,
        ..sampled
    })
}

/// With so many ticks from one point to the next.
fn sampled_every(dwell_ticks: u32, rows: &[Row], (ticks, tick_hz): (f64, u32)) -> Sampled {
    let (first_s, last_s) = (rows[0].0, rows[rows.len() - 1].0);
    let steps = (ticks / f64::from(dwell_ticks)).round() as u32;
    let dwell_s = f64::from(dwell_ticks) / f64::from(tick_hz);
    let poses: Vec<Row> = (0..=steps)
        .map(|step| {
            let t_s = first_s + f64::from(step) * dwell_s;
            // It ends where the table does.
            let of_s = if step == steps { last_s } else { t_s };
            (t_s, at(rows, of_s))
        })
        .collect();
    let (mut missed, mut worst) = ([0.0_f64; 3], (0, 0.0));
    let ways = [0, 1, 2].map(|axis| way(rows, axis));
    for (index, (t_s, pose)) in rows.iter().enumerate() {
        let played = at(&poses, *t_s);
        for axis in 0..3 {
            let off = (pose[axis] - played[axis]).abs();
            missed[axis] = missed[axis].max(off);
            if off > worst.1 * ways[axis] {
                worst = (index, off / ways[axis]);
            }
        }
    }
    let column = |axis: usize| poses.iter().map(|(_, pose)| pose[axis]).collect();
    Sampled {
        z_um: column(0),
        tilts_deg: Some([column(1), column(2)]),
        dwell_ticks,
        ticks,
        least_ticks: dwell_ticks,
        missed: (missed[0], missed[1].max(missed[2])),
        worst,
    }
}

/// From the lowest to the highest.
fn way(rows: &[Row], axis: usize) -> f64 {
    let values = || rows.iter().map(|(_, pose)| pose[axis]);
    values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
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
mod tests;
