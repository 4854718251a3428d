//! The emulated board of a package: images and tool are where the package has placed them.

use std::env;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use clap::Parser;
use mirror_emulator::{Arguments, Emulator};

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
        eprintln!("error: {error:#}");
        ExitCode::FAILURE
    })
}

fn run(arguments: &Arguments) -> Result<ExitCode> {
    let program = env::current_exe()
        .and_then(|program| program.canonicalize())
        .context("this program does not know where it is")?;
    let folder = program.parent().context("it lies in a folder")?;
    let image = image(folder, arguments.board);
    ensure!(
        image.is_file(),
        "the firmware's image {} is missing: install the package anew, or use `cargo xtask emulate` in the project's sources",
        image.display()
    );
    mirror_emulator::run(arguments, image, &folder.join("host-tool"))
}

/// Where the package of a program in `folder` has its image of a board.
fn image(folder: &Path, board: Emulator) -> PathBuf {
    let name = match board {
        Emulator::Mps2 => "mps2",
        Emulator::G474 => "stm32g474",
    };
    folder.with_file_name("").join(IMAGES).join(name)
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
        assert_eq!(
            image(Path::new("/usr/bin"), Emulator::Mps2),
            Path::new("/usr/lib/electrothermal-mirror/mps2")
        );
    }
}
