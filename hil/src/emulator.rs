//! What an emulated board runs on, where a check does the same to each.

use std::path::{Path, PathBuf};
use std::process;

use board_on_host::BoardOnHost;
use emulated_board::{Controls, EmulatedBoard, Stack};
use silicon_twin::served::ServedTwin;

/// Where fault log and calibrations begin in the driver board's flash (docs, storage): the last 48 KB of 512.
const STORED: usize = 464 * 1024;

/// Said of a board on this machine.
const NO_FLASH: &str = "nobody looks into its flash";

/// An emulated board.
pub(crate) enum Emulator {
    /// In QEMU, its flash in a file where a check looks at it.
    Qemu(EmulatedBoard, Option<PathBuf>),
    /// This machine.
    Host(BoardOnHost),
    /// The silicon twin.
    Twin(ServedTwin),
}

impl Emulator {
    pub(crate) fn socket(&self) -> &Path {
        match self {
            Self::Qemu(board, _) => board.socket(),
            Self::Host(board) => board.socket(),
            Self::Twin(twin) => twin.socket(),
        }
    }

    pub(crate) fn controls(&self) -> &Controls {
        match self {
            Self::Qemu(board, _) => board.controls(),
            Self::Host(board) => board.controls(),
            Self::Twin(twin) => twin.controls(),
        }
    }

    pub(crate) fn simulated_s(&self) -> f64 {
        match self {
            Self::Qemu(board, _) => board.simulated_s(),
            Self::Host(board) => board.simulated_s(),
            Self::Twin(twin) => twin.simulated_s(),
        }
    }

    pub(crate) fn stack(&self) -> Option<Stack> {
        match self {
            Self::Qemu(board, _) => board.stack().ok(),
            Self::Host(_) => None,
            Self::Twin(twin) => twin.stack(),
        }
    }

    /// Processes that it runs in: its plant, and those that are no processes, are in this one.
    pub(crate) fn processes(&self) -> Vec<u32> {
        match self {
            Self::Qemu(board, _) => vec![process::id(), board.process_id()],
            Self::Host(_) | Self::Twin(_) => vec![process::id()],
        }
    }

    /// What outlives a reset.
    pub(crate) fn stored(&self) -> Vec<u8> {
        match self {
            Self::Qemu(_, flash) => {
                let flash = flash.as_ref().expect("its flash is in a file");
                std::fs::read(flash).expect("a file")
            }
            Self::Host(_) => panic!("{NO_FLASH}"),
            Self::Twin(twin) => twin
                .with(|twin| twin.chip.memory.flash_bytes()[STORED..].to_vec())
                .expect("it runs"),
        }
    }

    /// What is stored at `at` is damaged: one bit on the board in QEMU, whose flash has no error correction, and two on
    /// the twin, whose flash has.
    pub(crate) fn damage(&self, at: usize) {
        match self {
            Self::Qemu(_, flash) => {
                let mut stored = self.stored();
                stored[at] ^= 1;
                let flash = flash.as_ref().expect("its flash is in a file");
                std::fs::write(flash, stored).expect("the file");
            }
            Self::Host(_) => panic!("{NO_FLASH}"),
            Self::Twin(twin) => twin
                .with(move |twin| twin.chip.damage_flash(STORED + at))
                .expect("it runs"),
        }
    }

    pub(crate) fn wear_out_flash(&self) {
        match self {
            Self::Qemu(board, _) => board.wear_out_flash().expect("a file"),
            Self::Host(_) => panic!("{NO_FLASH}"),
            Self::Twin(twin) => twin
                .with(|twin| twin.chip.wear_out_flash())
                .expect("it runs"),
        }
    }
}
