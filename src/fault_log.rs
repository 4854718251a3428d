//! The board's memory of its starts and trips, which outlives resets and power cuts.
//!
//! It is written by the link's side of the application, never within a control tick, and only after the outputs are off:
//! at the start before they are enabled, and after a trip.

use embassy_time::{Duration, Instant};
use fault_log::{Log, MAX_BYTES, Repeats, is_worth_writing};
use mirror_protocol::{
    ChannelState, Excerpt, LOG_FORMAT, LogBytes, LogEntry, LogEvent, LogPage, LogStorage,
    StartEvent, TripEvent,
};

use crate::flash::Part;
use crate::mailbox::Trip;
use crate::origin::Origin;
use crate::resets::Resets;

/// A board that has run for so long is in no loop of resets. Each start and the trip that ended the run before take two
/// entries, so eight pages of 16 entries and 10 000 erasures (DS12288, table 51) last for 640 000 such runs, 12 years.
pub const LONG_RUN: Duration = Duration::from_secs(600);

/// Kinds of trips that are counted apart from each other: half of all faults, on whatever channels.
const KINDS: usize = 8;

/// The fault log, and what was not written into it.
pub struct FaultLog {
    log: Option<Log<Part>>,
    storage: LogStorage,
    resets: &'static Resets,
    boot: u32,
    /// Whether this start is no repetition that is left out, with all that happens in it.
    is_open: bool,
    trips: u32,
    repeats: Repeats<[Option<u8>; 4], KINDS>,
}

impl FaultLog {
    /// Logs the start that came about like this; `flash` is `None` where the board has none that can be used.
    pub fn start(flash: Option<Part>, origin: &Origin) -> Self {
        let log = flash.and_then(Log::open);
        let storage = match log {
            Some(_) => LogStorage::Kept,
            None => LogStorage::NoFlash,
        };
        let resets = origin.resets;
        let in_succession = resets.count();
        let mut this = Self {
            log,
            storage,
            resets,
            boot: 0,
            is_open: is_worth_writing(in_succession),
            trips: 0,
            repeats: Repeats::new(),
        };
        let newest = this.entry(u32::MAX).map_or(0, |entry| entry.boot);
        let skipped = resets.untold();
        this.boot = newest.saturating_add(skipped).saturating_add(1);
        let event = LogEvent::Start(StartEvent {
            cause: origin.cause,
            stop: origin.last_stop.as_ref().map(|stop| stop.fault.code()),
            said: origin
                .last_stop
                .as_ref()
                .map_or(Excerpt::new(), |stop| excerpt(&stop.text)),
            skipped,
        });
        match this.is_open && this.write(&event) {
            true => resets.tell(),
            false => resets.leave_untold(),
        }
        this
    }

    /// Logs a trip, unless the same ones have been logged often enough.
    pub fn trip(&mut self, Trip { telemetry, health }: &Trip, now: Instant) {
        self.trips = self.trips.saturating_add(1);
        let faults = telemetry.states.map(|state| match state {
            ChannelState::Tripped(code) => Some(code),
            _ => None,
        });
        let times = self.repeats.count(faults);
        if self.is_open && is_worth_writing(times) {
            self.write(&LogEvent::Trip(TripEvent {
                up_us: now.as_micros(),
                faults,
                times,
                drive_v: telemetry.drive_v,
                current_a: telemetry.current_a,
                temperature_k: telemetry.temperature_k,
                supply_v: health.supply_v,
                missed_ticks: health.missed_ticks,
            }));
        }
    }

    /// The board has been up for [`LONG_RUN`].
    pub fn end_succession(&mut self) {
        self.is_open = true;
        self.resets.end_succession();
    }

    /// The newest entry whose number is at most `most`, and what is known besides.
    pub fn page(&mut self, most: u32) -> LogPage {
        LogPage {
            boot: self.boot,
            trips: self.trips,
            storage: self.storage,
            entry: self.entry(most),
        }
    }

    fn entry(&mut self, most: u32) -> Option<LogEntry> {
        let mut buffer = [0; MAX_BYTES];
        let (number, entry) = self.log.as_mut()?.newest_up_to(most, &mut buffer)?;
        let (&format, rest) = entry.split_first()?;
        let (&boot, event) = rest.split_first_chunk()?;
        Some(LogEntry {
            number,
            boot: u32::from_le_bytes(boot),
            format,
            bytes: LogBytes::from_slice(event).ok()?,
        })
    }

    /// Whether the entry is kept now. A flash that has failed is not tried again before the next start: it would be worn
    /// further, and for nothing.
    fn write(&mut self, event: &LogEvent) -> bool {
        let (Some(log), LogStorage::Kept) = (&mut self.log, self.storage) else {
            return false;
        };
        let event = event.to_bytes();
        let mut entry = [0; MAX_BYTES];
        let parts = [&[LOG_FORMAT][..], &self.boot.to_le_bytes(), &event];
        let mut length = 0;
        for (slot, byte) in entry.iter_mut().zip(parts.into_iter().flatten()) {
            *slot = *byte;
            length += 1;
        }
        let is_kept = log.append(entry.get(..length).unwrap_or_default()).is_ok();
        if !is_kept {
            self.storage = LogStorage::WornOut;
        }
        is_kept
    }
}

/// The beginning of `text`.
fn excerpt(text: &str) -> Excerpt {
    let mut excerpt = Excerpt::new();
    for character in text.chars() {
        if excerpt.push(character).is_err() {
            break;
        }
    }
    excerpt
}
