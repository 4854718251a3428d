//! The greeting, whose shape is frozen: it must be understood across protocol versions.
//!
//! postcard-rpc derives the keys on the wire from every name in these types, so nothing here may be
//! renamed either. `tests/wire.rs` holds keys and bytes.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A short text.
pub type Text = heapless::String<48>;

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
    /// What the firmware was built from: the commit.
    pub build: Text,
    /// The hardware, in words.
    pub board: Text,
    /// Whether the board is emulated, and the mirror on it virtual.
    pub is_emulated: bool,
    /// Control ticks a second.
    pub tick_hz: u32,
}
