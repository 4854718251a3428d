//! What a board remembers of its starts and trips, through resets and power cuts.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Ask for an entry of the fault log: the newest whose number is at most this one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct LogQuery {
    /// A number; `u32::MAX` asks for the newest of all.
    pub most: u32,
}

/// The fault log, and the entry that was asked for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct LogPage {
    /// Which start of the board this one is, counted from 1.
    pub boot: u32,
    /// Trips since this start, whether they have an entry or not.
    pub trips: u32,
    /// Whether entries are kept.
    pub storage: LogStorage,
    /// `None`: there is no such entry.
    pub entry: Option<LogEntry>,
}

/// Whether a board keeps its fault log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum LogStorage {
    /// In its flash.
    Kept,
    /// It has no flash that can be used; boots are not counted either.
    NoFlash,
    /// Its flash takes nothing more.
    WornOut,
}

/// An entry of the fault log, as it lies in flash: what the bytes mean is for who reads them, who may know more formats
/// than the board.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct LogEntry {
    /// Its number; they grow, and where a power cut has torn one they have a gap.
    pub number: u32,
    /// The start during which it was written, counted from 1.
    pub boot: u32,
    /// Format of the bytes.
    pub format: u8,
    /// A [`LogEvent`], where the format is [`LOG_FORMAT`].
    pub bytes: LogBytes,
}

/// Format of [`LogEvent::to_bytes`]. Raised with every change of it.
pub const LOG_FORMAT: u8 = 1;

/// An event as bytes.
pub type LogBytes = heapless::Vec<u8, 107>;

/// What happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum LogEvent {
    /// The board started.
    Start(StartEvent),
    /// A fault turned it off.
    Trip(TripEvent),
}

impl LogEvent {
    /// As bytes, in [`LOG_FORMAT`]; none where they do not fit, which the tests of this crate rule out.
    pub fn to_bytes(&self) -> LogBytes {
        let mut bytes = LogBytes::new();
        // There is room for as many bytes as there are.
        let _ = bytes.resize_default(bytes.capacity());
        let length = postcard::to_slice(self, &mut bytes).map_or(0, |used| used.len());
        bytes.truncate(length);
        bytes
    }

    /// What an entry tells; `None` where it has another format, or is none.
    pub fn of(entry: &LogEntry) -> Option<Self> {
        let event = || postcard::from_bytes(&entry.bytes).ok();
        (entry.format == LOG_FORMAT).then(event).flatten()
    }
}

/// A start, and why there was one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StartEvent {
    /// What reset the processor.
    pub cause: ResetCause,
    /// Code of the fault (`protection::Fault`) that had stopped the firmware, if one had.
    pub stop: Option<u8>,
    /// What the firmware said then, as far as it fits.
    pub said: Excerpt,
    /// Starts right before this one that have no entry: they came too fast, one after the other.
    pub skipped: u32,
}

/// The beginning of a sentence.
pub type Excerpt = heapless::String<72>;

/// What resets a processor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ResetCause {
    /// The power came, or came back after it had been too low.
    Power,
    /// The reset pin: a button, or a debugger.
    Pin,
    /// The firmware itself: after a stop, or on its way to the bootloader and back.
    Firmware,
    /// The watchdog.
    Watchdog,
    /// Option bytes were loaded.
    OptionBytes,
    /// Something else.
    Other,
}

/// A trip, and the board in the tick that found the fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TripEvent {
    /// Since the start, us.
    pub up_us: u64,
    /// Codes of the faults (`protection::Fault`), channel by channel.
    pub faults: [Option<u8>; 4],
    /// The how manieth of the same faults since the start this is. The first eight have an entry, and then every one
    /// whose count is a power of two.
    pub times: u32,
    /// Voltages that were driven.
    pub drive_v: [f32; 4],
    /// Currents that were sensed.
    pub current_a: [f32; 4],
    /// Temperatures above ambient that the currents imply, where they imply any.
    pub temperature_k: [Option<f32>; 4],
    /// The output stages' supply.
    pub supply_v: f32,
    /// Control ticks since the start that did not take place.
    pub missed_ticks: u32,
}
