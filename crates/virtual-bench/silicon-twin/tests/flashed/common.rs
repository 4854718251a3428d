//! The flashed image on a twin, and a tool in front of it.

use std::path::Path;
use std::sync::LazyLock;

use crc::{CRC_32_ISO_HDLC, Crc};
use emulated_board::{Connected, Controls};
use mirror_protocol::{
    CalibrationChunk, CalibrationWriteEndpoint, Chunk, Drives, LEASE_FOREVER_MS, SetDriveEndpoint,
    Status, StatusEndpoint,
};
use silicon_twin::board::Board;
use silicon_twin::coverage::{self, Coverage};
use silicon_twin::tool::Tool;
use silicon_twin::{Image, Twin, flashed_image};
use virtual_mirror::MirrorConfig;

/// The factory's calibration as bytes, which another is made of.
const FACTORY: &[u8] = include_bytes!("../../../../../src/factory.bin");
/// Where the hash of its model is: behind letters, format and two labels of 48 bytes
/// (`crates/board/control-core/src/calibration/bytes.rs`).
const HASH_AT: usize = 4 + 2 + 2 * 48;
/// Bytes of a piece that is uploaded.
const PIECE: usize = 192;

/// Leaves what was executed where `cargo xtask bench coverage` looks for it.
pub(crate) fn leave_coverage(twin: &Twin) {
    if let Some(folder) = std::env::var_os(coverage::FOLDER) {
        let mut covered = Coverage::default();
        covered.add(twin);
        covered.save_in(Path::new(&folder)).expect("the folder");
    }
}

/// The image that `cargo xtask flash` writes.
pub(crate) fn image() -> Image {
    let elf = std::fs::read(flashed_image()).expect("an image: `cargo xtask build stm32g474`");
    Image::from_elf(&elf).expect("an image for this chip")
}

/// A board with the bench mirror, when power comes.
pub(crate) fn twin() -> Twin {
    let mirror = Connected::Mirror(Box::new(MirrorConfig::bench()));
    Twin::new(image(), Board::new(&mirror).expect("a mirror")).expect("vectors")
}

/// A tool that has greeted a board that has checked its heaters, which it does a quarter of a second after its start again;
/// on a bench of its own.
pub(crate) fn greeted() -> Tool {
    static GREETED: LazyLock<Tool> = LazyLock::new(greet);
    let mut tool = GREETED.clone();
    tool.twin.chip.board.move_to(Controls::default());
    tool
}

fn greet() -> Tool {
    let mut tool = Tool::new(twin());
    tool.connect().unwrap_or_else(|error| panic!("{error}"));
    tool.twin
        .run_for(0.3)
        .unwrap_or_else(|failure| panic!("{failure}"));
    tool
}

/// Cycles of the processor's clock in a microsecond: 170 MHz.
pub(crate) const CYCLES_PER_US: u64 = 170;

pub(crate) fn status(tool: &mut Tool) -> Status {
    let status = tool.ask::<StatusEndpoint>(&()).expect("an answer");
    status.expect("greeted")
}

/// Drives all channels, until something else is asked for.
pub(crate) fn drive(tool: &mut Tool, volt: f32) {
    let drives = Drives {
        drive_v: [volt; 4],
        lease_ms: LEASE_FOREVER_MS,
    };
    let driven = tool.ask::<SetDriveEndpoint>(&drives).expect("an answer");
    driven.expect("it is driven");
}

/// A calibration by the hash of its model.
fn calibration(hash: u64) -> Vec<u8> {
    let mut bytes = FACTORY.to_vec();
    bytes[HASH_AT..HASH_AT + 8].copy_from_slice(&hash.to_le_bytes());
    let end = bytes.len() - 4;
    let checksum = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&bytes[..end]);
    bytes[end..].copy_from_slice(&checksum.to_le_bytes());
    bytes
}

/// Uploads the calibration with this hash.
pub(crate) fn upload(tool: &mut Tool, hash: u64) {
    for (i, piece) in calibration(hash).chunks(PIECE).enumerate() {
        let chunk = CalibrationChunk {
            offset: (PIECE * i) as u16,
            bytes: Chunk::from_slice(piece).expect("a piece fits"),
        };
        let written = tool.ask::<CalibrationWriteEndpoint>(&chunk);
        written.expect("an answer").expect("it is written");
    }
}
