//! The null ensemble of the standard session, as `host-tool measure session` makes it on every mirror: it ships, so that nobody waits for
//! it.

use std::fs;

use anyhow::{Result, anyhow};
use diagnosis::NullEnsemble;
use identification::Dataset;
use measurement::Session;
use virtual_mirror::MirrorConfig;
use xtask::cargo::workspace;

use crate::story::Person;

/// Where the diagnosis has it.
const ENSEMBLE: &str = "crates/lab/diagnosis/src/null_ensemble/standard.bin";
const SESSION: &str = "session";

/// Measures a standard session, and writes its ensemble anew.
pub(crate) fn write() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let person = Person::sit_down(&MirrorConfig::bench(), folder.path())?;
    person.types(&format!("host-tool measure session -o {SESSION}"))?;
    let session = Session::load(&[person.path(SESSION)])?;
    let file = NullEnsemble::file(&Dataset::new(&session)).map_err(|error| anyhow!(error))?;
    fs::write(workspace().join(ENSEMBLE), &file)?;
    println!("written: {ENSEMBLE}, {} bytes", file.len());
    Ok(())
}
