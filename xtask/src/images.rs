//! The firmware's images: building, and their size.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use object::{Object, ObjectSection, SectionKind};

use crate::cargo::{TARGET, cargo, run, target_directory};
use crate::figures;
use crate::panics;
use crate::setup;
use crate::tool;

/// What the driver board's image may take of the microcontroller's 512 KB and 96 KB: of the flash so much that each of the
/// two banks of 256 KB holds one, the second of them besides the 48 KB of fault log and calibrations; a third of the RAM. A calibration has 2.4 KB and
/// is there four times: in use, as uploaded, ready to be exchanged, and to come back when another was only tried.
const FLASH_BUDGET: u64 = 192 * 1024;
const RAM_BUDGET: u64 = 32 * 1024;

/// The boards that there are images for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Board {
    /// The driver PCB with an STM32G474RE, and the Nucleo-G474RE.
    Stm32g474,
    /// MPS2-AN386 in QEMU.
    Mps2,
}

impl Board {
    fn name(self) -> &'static str {
        match self {
            Self::Stm32g474 => "stm32g474",
            Self::Mps2 => "mps2",
        }
    }

    /// The feature that selects it.
    pub fn feature(self) -> String {
        format!("board-{}", self.name())
    }
}

/// The profile of everything that runs on the target, in `Cargo.toml`.
pub const PROFILE: &str = "firmware";

/// Builds the image for `board` and returns its path.
pub fn build(board: Board) -> Result<PathBuf> {
    setup::rust_target(TARGET)?;
    run(cargo(&["build"]).args(words(board)))?;
    Ok(path(board))
}

/// What `cargo build` is told for it.
pub(crate) fn words(board: Board) -> Vec<String> {
    let [profile, name, feature] = [PROFILE, board.name(), &board.feature()];
    [
        "--profile",
        profile,
        "--package",
        "mirror-firmware",
        "--target",
        TARGET,
        "--features",
        feature,
        "--bin",
        name,
    ]
    .map(str::to_owned)
    .into()
}

/// Where the image for `board` is built.
pub fn path(board: Board) -> PathBuf {
    target_directory().join(place(board))
}

/// Where it is in a folder that cargo builds in.
pub(crate) fn place(board: Board) -> PathBuf {
    Path::new(TARGET).join(PROFILE).join(board.name())
}

/// Prints the size of an image that is built, and fails where the driver board's is over its budget or its control tick
/// can panic.
pub fn check(board: Board) -> Result<()> {
    let image = path(board);
    let size = Size::of(&image)?;
    println!("image       flash      static RAM");
    println!(
        "{:<9} {:>7} B       {:>7} B",
        board.name(),
        size.flash,
        size.ram
    );
    match board {
        Board::Stm32g474 => {
            tool::package(&image)?;
            println!("budget    {FLASH_BUDGET:>7} B       {RAM_BUDGET:>7} B");
            if size.flash > FLASH_BUDGET || size.ram > RAM_BUDGET {
                bail!("the image is over its budget");
            }
            figures::check_image(size.flash, size.ram)?;
            panics::check(&image)
        }
        Board::Mps2 => panics::check_that_it_finds_one(&image),
    }
}

/// Bytes that an image takes.
struct Size {
    flash: u64,
    ram: u64,
}

impl Size {
    fn of(elf: &Path) -> Result<Self> {
        let bytes = fs::read(elf).with_context(|| format!("reading {}", elf.display()))?;
        let file = object::File::parse(&*bytes)?;
        let mut size = Self { flash: 0, ram: 0 };
        for section in file.sections() {
            let Some(flags) = panics::flags_in_memory(&section) else {
                continue;
            };
            let in_flash = section.kind() != SectionKind::UninitializedData;
            let in_ram = flags & u64::from(object::elf::SHF_WRITE) != 0;
            size.flash += if in_flash { section.size() } else { 0 };
            size.ram += if in_ram { section.size() } else { 0 };
        }
        Ok(size)
    }
}
