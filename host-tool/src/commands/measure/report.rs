//! What a measurement has to say.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

#[derive(Serialize)]
pub(super) struct Report {
    pub(super) measured: Vec<MeasuredFile>,
    /// Samples that found the link too slow.
    pub(super) dropped_samples: u32,
    pub(super) interrupted: bool,
}

#[derive(Serialize)]
pub(super) struct MeasuredFile {
    pub(super) file: PathBuf,
    pub(super) rows: usize,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for MeasuredFile { file, rows } in &self.measured {
            writeln!(f, "measured   {rows:>6} rows in {}", file.display())?;
        }
        if self.dropped_samples > 0 {
            writeln!(
                f,
                "dropped    {} samples: the link was too slow",
                self.dropped_samples
            )?;
        }
        if self.interrupted {
            writeln!(f, "interrupted; channels are off")?;
        }
        Ok(())
    }
}
