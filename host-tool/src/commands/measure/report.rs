//! What a measurement has to say.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

#[derive(Serialize)]
pub(super) struct MeasureReport {
    pub(super) measured: Vec<MeasuredFile>,
    /// Samples that found the link too slow.
    pub(super) dropped_samples: u32,
    pub(super) interrupted: bool,
}

#[derive(Serialize)]
pub(super) struct MeasuredFile {
    pub(super) file: PathBuf,
    pub(super) rows: usize,
    /// Those in which the sensor read nothing.
    pub(super) without_displacement: usize,
}

impl fmt::Display for MeasureReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for measured in &self.measured {
            let (rows, file) = (measured.rows, measured.file.display());
            writeln!(f, "measured   {rows:>6} rows in {file}")?;
            if measured.without_displacement > 0 {
                let without = measured.without_displacement;
                writeln!(
                    f,
                    "           {without:>6} of them without a displacement: the sensor read nothing"
                )?;
            }
        }
        if self.dropped_samples > 0 {
            writeln!(
                f,
                "dropped    {} samples: the link was too slow",
                self.dropped_samples
            )?;
        }
        Ok(())
    }
}
