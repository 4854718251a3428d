//! What the instrument can be told and asked.

use quantities::{Length, Span};

use crate::tilted_pose::TiltedPose;

/// What a client says.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Action {
    /// Something that is answered in text.
    Ask(Question),
    Trace(u32, Span),
    ClearStatus,
    SetEventEnable(u8),
    SetServiceEnable(u8),
    SetEnable(Registers, u16),
    Preset,
    Complete,
    Wait,
    Reset,
    SelectBoard(String),
    ReleaseLock,
    SetPosition(Length),
    SetPose(TiltedPose),
    /// In volts.
    SetDrives([f64; 4]),
    SetSettling(Span),
    SetOutput(bool),
    ClearFaults,
}

/// What can be asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Question {
    Identify,
    EventEnable,
    TakeEvent,
    AwaitComplete,
    ServiceEnable,
    StatusByte,
    SelfTest,
    NextError,
    ErrorCount,
    Version,
    Board,
    Boards,
    RequestLock,
    LockOwner,
    Position,
    Pose,
    Drives,
    Settling,
    TraceColumns,
    Calibration,
    TakeStates(Registers),
    States(Registers),
    Enable(Registers),
    Read(Reading),
}

/// What the board's status answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reading {
    IsDriven,
    HasTripped,
    LeastPosition,
    MostPosition,
    MostDrive,
    Drives,
    Currents,
    Temperatures,
    Room,
    Uncertainty,
    SettlesIn,
    Resistances,
    Position,
    Pose,
    Supply,
    Limits,
    Channels,
}

/// The two groups of registers beyond the common ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Registers {
    Questionable,
    Operation,
}
