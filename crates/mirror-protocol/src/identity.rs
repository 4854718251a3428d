//! The greeting, whose shape is frozen: it must be understood across protocol versions.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A short text.
pub type Text = heapless::String<32>;

/// How the tool introduces itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Hello {
    /// The tool's [`PROTOCOL_VERSION`](crate::PROTOCOL_VERSION).
    pub protocol_version: u16,
}

/// Who the board is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Identity {
    /// The board's [`PROTOCOL_VERSION`](crate::PROTOCOL_VERSION).
    pub protocol_version: u16,
    /// Firmware version, as in its Cargo.toml.
    pub firmware_version: Text,
    /// What the firmware was built from: commit and profile.
    pub build: Text,
    /// The hardware.
    pub board: Board,
    /// Control ticks a second.
    pub tick_hz: u32,
}

/// The boards that the firmware runs on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Board {
    /// The driver PCB with an STM32G474RE.
    Stm32g474,
    /// An MPS2-AN386 in QEMU, in front of a virtual mirror.
    EmulatedMps2,
}

impl Board {
    /// The name that people see.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stm32g474 => "STM32G474RE driver board",
            Self::EmulatedMps2 => "emulated MPS2-AN386 with a virtual mirror",
        }
    }
}
