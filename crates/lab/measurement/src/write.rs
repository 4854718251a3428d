//! From rows to text.

use crate::column::{COLUMNS, Column};
use crate::{ACTUATORS, MeasurementFile};
use std::fmt;

impl fmt::Display for MeasurementFile {
    /// The file's text. Numbers are written so that they read back to the last bit; columns without a value are left out.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (key, value) in self.keys.iter() {
            writeln!(f, "# {key}={value}")?;
        }
        for note in &self.notes {
            writeln!(f, "# {note}")?;
        }
        let columns: Vec<_> = COLUMNS
            .iter()
            .filter(|(_, column)| self.writes(*column))
            .collect();
        let names: Vec<_> = columns.iter().map(|(name, _)| *name).collect();
        writeln!(f, "{}", names.join(","))?;
        for row in &self.rows {
            let cell = |column: Column| {
                column
                    .value(row)
                    .map(|value| format!("{value:?}"))
                    .unwrap_or_default()
            };
            let cells: Vec<_> = columns.iter().map(|(_, column)| cell(*column)).collect();
            writeln!(f, "{}", cells.join(","))?;
        }
        Ok(())
    }
}

impl MeasurementFile {
    fn writes(&self, column: Column) -> bool {
        match column {
            Column::Time | Column::Voltage(_) => true,
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
