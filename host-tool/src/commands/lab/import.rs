//! `import`: a table of another program or instrument as a measurement file.

use std::fmt;
use std::path::PathBuf;

use input_file::MB;
use measurement::import::{Assignment, ImportError, Table, import, with_guesses};
use serde::Serialize;

use crate::cli::Import;
use crate::error::ToolError;
use crate::new_file::NewFile;
use crate::report;
use crate::tables;

/// The most of a table that is read (bytes): a million rows of a dozen columns.
const MOST: u64 = 200 * MB;
/// Rows that a preview shows.
const SHOWN: usize = 3;

/// What became of a table.
#[derive(Serialize)]
struct ImportReport {
    written_as: String,
    columns: Vec<ShownColumn>,
    rows: usize,
    notes: Vec<String>,
    /// The first rows of the measurement file.
    preview: Vec<String>,
    output: Option<PathBuf>,
}

/// A column of the table.
#[derive(Serialize)]
struct ShownColumn {
    name: String,
    /// What it is in the measurement file; none where it is left out.
    is: Option<&'static str>,
    conversion: String,
}

pub(crate) fn run(ask: Import, json: bool) -> Result<(), ToolError> {
    let create = |path| NewFile::create(path, ask.force)?.beside(std::slice::from_ref(&ask.file));
    let output = ask.output.map(create).transpose()?;
    let bytes = input_file::read(&ask.file, MOST)?;
    let of_file = |reason| ToolError::Import {
        file: ask.file.clone(),
        reason,
    };
    let mut table = tables::table(&ask.file, &bytes).map_err(of_file)?;
    let assignments = assignments(&table, &ask.column).map_err(of_file)?;
    if let Some(run) = ask.run {
        table = table.run(&assignments, run).map_err(of_file)?;
    }
    let imported = import(&table, &assignments, ask.settled).map_err(of_file)?;
    let text = imported.file.to_string();
    let shown = |(source, name): (usize, &String)| {
        let assigned = assignments.iter().find(|a| a.source == source);
        ShownColumn {
            name: name.clone(),
            is: assigned.map(Assignment::quantity),
            conversion: assigned.map(Assignment::conversion).unwrap_or_default(),
        }
    };
    let columns = table.names.iter().enumerate().map(shown).collect();
    let data = text.lines().filter(|line| !line.starts_with('#'));
    let preview = data.take(SHOWN + 1).map(str::to_owned).collect();
    let report = ImportReport {
        written_as: table.written.clone(),
        columns,
        rows: imported.file.rows.len(),
        notes: imported.notes,
        preview,
        output: output.map(|output| output.write(&text)).transpose()?,
    };
    report::print(&report, json);
    Ok(())
}

/// What the user says of the columns, and of the others what their names say.
fn assignments(table: &Table, said: &[String]) -> Result<Vec<Assignment>, ImportError> {
    let said: Vec<Assignment> = said
        .iter()
        .map(|text| Assignment::parse(text, table))
        .collect::<Result<_, _>>()?;
    Ok(with_guesses(&said, table))
}

impl fmt::Display for ImportReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.written_as)?;
        for (index, column) in self.columns.iter().enumerate() {
            let ShownColumn {
                name,
                is,
                conversion,
            } = column;
            let is = is.unwrap_or("left out; --column says what it is");
            let number = index + 1;
            writeln!(
                f,
                "  {number:>2} {:<20} {is} {conversion}",
                format!("'{name}'")
            )?;
        }
        writeln!(f, "{} rows:", self.rows)?;
        for line in &self.preview {
            writeln!(f, "  {line}")?;
        }
        for note in &self.notes {
            writeln!(f, "- {note}")?;
        }
        match &self.output {
            Some(path) => writeln!(f, "written to {}", path.display()),
            None => writeln!(f, "nothing is written; -o FILE writes it"),
        }
    }
}
