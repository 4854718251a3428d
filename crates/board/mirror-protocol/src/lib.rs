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

mod calibration;
mod endpoints;
mod fault_log;
mod identity;
mod messages;

pub use calibration::{
    CalibrationChunk, CalibrationInfo, CalibrationQuery, CalibrationRefusal, CalibrationUse, Chunk,
    Kept, Lever, Sense, SenseInfo,
};
pub use endpoints::*;
pub use fault_log::{
    Excerpt, LOG_FORMAT, LogBytes, LogEntry, LogEvent, LogPage, LogQuery, LogStorage, ResetCause,
    StartEvent, TripEvent,
};
pub use identity::{Hello, Identity, Text};
pub use messages::{
    BATCH_SAMPLES, CHUNK_POINTS, ChannelState, Commanded, Compensate, Drives, Health,
    LEASE_FOREVER_MS, Loss, OptionBytes, Play, Points, Pose, Position, Refusal, Renewal, Room,
    Sentence, SetPose, Status, Streaming, Telemetry, TelemetryBatch, Uncertainty,
};
pub use waveforms::{
    Curve, Flaw, POINTS, POSE_POINTS, Quantity, Shape, Stream, Table, Tilt, Trigger, Triggers,
    Waveform,
};

/// The version of everything in this crate but the greeting. Raised with every change on the wire.
pub const PROTOCOL_VERSION: u16 = 12;

/// How long a tool waits for an answer. A board answers within a control tick and the link's time; this is for busy
/// machines with an emulated board on them.
pub const ANSWER_TIMEOUT_MS: u64 = 10_000;

/// Longest frame in either direction, before framing.
pub const MAX_FRAME_BYTES: usize = 336;

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
    /// By these words version and commit are found in an image of the firmware: `0.1.0 9609c1d2;` follows.
    pub const IMAGE_MARK: &str = "this is mirror firmware ";
    /// The microcontroller's own bootloader, which is in its ROM: vendor id of ST.
    pub const BOOTLOADER_VENDOR_ID: u16 = 0x0483;
    /// Product id of the bootloader.
    pub const BOOTLOADER_PRODUCT_ID: u16 = 0xdf11;
    /// Vendor request on endpoint 0 to the device, for which no interface needs to be claimed. Without data it is a
    /// stop; read, it gives a byte that is not 0 once a control tick has carried out every stop so far.
    pub const STOP_REQUEST: u8 = 0x53;
    /// Manufacturer string.
    pub const MANUFACTURER: &str = "mirror-driver";
}
