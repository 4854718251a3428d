//! From rows to text: of a file that is there, and of one that grows.

use crate::column::{COLUMNS, Column};
use crate::wholeness::{ENDS_WITH, ROWS};
use crate::{ACTUATORS, Keys, MeasurementFile, Row};
use std::fmt;
use std::io::{self, Write};

type Named = (&'static str, Column);

impl fmt::Display for MeasurementFile {
    /// The file's text. Numbers are written so that they read back to the last bit; columns without a value are left out.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (key, value) in self.keys.iter() {
            writeln!(f, "# {key}={value}")?;
        }
        for note in &self.notes {
            writeln!(f, "# {note}")?;
        }
        let columns = named(|column| self.writes(column));
        writeln!(f, "{}", header(&columns))?;
        for row in &self.rows {
            writeln!(f, "{}", line(&columns, row))?;
        }
        Ok(())
    }
}

impl MeasurementFile {
    fn writes(&self, column: Column) -> bool {
        match column {
            Column::Time => !self.keys.is_steady(),
            Column::Voltage(_) => true,
            Column::Current(_) => {
                (0..ACTUATORS).any(|actuator| self.any(Column::Current(actuator)))
            }
            other => self.any(other),
        }
    }

    fn any(&self, column: Column) -> bool {
        self.rows.iter().any(|row| column.value(row).is_some())
    }
}

/// A measurement file that is written as its rows come. Its first line promises a last one, which says how many rows there
/// are: without it, the reader tells that the file was cut short.
#[derive(Debug)]
pub struct Writer<W> {
    output: W,
    columns: Vec<Named>,
    rows: usize,
}

impl<W: Write> Writer<W> {
    /// Begins a file with these keys. Its rows may have what `like` has: columns cannot be added later.
    ///
    /// # Errors
    /// What `output` says.
    pub fn begin(mut output: W, keys: &Keys, like: &Row) -> io::Result<Self> {
        writeln!(output, "# {ENDS_WITH}={ROWS}")?;
        for (key, value) in keys.iter() {
            writeln!(output, "# {key}={value}")?;
        }
        let columns = named(|column| column.value(like).is_some());
        writeln!(output, "{}", header(&columns))?;
        Ok(Self {
            output,
            columns,
            rows: 0,
        })
    }

    /// Appends a row.
    ///
    /// # Errors
    /// What the output says.
    pub fn row(&mut self, row: &Row) -> io::Result<()> {
        writeln!(self.output, "{}", line(&self.columns, row))?;
        self.rows += 1;
        Ok(())
    }

    /// How many rows were appended.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Hands on what is still held back.
    ///
    /// # Errors
    /// What the output says.
    pub fn flush(&mut self) -> io::Result<()> {
        self.output.flush()
    }

    /// Ends the file; `partial` says why the measurement is not whole.
    ///
    /// # Errors
    /// What the output says.
    pub fn finish(mut self, partial: Option<&str>) -> io::Result<()> {
        if let Some(partial) = partial {
            let mut keys = Keys::default();
            keys.set("partial", partial);
            writeln!(
                self.output,
                "# partial={}",
                keys.get("partial").unwrap_or_default()
            )?;
        }
        writeln!(self.output, "# {ROWS}={}", self.rows)?;
        self.output.flush()
    }
}

fn named(writes: impl Fn(Column) -> bool) -> Vec<Named> {
    let columns = COLUMNS.iter().copied();
    columns.filter(|&(_, column)| writes(column)).collect()
}

fn header(columns: &[Named]) -> String {
    let names: Vec<_> = columns.iter().map(|(name, _)| *name).collect();
    names.join(",")
}

fn line(columns: &[Named], row: &Row) -> String {
    let cell = |column: Column| {
        column
            .value(row)
            .map(|value| format!("{value:?}"))
            .unwrap_or_default()
    };
    let cells: Vec<_> = columns.iter().map(|(_, column)| cell(*column)).collect();
    cells.join(",")
}
