//! From text to rows, line by line. Every error points at its cell.

use crate::column::{COLUMNS, Column, suggestion};
use crate::error::{Complaint, Excerpt, printable};
use crate::header::{is_timeless, missing};
use crate::keys::{NUMERIC, is_key};
use crate::lines::{Line, LineError, Lines, MOST_OF_A_LINE};
use crate::plausibility::Device;
use crate::wholeness::Wholeness;
use crate::{InputError, Keys, MeasurementFile, Row, clocks, plausibility, stuck};
use input_file::ReadError;
use std::io::{BufRead, Cursor, Seek};
use std::ops::Range;
use std::sync::Arc;

/// The most rows of a session, all files together. A row takes 272 bytes of memory (`a_row_takes_what_the_limit_counts_with`),
/// so that they take 0.5 GB; the lab thins what is dense long before (`identification::Dataset`).
pub const MOST_ROWS: usize = 2_000_000;

/// The most bytes of a file's comments, which are kept: a book.
const MOST_OF_COMMENTS: usize = 1_000_000;

impl MeasurementFile {
    /// Reads a file's text; `name` is what errors call it.
    ///
    /// # Errors
    /// [`InputError::Content`] for anything but at least two rows of finite numbers in known columns at increasing
    /// times, for values that are evidently in a wrong unit (see [`plausibility`]), and for more than [`MOST_ROWS`].
    pub fn parse(name: &str, text: &str) -> Result<Self, InputError> {
        Self::parse_of(name, text, &Device::default())
    }

    /// The same of a device that something is known of.
    ///
    /// # Errors
    /// As [`parse`](Self::parse), and for what this device cannot have shown.
    pub fn parse_of(name: &str, text: &str, device: &Device) -> Result<Self, InputError> {
        Self::read(name, Cursor::new(text), device, MOST_ROWS)
    }

    /// Reads a file from its beginning; no more of it than its rows is ever in memory.
    ///
    /// # Errors
    /// As [`parse_of`](Self::parse_of), with at most `most_rows`, and where `source` cannot be read.
    pub(crate) fn read(
        name: &str,
        source: impl BufRead + Seek,
        device: &Device,
        most_rows: usize,
    ) -> Result<Self, InputError> {
        let parser = Parser {
            name,
            lines: Lines::new(source),
            most_rows,
            file: Self::default(),
            columns: Vec::new(),
            wholeness: Wholeness::default(),
            comments: 0,
            last: Line::default(),
        };
        parser.file(device)
    }
}

struct Parser<'a, R> {
    name: &'a str,
    lines: Lines<R>,
    most_rows: usize,
    file: MeasurementFile,
    /// Empty up to the header line.
    columns: Vec<Column>,
    wholeness: Wholeness,
    /// Bytes of the comments so far.
    comments: usize,
    /// The last line that is not blank.
    last: Line,
}

impl<R: BufRead + Seek> Parser<'_, R> {
    fn file(mut self, device: &Device) -> Result<MeasurementFile, InputError> {
        while let Some(line) = self.next_line()? {
            if self.wholeness.is_cut_off(line.ended) {
                break;
            }
            if let Some(comment) = line.text.strip_prefix('#') {
                self.comment(&line, comment.trim())?;
            } else if line.text.trim().is_empty() {
                continue;
            } else if self.columns.is_empty() {
                self.columns = self.header(&line)?;
                if is_timeless(&self.columns) {
                    self.file.keys.set("steady", "yes");
                }
            } else {
                self.row(&line)?;
            }
            self.last = line;
        }
        if let Some(flaw) = self.wholeness.flaw(self.file.rows.len()) {
            self.file.keys.set("partial", &flaw);
        }
        self.check_enough()?;
        let implausible = plausibility::check(&self.file, device)
            .or_else(|| stuck::check(&self.file))
            .or_else(|| clocks::check(&self.file));
        if let Some((row, column, complaint)) = implausible {
            return Err(self.implausible(row, column, complaint));
        }
        if self.file.keys.is_steady() {
            self.file.sort_by_drive();
        }
        Ok(self.file)
    }

    fn next_line(&mut self) -> Result<Option<Line>, InputError> {
        self.lines.next().map_err(|error| match error {
            LineError::Io(source) => ReadError::Unreadable {
                path: self.name.to_owned(),
                source,
            }
            .into(),
            LineError::TooLong(line) => {
                let complaint = Complaint::new(
                    format!("this line is longer than {} KB", MOST_OF_A_LINE / 1024),
                    "is it a measurement file? One has a row a line, with commas between the cells",
                );
                self.error(&line, line.start..line.start, complaint)
            }
            LineError::NotText(line) => {
                let complaint = Complaint::new(
                    "this line is not UTF-8",
                    "is it a measurement file? If so, save it as plain text in UTF-8",
                );
                self.error(&line, line.start..line.start, complaint)
            }
        })
    }

    fn comment(&mut self, line: &Line, comment: &str) -> Result<(), InputError> {
        self.comments += line.text.len();
        if self.comments > MOST_OF_COMMENTS {
            let complaint = Complaint::new(
                format!("the comments are longer than {MOST_OF_COMMENTS} bytes in all"),
                "leave comments out; data stand in lines without #",
            );
            return Err(self.error(line, line.place(), complaint));
        }
        match comment.split_once('=') {
            Some((key, value)) if is_key(key.trim()) => {
                let (key, value) = (key.trim(), value.trim());
                if self.wholeness.takes(key, value) {
                    return Ok(());
                }
                set_key(&mut self.file.keys, key, value)
                    .map_err(|complaint| self.error(line, line.place(), complaint))
            }
            _ => {
                self.file.notes.push(comment.to_owned());
                Ok(())
            }
        }
    }

    fn header(&self, line: &Line) -> Result<Vec<Column>, InputError> {
        let mut columns = Vec::new();
        for (name, cell) in line.cells() {
            let complaint = match Column::from_name(name) {
                None => Complaint::new(format!("there is no column '{name}'"), suggestion(name)),
                Some(column) if columns.contains(&column) => Complaint::new(
                    format!("the column '{name}' is there twice"),
                    "remove one of the two",
                ),
                Some(column) => {
                    columns.push(column);
                    continue;
                }
            };
            return Err(self.error(line, cell, complaint));
        }
        match missing(&columns) {
            None => Ok(columns),
            Some(complaint) => Err(self.error(line, line.place(), complaint)),
        }
    }

    fn row(&mut self, line: &Line) -> Result<(), InputError> {
        if self.file.rows.len() == self.most_rows {
            return Err(self.error(line, line.place(), too_many_rows()));
        }
        let count = line.cells().count();
        if count != self.columns.len() {
            let complaint = Complaint::new(
                format!(
                    "this row has {count} cells, the header has {}",
                    self.columns.len()
                ),
                "every row needs one cell a column; what was not measured is left empty",
            );
            return Err(self.error(line, line.place(), complaint));
        }
        let mut row = Row::default();
        for (&column, (text, cell)) in self.columns.iter().zip(line.cells()) {
            if text.is_empty() && column.may_be_empty() {
                continue;
            }
            let value = number(column, text)
                .and_then(|value| self.in_order(column, value).map(|()| value))
                .map_err(|complaint| self.error(line, cell, complaint))?;
            column.store(&mut row, value);
        }
        self.file.rows.push(row);
        Ok(())
    }

    /// Times grow from row to row.
    fn in_order(&self, column: Column, now: f64) -> Result<(), Complaint> {
        if !matches!(column, Column::Time | Column::GlobalTime) || self.file.keys.is_steady() {
            return Ok(());
        }
        let mut times = self.file.rows.iter().rev();
        let Some(before) = times.find_map(|row| column.value(row)) else {
            return Ok(());
        };
        if now > before {
            return Ok(());
        }
        let what = if now == before {
            "is there twice"
        } else {
            "goes back"
        };
        Err(Complaint::new(
            format!("the time {what}: {now} s comes after {before} s"),
            "rows must be in the order of time, each at its own time",
        ))
    }

    fn check_enough(&self) -> Result<(), InputError> {
        let end = self.last.place().end;
        if self.columns.is_empty() {
            let complaint = Complaint::new(
                "the file is empty",
                "a measurement file has a header line such as t_s,V_V,z_um, and rows",
            );
            return Err(self.error(&Line::default(), 0..0, complaint));
        }
        let rows = match self.file.rows.len() {
            0 => "no rows",
            1 => "only one row",
            _ => return Ok(()),
        };
        let complaint = match self.file.keys.get("partial") {
            Some(why) => Complaint::new(
                format!("the measurement was cut short, and the file has {rows}: {why}"),
                "remove this file: the others of its folder can be used without it, and it can be measured again",
            ),
            None => Complaint::new(
                format!("the file has {rows}"),
                "a measurement needs two rows at least",
            ),
        };
        Err(self.error(&self.last, end..end, complaint))
    }

    /// Reads the file once more, up to the row in question.
    fn implausible(mut self, row: usize, column: Column, complaint: Complaint) -> InputError {
        let index = self
            .columns
            .iter()
            .position(|&c| c == column || c == column.of_all())
            .unwrap_or(0);
        let mut source = self.lines.into_source();
        let rewound = source.rewind();
        self.lines = Lines::new(source);
        if let Err(source) = rewound {
            let path = self.name.to_owned();
            return ReadError::Unreadable { path, source }.into();
        }
        // The header stands before the rows.
        let mut passed = row + 2;
        loop {
            let line = match self.next_line() {
                Ok(Some(line)) => line,
                Ok(None) => return self.error(&self.last, self.last.place(), complaint),
                Err(error) => return error,
            };
            if !line.text.starts_with('#') && !line.text.trim().is_empty() {
                passed -= 1;
            }
            if passed == 0 {
                let cell = line.cells().nth(index).map(|(_, cell)| cell);
                return self.error(&line, cell.unwrap_or(line.place()), complaint);
            }
        }
    }

    fn error(&self, line: &Line, place: Range<usize>, complaint: Complaint) -> InputError {
        InputError::Content {
            file: self.name.into(),
            line: line.number.max(1),
            message: printable(&complaint.message),
            help: complaint.help,
            text: Arc::new(Excerpt::new(self.name, line)),
            place: place.into(),
        }
    }
}

/// Adds a key that a file states.
///
/// # Errors
/// Where it is there already, or its value is not of its kind.
pub(crate) fn set_key(keys: &mut Keys, key: &str, value: &str) -> Result<(), Complaint> {
    if keys.get(key).is_some() {
        return Err(Complaint::new(
            format!("the key '{key}' is given twice"),
            "remove one of the two",
        ));
    }
    let is_number = || {
        value
            .parse::<f64>()
            .is_ok_and(|number| number.is_finite() && number >= 0.0)
    };
    if NUMERIC.contains(&key) && !is_number() {
        return Err(Complaint::new(
            format!("{key} must be a number that is not negative, not '{value}'"),
            "write it like 20 or 1.5",
        ));
    }
    keys.set(key, value);
    Ok(())
}

fn too_many_rows() -> Complaint {
    Complaint::new(
        format!("with this row the session has more than {MOST_ROWS}, the most that is read"),
        "give fewer files, or thin them: where the drive is held, keep the rows on both sides of its changes and every \
         tenth or hundredth of the others; nothing that a fit can tell is lost",
    )
}

/// What a trigger can be: bits of frame and line.
const TRIGGERS: [f64; 4] = [0.0, 1.0, 2.0, 3.0];

fn number(column: Column, text: &str) -> Result<f64, Complaint> {
    let name = COLUMNS
        .iter()
        .find(|(_, known)| *known == column)
        .map_or("", |(name, _)| name);
    if text.is_empty() {
        return Err(Complaint::new(
            format!("{name} is empty"),
            "the drive is needed in every row, and the time where there is one",
        ));
    }
    let value: f64 = text.parse().map_err(|_| {
        Complaint::new(
            format!("'{text}' is not a number"),
            format!("{name} takes plain numbers, its unit stands in its name"),
        )
    })?;
    if !value.is_finite() {
        return Err(Complaint::new(
            format!("{name} is '{text}'"),
            "leave a cell empty where nothing was measured",
        ));
    }
    if column == Column::Trigger && !TRIGGERS.contains(&value) {
        return Err(Complaint::new(
            format!("{name} is '{text}'"),
            "it is 0, 1 where a frame begins, 2 where a line does, or 3 where both do",
        ));
    }
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trigger_is_of_a_frame_and_a_line() {
        assert_eq!(number(Column::Trigger, "3").ok(), Some(3.0));
        for text in ["4", "-1", "1.5", "300"] {
            assert!(number(Column::Trigger, text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_row_takes_what_the_limit_counts_with() {
        assert_eq!(size_of::<Row>(), 272);
    }
}
