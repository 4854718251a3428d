//! The emulated board of a package: images and tool are where the package has placed them.

use std::env;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use clap::Parser;
use mirror_emulator::{Arguments, told};

/// The folder of the images, counted from the one above that of this program: `/usr` of a system, or a Python environment.
const IMAGES: &str = "lib/electrothermal-mirror";

/// An emulated driver board with a virtual mirror on it: runs `host-tool` with one command against it, or keeps it up.
#[derive(Parser)]
#[command(version)]
struct CommandLine {
    #[command(flatten)]
    arguments: Arguments,
}

fn main() -> ExitCode {
    let CommandLine { arguments } = CommandLine::parse();
    run(&arguments).unwrap_or_else(|error| {
        eprintln!("error: {}", told(&error));
        ExitCode::FAILURE
    })
}

fn run(arguments: &Arguments) -> Result<ExitCode> {
    let program = env::current_exe()
        .and_then(|program| program.canonicalize())
        .context("this program does not know where it is")?;
    let folder = program.parent().context("it lies in a folder")?;
    mirror_emulator::run(
        arguments,
        |name| image(folder, name),
        &folder.join("host-tool"),
    )
}

/// The image of this name, where the package of a program in `folder` has it.
fn image(folder: &Path, name: &str) -> Result<PathBuf> {
    let image = folder.with_file_name("").join(IMAGES).join(name);
    ensure!(
        image.is_file(),
        "the firmware's image {} is missing: unpack the package whole, with its folder lib, or install it anew; `--board host` \
         needs no image",
        image.display()
    );
    Ok(image)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_one() {
        use clap::CommandFactory;
        CommandLine::command().debug_assert();
    }

    #[test]
    fn images_lie_beside_the_programs() {
        let missing = image(Path::new("/nowhere/bin"), "mps2").expect_err("no such folder");
        let place = "/nowhere/lib/electrothermal-mirror/mps2";
        assert!(missing.to_string().contains(place), "{missing}");
    }
}
