//! What can be asked and what is sent unasked.

#![allow(
    unsafe_code,
    reason = "`endpoints!` and `topics!` make keys from bytes"
)]

use postcard_rpc::{TopicDirection, endpoints, topics};

use crate::{
    CalibrationChunk, CalibrationInfo, CalibrationQuery, CalibrationRefusal, CalibrationUse,
    Commanded, Drives, Hello, Identity, LogPage, LogQuery, MakeUp, Play, Points, Position, Refusal,
    Renewal, Sense, SenseInfo, SetPose, Status, Stream, Streaming, TelemetryBatch,
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

endpoints! {
    list = ENDPOINTS;
    omit_std = true;
    | EndpointTy          | RequestTy | ResponseTy   | Path                  |
    | ----------          | --------- | ----------   | ----                  |
    | HelloEndpoint       | Hello     | Identity     | "mirror/hello"        |
    | StatusEndpoint      | ()        | StatusReply  | "mirror/status"       |
    | SetPositionEndpoint | Position  | CommandReply | "mirror/set-position" |
    | SetPoseEndpoint     | SetPose   | CommandReply | "mirror/set-pose"     |
    | SetDriveEndpoint    | Drives    | CommandReply | "mirror/set-drive"    |
    | OffEndpoint         | ()        | CommandReply | "mirror/off"          |
    | EnterBootloaderEndpoint | () | EnterBootloaderReply | "mirror/enter-bootloader" |
    | RenewEndpoint       | Renewal   | CommandReply | "mirror/renew"        |
    | ClearEndpoint       | ()        | CommandReply | "mirror/clear"        |
    | MakeUpEndpoint      | MakeUp    | CommandReply | "mirror/make-up"      |
    | StreamEndpoint      | Stream    | StreamReply  | "mirror/stream"       |
    | CalibrationEndpoint | ()        | CalibrationReply | "mirror/calibration" |
    | CalibrationReadEndpoint | CalibrationQuery | CalibrationReadReply | "mirror/calibration/read" |
    | CalibrationWriteEndpoint | CalibrationChunk | CalibrationWriteReply | "mirror/calibration/write" |
    | CalibrationUseEndpoint | CalibrationUse | CalibrationUseReply | "mirror/calibration/use" |
    | CalibrationRevertEndpoint | () | CalibrationReply | "mirror/calibration/revert" |
    | SenseEndpoint       | ()        | SenseReply   | "mirror/sense"        |
    | SetSenseEndpoint    | Sense     | SenseReply   | "mirror/sense/set"    |
    | LoadPointsEndpoint  | Points    | LoadReply    | "mirror/load-points"  |
    | PlayEndpoint        | Play      | StreamReply  | "mirror/play"         |
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
    | TelemetryTopic | TelemetryBatch | "mirror/telemetry" |
}
