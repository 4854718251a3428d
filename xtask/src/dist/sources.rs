//! The sources as an archive: what `cargo install` needs.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};

use super::release::{NAME, VERSION, source_date};
use crate::cargo::{run, workspace};

/// Packs what the repository holds, as it is now, below a folder of its own name.
pub(super) fn pack(folder: &Path) -> Result<PathBuf> {
    let name = format!("{NAME}-{VERSION}");
    let archive = folder.join(format!("{name}.tar.gz"));
    let mut listed = Command::new("git")
        .args(["ls-files", "-z"])
        .current_dir(workspace())
        .stdout(Stdio::piped())
        .spawn()
        .context("git does not run")?;
    // The same files make the same archive.
    run(Command::new("tar")
        .args(["--create", "--gzip", "--null", "--files-from=-"])
        .args(["--sort=name", "--owner=0", "--group=0", "--numeric-owner"])
        .arg(format!("--mtime=@{}", source_date()?))
        .arg(format!("--transform=s,^,{name}/,"))
        .arg("--file")
        .arg(&archive)
        .stdin(listed.stdout.take().context("piped")?)
        .current_dir(workspace()))?;
    ensure!(listed.wait()?.success(), "git cannot tell the sources");
    Ok(archive)
}
