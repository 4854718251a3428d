//! A program without an installation: fetched by apt, unpacked in the folder of builds, and so in no other package's way.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use super::apt::added;
use super::package::{apt_command, said_in, simulation};
use crate::cargo::{run, unpacked, unpacked_programs};

/// Fetches what an installation of `program`, a package of that name, would add, and unpacks it.
pub(super) fn unpack(program: &str) -> Result<()> {
    let output = simulation(program, &[]).output()?;
    let packages = added(&said_in(&output.stdout));
    ensure!(
        !packages.is_empty(),
        "apt does not say what {program} is made of"
    );
    let folder = unpacked();
    let (archives, root) = (folder.join("archives"), folder.join("root"));
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    for made in [&archives, &root, &unpacked_programs()] {
        fs::create_dir_all(made).with_context(|| format!("making {}", made.display()))?;
    }
    run(apt_command("apt-get", &["download", "-qq"])
        .args(&packages)
        .current_dir(&archives))?;
    for archive in fs::read_dir(&archives)? {
        let mut extract = Command::new("dpkg-deb");
        extract.arg("--extract").arg(archive?.path()).arg(&root);
        ensure!(extract.status()?.success(), "dpkg-deb does not unpack");
    }
    fs::remove_dir_all(&archives)?;
    let start = unpacked_programs().join(program);
    fs::write(&start, script(&root.join("usr/bin").join(program), &root)?)?;
    Ok(fs::set_permissions(&start, Permissions::from_mode(0o755))?)
}

/// Becomes `program`, with the libraries that were unpacked with it.
fn script(program: &Path, root: &Path) -> Result<String> {
    let mut libraries = Vec::new();
    for folder in ["lib", "usr/lib"].map(|below| root.join(below)) {
        let entries = fs::read_dir(&folder).into_iter().flatten();
        let architectures = entries.filter_map(|entry| Some(entry.ok()?.path()));
        libraries.extend(architectures.filter(|path| path.is_dir()));
    }
    let libraries = std::env::join_paths(libraries)?;
    Ok(format!(
        "#!/bin/sh\nLD_LIBRARY_PATH={} exec {} \"$@\"\n",
        quoted(&libraries.to_string_lossy()),
        quoted(&program.to_string_lossy())
    ))
}

/// A word that a shell takes as it is.
fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', r"'\''"))
}
