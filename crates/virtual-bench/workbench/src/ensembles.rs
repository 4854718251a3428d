//! The null ensembles that ship, so that nobody waits for them: of the standard session, as `host-tool measure session` makes it on every
//! mirror, and of the sessions of `data/hidden`, which the pages diagnose.

use std::fs;
use std::path::Path;

use anyhow::{Result, anyhow};
use diagnosis::NullEnsemble;
use identification::Dataset;
use measurement::Session;
use virtual_mirror::MirrorConfig;
use xtask::cargo::workspace;

use crate::story::Person;

/// Where the diagnosis has them.
const FOLDER: &str = "crates/lab/diagnosis/src/null_ensemble";
const SESSION: &str = "session";
/// One of those of `data/hidden`, which are all alike in what an ensemble depends on.
const HIDDEN: &str = "data/hidden/06";

/// Measures a standard session, and writes the ensembles anew.
pub(crate) fn write() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let person = Person::sit_down(&MirrorConfig::bench(), folder.path())?;
    person.types(&format!("host-tool measure session -o {SESSION}"))?;
    write_one("standard", &person.path(SESSION))?;
    write_one("hidden", &workspace().join(HIDDEN))
}

fn write_one(name: &str, session: &Path) -> Result<()> {
    let session = Session::load(&[session])?;
    let file = NullEnsemble::file(&Dataset::new(&session)).map_err(|error| anyhow!(error))?;
    let path = format!("{FOLDER}/{name}.bin");
    fs::write(workspace().join(&path), &file)?;
    println!("written: {path}, {} bytes", file.len());
    Ok(())
}
