//! The Debian package, by Debian's own programs.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use super::release::{LICENCES, NAME, PROGRAMS, VERSION, copy, said_by, source_date};
use crate::cargo::{run, workspace};

/// What a shell completes by, where Debian's shells look for it.
const COMPLETIONS: [(&str, &str); 3] = [
    ("bash", "usr/share/bash-completion/completions/host-tool"),
    ("zsh", "usr/share/zsh/vendor-completions/_host-tool"),
    ("fish", "usr/share/fish/vendor_completions.d/host-tool.fish"),
];
const RULES: &str = "packaging/70-mirror-driver.rules";

/// Builds it of the tree, in the folder `root`.
pub(super) fn build(tree: &Path, root: &Path, folder: &Path) -> Result<PathBuf> {
    if root.exists() {
        fs::remove_dir_all(root)?;
    }
    fs::create_dir_all(root)?;
    run(Command::new("cp").arg("-a").arg(tree).arg(root.join("usr")))?;
    let rules = workspace().join(RULES);
    copy(
        &rules,
        &root
            .join("usr/lib/udev/rules.d")
            .join(rules.file_name().context("it has a name")?),
    )?;
    for (shell, place) in COMPLETIONS {
        let script =
            said_by(Command::new(tree.join("bin/host-tool")).args(["completions", shell]))?;
        let place = root.join(place);
        fs::create_dir_all(place.parent().context("it lies in a folder")?)?;
        fs::write(place, script + "\n")?;
    }
    let documents = root.join("usr/share/doc").join(NAME);
    let licence = fs::read_to_string(workspace().join("LICENSE-MIT"))?;
    fs::write(
        documents.join("copyright"),
        format!(
            "{licence}\nOr, at your choice, under Apache-2.0: /usr/share/common-licenses/Apache-2.0.\n\
             What else is inside is named with its licences in {LICENCES} beside this file.\n"
        ),
    )?;
    let architecture = said_by(Command::new("dpkg").arg("--print-architecture"))?;
    let libraries = libraries(tree, root).context("`apt-get install dpkg-dev`")?;
    fs::create_dir_all(root.join("DEBIAN"))?;
    fs::write(
        root.join("DEBIAN/control"),
        control(&architecture, &libraries),
    )?;
    let package = folder.join(format!("{NAME}_{VERSION}_{architecture}.deb"));
    run(Command::new("dpkg-deb")
        .args(["--root-owner-group", "--build"])
        .args([root, &package])
        .env("SOURCE_DATE_EPOCH", source_date()?))?;
    Ok(package)
}

/// The packages with the libraries that the programs are linked to, as `Depends` names them.
fn libraries(tree: &Path, root: &Path) -> Result<String> {
    // It wants to be in a source package.
    let sources = root.with_extension("sources");
    fs::create_dir_all(sources.join("debian"))?;
    fs::write(sources.join("debian/control"), format!("Source: {NAME}\n"))?;
    let mut find = Command::new("dpkg-shlibdeps");
    find.arg("-O");
    find.args(PROGRAMS.map(|name| tree.join("bin").join(name)));
    let output = find.current_dir(&sources).output()?;
    let said = String::from_utf8(output.stdout)?;
    let line = said.trim().strip_prefix("shlibs:Depends=");
    line.map(str::to_owned)
        .with_context(|| String::from_utf8_lossy(&output.stderr).into_owned())
}

fn control(architecture: &str, libraries: &str) -> String {
    format!(
        "Package: {NAME}\n\
         Version: {VERSION}\n\
         Architecture: {architecture}\n\
         Maintainer: The {NAME} developers <nobody@localhost>\n\
         Section: electronics\n\
         Priority: optional\n\
         Depends: {libraries}\n\
         Recommends: qemu-system-arm (>= 1:5.2)\n\
         Description: bench tool for electrothermal MEMS mirrors\n \
         Positions a mirror on its driver board without a position sensor, compares it\n \
         with its model, and says which physics the model lacks. With an emulated board\n \
         (mirror-emulator), for which QEMU is recommended.\n"
    )
}
