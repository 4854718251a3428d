//! The emulator without an installation: fetched by apt, unpacked in the folder of builds, and so in no other package's way.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use super::apt::added;
use super::package::{apt_command, said_in, simulation};
use super::qemu::QEMU;
use crate::cargo::{run, target_directory};

/// Where the emulator is started that was unpacked.
pub fn unpacked() -> PathBuf {
    folder().join("bin")
}

/// `cargo clean` takes it away.
fn folder() -> PathBuf {
    target_directory().join("qemu")
}

/// Fetches what an installation would add, and unpacks it.
pub(super) fn unpack() -> Result<()> {
    let output = simulation(QEMU, &[]).output()?;
    let packages = added(&said_in(&output.stdout));
    ensure!(
        !packages.is_empty(),
        "apt does not say what {QEMU} is made of"
    );
    let (archives, root) = (folder().join("archives"), folder().join("root"));
    if folder().exists() {
        fs::remove_dir_all(folder())?;
    }
    for made in [&archives, &root, &unpacked()] {
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
    let start = unpacked().join(QEMU);
    fs::write(&start, script(&root)?)?;
    Ok(fs::set_permissions(&start, Permissions::from_mode(0o755))?)
}

/// Becomes the emulator, with the libraries that were unpacked with it.
fn script(root: &Path) -> Result<String> {
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
        quoted(&root.join("usr/bin").join(QEMU).to_string_lossy())
    ))
}

/// A word that a shell takes as it is.
fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', r"'\''"))
}
