//! The host tool against an emulated board, with images that are built.

use std::path::Path;
use std::process::ExitCode;

use anyhow::Result;
use mirror_emulator::Arguments;
use xtask::images::{self, Board};
use xtask::setup;
use xtask::tool;

/// Runs one command, or reads commands until the input ends.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    let image = |name: &str| match name {
        "mps2" => {
            setup::qemu()?;
            images::build(Board::Mps2)
        }
        _ => images::build(Board::Stm32g474),
    };
    mirror_emulator::run(arguments, image, Path::new(tool::command().get_program()))
}
