//! What can be asked and what is sent unasked.

#![allow(
    unsafe_code,
    reason = "`endpoints!` and `topics!` make keys from bytes"
)]

use postcard_rpc::{TopicDirection, endpoints, topics};

use crate::{
    CalibrationChunk, CalibrationInfo, CalibrationQuery, CalibrationRefusal, CalibrationUse,
    Commanded, Compensate, Drives, Hello, Identity, LogPage, LogQuery, Play, Points, Position,
    Refusal, Renewal, Sense, SenseInfo, SetPose, Status, Stream, Streaming, TelemetryBatch,
};

/// Answer to a command that changes the drives.
pub type CommandReply = Result<Commanded, Refusal>;
/// Answer to [`StatusEndpoint`].
pub type StatusReply = Result<Status, Refusal>;
/// Answer to [`FaultLogEndpoint`].
pub type FaultLogReply = Result<LogPage, Refusal>;
/// Answer to [`LoadPointsEndpoint`].
pub type LoadReply = Result<(), Refusal>;
/// Answer to [`StreamEndpoint`] and [`PlayEndpoint`].
pub type StreamReply = Result<Streaming, Refusal>;
/// Answer to [`EnterBootloaderEndpoint`]: the board turns its channels off, answers, and leaves.
pub type EnterBootloaderReply = Result<(), Refusal>;
/// Answer to [`CalibrationEndpoint`] and [`CalibrationRevertEndpoint`]: the calibration in use.
pub type CalibrationReply = Result<CalibrationInfo, Refusal>;
/// Answer to [`CalibrationReadEndpoint`]: the piece, empty from the end on.
pub type CalibrationReadReply = Result<CalibrationChunk, Refusal>;
/// Answer to [`CalibrationWriteEndpoint`].
pub type CalibrationWriteReply = Result<(), Refusal>;
/// Answer to [`CalibrationUseEndpoint`]: the calibration that is now in use.
pub type CalibrationUseReply = Result<CalibrationInfo, CalibrationRefusal>;
/// Answer to [`SenseEndpoint`] and [`SetSenseEndpoint`]: what is in use.
pub type SenseReply = Result<SenseInfo, Refusal>;

// The comment above a line is what docs/reference/protocol.md says of it (`tests/page.rs`).
endpoints! {
    list = ENDPOINTS;
    omit_std = true;
    | EndpointTy          | RequestTy | ResponseTy   | Path                  |
    | ----------          | --------- | ----------   | ----                  |
    // Comes first: either side says which version it speaks, and the board who it is.
    | HelloEndpoint       | Hello     | Identity     | "mirror/hello"        |
    // Tells how the board is at this moment.
    | StatusEndpoint      | ()        | StatusReply  | "mirror/status"       |
    // Moves the plate to a piston position.
    | SetPositionEndpoint | Position  | CommandReply | "mirror/set-position" |
    // Moves and tilts the plate.
    | SetPoseEndpoint     | SetPose   | CommandReply | "mirror/set-pose"     |
    // Drives each actuator with a voltage.
    | SetDriveEndpoint    | Drives    | CommandReply | "mirror/set-drive"    |
    // Turns all channels off.
    | OffEndpoint         | ()        | CommandReply | "mirror/off"          |
    // Turns all channels off, and leaves for the bootloader; refused by boards that have none.
    | EnterBootloaderEndpoint | () | EnterBootloaderReply | "mirror/enter-bootloader" |
    // Extends the lease of what is driven.
    | RenewEndpoint       | Renewal   | CommandReply | "mirror/renew"        |
    // Clears what has tripped, and checks the heaters anew; a healthy board drives on.
    | ClearEndpoint       | ()        | CommandReply | "mirror/clear"        |
    // Has positions compensated for the surroundings, or not.
    | CompensateEndpoint  | Compensate | CommandReply | "mirror/compensate"  |
    // Sends samples from now on; they come as `mirror/telemetry`.
    | StreamEndpoint      | Stream    | StreamReply  | "mirror/stream"       |
    // Tells the calibration in use.
    | CalibrationEndpoint | ()        | CalibrationReply | "mirror/calibration" |
    // Reads a piece of the calibration that was last put to use for good; an empty one from its end on.
    | CalibrationReadEndpoint | CalibrationQuery | CalibrationReadReply | "mirror/calibration/read" |
    // Uploads a piece of a calibration.
    | CalibrationWriteEndpoint | CalibrationChunk | CalibrationWriteReply | "mirror/calibration/write" |
    // Puts to use what was uploaded, for good or on trial.
    | CalibrationUseEndpoint | CalibrationUse | CalibrationUseReply | "mirror/calibration/use" |
    // Ends a trial.
    | CalibrationRevertEndpoint | () | CalibrationReply | "mirror/calibration/revert" |
    // Tells what the current sense is taken to be off by.
    | SenseEndpoint       | ()        | SenseReply   | "mirror/sense"        |
    // Sets that, turns all channels off, and keeps it beside the calibration.
    | SetSenseEndpoint    | Sense     | SenseReply   | "mirror/sense/set"    |
    // Writes points into the board's table, for waveforms that are tables.
    | LoadPointsEndpoint  | Points    | LoadReply    | "mirror/load-points"  |
    // Plays a waveform from the tick after the first sample, and sends samples.
    | PlayEndpoint        | Play      | StreamReply  | "mirror/play"         |
    // Reads an entry of the fault log.
    | FaultLogEndpoint    | LogQuery  | FaultLogReply | "mirror/fault-log"   |
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
    | TopicTy        | MessageTy      | Path               |
    | -------        | ---------      | ----               |
    // Samples of a stream, those that waited for the link.
    | TelemetryTopic | TelemetryBatch | "mirror/telemetry" |
}
