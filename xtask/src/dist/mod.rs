//! What people install: the sources, a wheel and a Debian package, with checksums, and what they are made of.
//!
//! Wheel and Debian package hold the same folders (`bin`, `lib`, `share`): the tool, and the emulated board with the firmware's
//! images, so that whoever has no sources can try all of it too.

mod clean_system;
mod debian;
mod licences;
mod release;
mod sources;
mod wheel;

use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};

use self::release::{CHECKSUMS, LICENCES, NAME, PROGRAMS, Released, copy, said_by};
use crate::cargo::{cargo, run, target_directory};
use crate::images::{self, Board};
use crate::sbom;
use crate::tool;

/// Builds all of it; with `check` installs each on a clean system, and moves a mirror there.
pub(crate) fn build(check: bool) -> Result<()> {
    let place = target_directory().join("dist");
    let tree = place.join("tree");
    let folder = place.join("packages");
    for made in [&tree, &folder] {
        if made.exists() {
            fs::remove_dir_all(made)?;
        }
        fs::create_dir_all(made)?;
    }
    sbom::write(&folder)?;
    fs::write(folder.join(LICENCES), licences::of(&PROGRAMS)?)?;
    fill(&tree, &folder)?;
    let released = Released {
        sources: sources::pack(&folder)?,
        wheel: wheel::build(&tree, &folder)?,
        debian: debian::build(&tree, &place.join("debian"), &folder)?,
        folder,
        tree,
    };
    fs::write(
        released.folder.join(CHECKSUMS),
        checksums(&released.folder)? + "\n",
    )?;
    println!("{}", released.folder.display());
    if check {
        clean_system::try_all(&released)?;
    }
    Ok(())
}

/// Puts programs, images, and what is said of them into `tree`.
fn fill(tree: &Path, said: &Path) -> Result<()> {
    tool::build()?;
    for board in [Board::Mps2, Board::Stm32g474] {
        let image = images::build(board)?;
        let to = tree.join("lib").join(NAME).join(image_name(&image)?);
        copy(&image, &to)?;
        images::check(board)?;
    }
    for name in PROGRAMS {
        run(&mut cargo(&[
            "build",
            "--release",
            "--locked",
            "--package",
            name,
        ]))?;
        let built = target_directory().join("release").join(name);
        copy(&built, &tree.join("bin").join(name))?;
    }
    // What `host-tool update` writes to a driver board.
    let update = images::path(Board::Stm32g474).with_extension("update");
    let to = tree.join("lib").join(NAME).join(image_name(&update)?);
    copy(&update, &to)?;
    tool::write_manual(&tree.join("share/man/man1"))?;
    let documents = tree.join("share/doc").join(NAME);
    for entry in fs::read_dir(said)? {
        let entry = entry?;
        copy(&entry.path(), &documents.join(entry.file_name()))?;
    }
    Ok(())
}

fn image_name(image: &Path) -> Result<&Path> {
    image.file_name().map(Path::new).context("it has a name")
}

/// What `sha256sum --check` reads, of the files in `folder`.
fn checksums(folder: &Path) -> Result<String> {
    let entries = fs::read_dir(folder)?;
    let mut names: Vec<OsString> = entries
        .map(|entry| Ok(entry?.file_name()))
        .collect::<Result<_>>()?;
    names.sort();
    said_by(Command::new("sha256sum").args(names).current_dir(folder))
}
