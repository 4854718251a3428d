//! What the bench tool and the driver board say to each other.
//!
//! Requests and their answers are [postcard-rpc](postcard_rpc) endpoints, measurements in flight are
//! a topic. A session begins with [`HelloEndpoint`]: both sides learn the other's protocol version
//! there, and where they differ, the tool explains itself and the board refuses everything else
//! with [`Refusal::ProtocolVersion`]. Hello and [`Identity`] therefore never change their shape.
//!
//! Quantities are SI but for positions, which are micrometres as everywhere in this project.
#![no_std]

#[cfg(test)]
extern crate std;

mod identity;
mod messages;

pub use identity::{Board, Hello, Identity, Text};
pub use messages::{Commanded, Drives, Position, Refusal, Status, Stream, Telemetry};
use postcard_rpc::{TopicDirection, endpoints, topics};

/// The version of everything in this crate but the greeting. Raised with every change on the wire.
pub const PROTOCOL_VERSION: u16 = 1;

/// Longest frame in either direction, before framing.
pub const MAX_FRAME_BYTES: usize = 256;

/// Path of the answer that stands for "I did not understand" (`WireError`).
pub use postcard_rpc::standard_icd::{ERROR_PATH, WireError};

/// USB identity of the driver board.
pub mod usb {
    /// Vendor id of pid.codes, which lends product ids to open hardware.
    pub const VENDOR_ID: u16 = 0x1209;
    /// The testing id of pid.codes, until the board is given one of its own.
    pub const PRODUCT_ID: u16 = 0x0001;
    /// Product string.
    pub const PRODUCT: &str = "Electrothermal mirror driver";
    /// Manufacturer string.
    pub const MANUFACTURER: &str = "mirror-driver";
}

/// Answer to a command that changes the drives.
pub type CommandReply = Result<Commanded, Refusal>;
/// Answer to [`StatusEndpoint`].
pub type StatusReply = Result<Status, Refusal>;
/// Answer to [`StreamEndpoint`].
pub type StreamReply = Result<(), Refusal>;

endpoints! {
    list = ENDPOINTS;
    omit_std = true;
    | EndpointTy          | RequestTy | ResponseTy   | Path                  |
    | ----------          | --------- | ----------   | ----                  |
    | HelloEndpoint       | Hello     | Identity     | "mirror/hello"        |
    | StatusEndpoint      | ()        | StatusReply  | "mirror/status"       |
    | SetPositionEndpoint | Position  | CommandReply | "mirror/set-position" |
    | SetDriveEndpoint    | Drives    | CommandReply | "mirror/set-drive"    |
    | OffEndpoint         | ()        | CommandReply | "mirror/off"          |
    | StreamEndpoint      | Stream    | StreamReply  | "mirror/stream"       |
}

topics! {
    list = TOPICS_IN;
    direction = TopicDirection::ToServer;
    | TopicTy | MessageTy | Path |
    | ------- | --------- | ---- |
}

topics! {
    list = TOPICS_OUT;
    direction = TopicDirection::ToClient;
    | TopicTy        | MessageTy | Path               |
    | -------        | --------- | ----               |
    | TelemetryTopic | Telemetry | "mirror/telemetry" |
}
