//! What people install: the sources, a wheel and a Debian package, with checksums, and what they are made of.
//!
//! Wheel and Debian package hold the same folders (`bin`, `lib`, `share`): the tool, and the emulated board with the firmware's
//! images, so that whoever has no sources can try all of it too.

mod clean_system;
mod debian;
mod licences;
mod sources;
mod wheel;

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::cargo::{cargo, describe, run, target_directory, workspace};
use crate::images::{self, Board};
use crate::sbom;
use crate::tool;

/// What everything is called that is released.
const NAME: &str = "electrothermal-mirror";
const VERSION: &str = env!("CARGO_PKG_VERSION");
/// The programs in it. Each is built by itself, as `cargo install` does.
const PROGRAMS: [&str; 2] = ["host-tool", "mirror-emulator"];
/// What is inside, and under which licences.
const LICENCES: &str = "licences.txt";
const CHECKSUMS: &str = "SHA256SUMS";

/// What was built, in a folder for people.
struct Released {
    folder: PathBuf,
    /// The tree that wheel and Debian package are made of.
    tree: PathBuf,
    sources: PathBuf,
    wheel: PathBuf,
    debian: PathBuf,
}

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

/// Copies a file into a folder that is made where it is missing.
fn copy(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to.parent().context("it lies in a folder")?)?;
    fs::copy(from, to).with_context(|| format!("copying {}", from.display()))?;
    Ok(())
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

/// The time that packages carry: of the commit, so that the same sources make the same packages
/// (<https://reproducible-builds.org/specs/source-date-epoch/>).
fn source_date() -> Result<String> {
    said_by(
        Command::new("git")
            .args(["log", "-1", "--format=%ct"])
            .current_dir(workspace()),
    )
}

/// What a program prints, without the end of its line.
fn said_by(command: &mut Command) -> Result<String> {
    let words = describe(command);
    let output = command.output().with_context(|| format!("`{words}`"))?;
    ensure!(
        output.status.success(),
        "`{words}`: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    Ok(String::from_utf8(output.stdout)?.trim_end().to_owned())
}
