//! What goes into packages: firmware as `host-tool update` takes it, and the tool's manual.

use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::Path;

use anyhow::{Context, Result, anyhow};
use clap::CommandFactory;
use host_tool::cli::Arguments;
use host_tool::update::image::Image;
use host_tool::update::package::{BOARD, Package};

/// Writes what `host-tool update` takes beside an ELF file; what is there already is replaced only by `force`.
pub(crate) fn write(elf: &Path, force: bool) -> Result<()> {
    let bytes = fs::read(elf).with_context(|| format!("reading {}", elf.display()))?;
    let package = packed(Image::from_elf(&bytes)?)?;
    let path = elf.with_extension("update");
    place(&path, &package.to_bytes(), force)?;
    println!(
        "{}: firmware {} ({}), {} bytes for the flash",
        path.display(),
        package.version,
        package.build,
        package.image.bytes().len()
    );
    Ok(())
}

/// The image with what it says of itself, whatever is checked out here.
fn packed(image: Image) -> Result<Package> {
    let (version, build) = image.says().context(
        "the image does not say its version and commit; build it again with `cargo xtask build stm32g474`",
    )?;
    Ok(Package {
        board: BOARD.to_owned(),
        version: version.to_owned(),
        build: build.to_owned(),
        image,
    })
}

fn place(path: &Path, bytes: &[u8], force: bool) -> Result<()> {
    let mut options = OpenOptions::new();
    options.write(true).truncate(true);
    let options = match force {
        true => options.create(true),
        false => options.create_new(true),
    };
    let written = options
        .open(path)
        .and_then(|mut file| file.write_all(bytes));
    written.map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => anyhow!(
            "{} already exists; move it away, or replace it with --force",
            path.display()
        ),
        _ => anyhow!(error).context(format!("writing {}", path.display())),
    })
}

/// Writes a manual page of the tool, and one of each command.
pub(crate) fn write_manual(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder)?;
    clap_mangen::generate_to(Arguments::command(), folder)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_protocol::usb::{IMAGE_MARK, PRODUCT};

    fn image(words: &str) -> Image {
        let mut bytes = 0x2001_8000_u32.to_le_bytes().to_vec();
        bytes.extend((Image::START + 0x101).to_le_bytes());
        bytes.resize(256, 7);
        bytes.extend(PRODUCT.as_bytes());
        bytes.extend(words.as_bytes());
        Image::from_bytes(bytes).expect("a good image")
    }

    #[test]
    fn a_package_is_of_the_version_and_commit_that_its_image_says() {
        let package = packed(image(&format!(
            "Outdated{IMAGE_MARK}0.0.7 9609c1d2;request"
        )));
        let package = package.expect("it says them");
        assert_eq!((&*package.version, &*package.build), ("0.0.7", "9609c1d2"));
        let said = packed(image("Outdated9609c1d2request")).expect_err("it does not");
        assert!(said.to_string().contains("does not say"), "{said}");
    }

    #[test]
    fn a_package_that_is_there_is_replaced_only_where_that_is_asked_for() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.update");
        let is = || fs::read(&path).expect("it is there");
        place(&path, b"one and more", false).expect("nothing is there");
        let said = place(&path, b"two", false).expect_err("it is there");
        assert!(said.to_string().contains("already exists"), "{said}");
        assert_eq!(is(), b"one and more");
        place(&path, b"two", true).expect("it is asked for");
        assert_eq!(is(), b"two");
    }
}
