//! `status --history`: the board's fault log.

use std::fmt;

use mirror_protocol::{LogEntry, LogEvent, LogPage, LogStorage, ResetCause, StartEvent, TripEvent};
use serde::Serialize;

use crate::names::fault_name;
use crate::report::{decimal, row, row_of_known};

/// What the board remembers of its starts and trips.
#[derive(Serialize)]
pub(super) struct History {
    /// Which start of the board this one is, counted from 1.
    boot: u32,
    /// Trips since this start.
    trips: u32,
    /// Whether entries are kept: `kept`, `no-flash`, `worn-out`.
    storage: &'static str,
    /// The newest first.
    entries: Vec<HistoryEntry>,
}

#[derive(Serialize)]
struct HistoryEntry {
    number: u32,
    boot: u32,
    #[serde(flatten)]
    event: Event,
}

#[derive(Serialize)]
#[serde(rename_all = "lowercase")]
enum Event {
    Start(Start),
    Trip(Box<Trip>),
    /// Firmware of another version wrote it.
    Unknown(()),
}

#[derive(Serialize)]
struct Start {
    cause: &'static str,
    /// What had stopped the firmware, if anything had.
    fault: Option<&'static str>,
    /// What the firmware said then.
    said: String,
    /// Starts right before this one that have no entry.
    skipped: u32,
}

#[derive(Serialize)]
struct Trip {
    up_s: f64,
    /// Channel by channel.
    faults: [Option<&'static str>; 4],
    /// The how manieth of the same faults since the start.
    times: u32,
    drive_v: [f64; 4],
    current_a: [f64; 4],
    temperature_rise_k: [Option<f64>; 4],
    /// V / I of each heater, where it was driven enough to tell.
    resistance_ohm: [Option<f64>; 4],
    supply_v: f64,
    missed_ticks: u32,
}

impl History {
    pub(super) fn new((page, entries): (LogPage, Vec<LogEntry>)) -> Self {
        Self {
            boot: page.boot,
            trips: page.trips,
            storage: match page.storage {
                LogStorage::Kept => "kept",
                LogStorage::NoFlash => "no-flash",
                LogStorage::WornOut => "worn-out",
            },
            entries: entries.into_iter().map(HistoryEntry::from).collect(),
        }
    }
}

impl From<LogEntry> for HistoryEntry {
    fn from(entry: LogEntry) -> Self {
        let event = match LogEvent::of(&entry) {
            Some(LogEvent::Start(start)) => Event::Start(start.into()),
            Some(LogEvent::Trip(trip)) => Event::Trip(Box::new(trip.into())),
            None => Event::Unknown(()),
        };
        Self {
            number: entry.number,
            boot: entry.boot,
            event,
        }
    }
}

impl From<StartEvent> for Start {
    fn from(start: StartEvent) -> Self {
        Self {
            cause: match start.cause {
                ResetCause::Power => "power",
                ResetCause::Pin => "reset pin",
                ResetCause::Firmware => "firmware",
                ResetCause::Watchdog => "watchdog",
                ResetCause::OptionBytes => "option bytes",
                ResetCause::Other => "other",
            },
            fault: start.stop.map(fault_name),
            said: start.said.as_str().to_owned(),
            skipped: start.skipped,
        }
    }
}

impl From<TripEvent> for Trip {
    fn from(trip: TripEvent) -> Self {
        let (drive_v, current_a) = (trip.drive_v.map(decimal), trip.current_a.map(decimal));
        let temperature_rise_k = trip.temperature_k.map(|rise| rise.map(decimal));
        let resistance = |i: usize| temperature_rise_k[i].map(|_| drive_v[i] / current_a[i]);
        Self {
            up_s: trip.up_us as f64 * 1e-6,
            faults: trip.faults.map(|fault| fault.map(fault_name)),
            times: trip.times,
            resistance_ohm: std::array::from_fn(resistance),
            drive_v,
            current_a,
            temperature_rise_k,
            supply_v: decimal(trip.supply_v),
            missed_ticks: trip.missed_ticks,
        }
    }
}

impl fmt::Display for History {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let storage = match self.storage {
            "kept" => "kept in flash",
            "no-flash" => {
                "nothing is kept: the board has no flash for it (its chip is set to one bank)"
            }
            _ => "nothing new is kept: the flash for it is worn out",
        };
        writeln!(
            f,
            "history    boot {}, trips in it: {}; {storage}",
            self.boot, self.trips
        )?;
        for HistoryEntry { boot, event, .. } in &self.entries {
            match event {
                Event::Start(start) => writeln!(f, "boot {boot:<5} {start}")?,
                Event::Trip(trip) => write!(f, "boot {boot:<5} {trip}")?,
                Event::Unknown(()) => {
                    writeln!(f, "boot {boot:<5} an entry of firmware of another version")?;
                }
            }
        }
        Ok(())
    }
}

impl fmt::Display for Start {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cause = match self.cause {
            "power" => "when its power came",
            "reset pin" => "by its reset pin",
            "firmware" => "by its firmware",
            "watchdog" => "by its watchdog",
            "option bytes" => "to load its option bytes",
            _ => "for another reason",
        };
        write!(f, "started {cause}")?;
        if let Some(fault) = self.fault {
            write!(f, ", after {fault}")?;
        }
        if !self.said.is_empty() {
            write!(f, ": {}", self.said.replace('\n', " "))?;
        }
        if self.skipped > 0 {
            let skipped = self.skipped;
            write!(
                f,
                "; {skipped} starts before it, in quick succession, are left out"
            )?;
        }
        Ok(())
    }
}

impl Trip {
    /// The faults with their channels; one that is on all of them is the board's.
    fn faults_words(&self) -> String {
        let mut words: Vec<String> = Vec::new();
        let mut named: Vec<&str> = Vec::new();
        for fault in self.faults.into_iter().flatten() {
            if named.contains(&fault) {
                continue;
            }
            named.push(fault);
            let channels: Vec<String> = (1..)
                .zip(self.faults)
                .filter(|(_, of)| *of == Some(fault))
                .map(|(channel, _): (u32, _)| channel.to_string())
                .collect();
            words.push(match &*channels {
                [_, _, _, _] => fault.to_owned(),
                [channel] => format!("{fault} on channel {channel}"),
                _ => format!("{fault} on channels {}", channels.join(" and ")),
            });
        }
        words.join(", ")
    }
}

impl fmt::Display for Trip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tripped at {:.3} s: {}", self.up_s, self.faults_words())?;
        if self.times > 1 {
            write!(f, ", for the {}. time", self.times)?;
        }
        let missed = self.missed_ticks;
        writeln!(f, "; supply {:.2} V, ticks missed: {missed}", self.supply_v)?;
        let current_ma = self.current_a.map(|current| current * 1e3);
        let rises_k = row_of_known(self.temperature_rise_k, 1, "K");
        writeln!(f, "           {}", row(self.drive_v, 3, "V"))?;
        writeln!(f, "           {}", row(current_ma, 3, "mA"))?;
        writeln!(f, "           {rises_k}")?;
        writeln!(
            f,
            "           {}",
            row_of_known(self.resistance_ohm, 1, "Ω")
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_protocol::{Excerpt, LOG_FORMAT};
    use protection::Fault;

    fn entry(number: u32, boot: u32, event: Option<LogEvent>) -> LogEntry {
        let format = event.as_ref().map_or(LOG_FORMAT + 1, |_| LOG_FORMAT);
        LogEntry {
            number,
            boot,
            format,
            bytes: event.map(|event| event.to_bytes()).unwrap_or_default(),
        }
    }

    #[test]
    fn is_printed_as_in_the_golden_file() {
        let hot = Some(Fault::OverTemperature.code());
        let trip = |faults, times| {
            Some(LogEvent::Trip(TripEvent {
                up_us: 12_345_000,
                faults,
                times,
                drive_v: [3.5, 0.2, 0.0, 3.5],
                current_a: [5e-3, 0.55e-3, 0.0, 6e-3],
                temperature_k: [Some(210.5), Some(0.7), None, Some(120.0)],
                supply_v: 5.004,
                missed_ticks: 2,
            }))
        };
        let start = |cause, stop: Option<Fault>, said: &str, skipped| {
            Some(LogEvent::Start(StartEvent {
                cause,
                stop: stop.map(Fault::code),
                said: Excerpt::try_from(said).expect("short"),
                skipped,
            }))
        };
        let panic = Some(Fault::FirmwarePanic);
        let entries = vec![
            entry(20, 31, trip([None, hot, None, hot], 4)),
            entry(19, 31, start(ResetCause::Pin, None, "", 0)),
            entry(18, 30, trip([panic.map(Fault::code); 4], 1)),
            entry(
                17,
                30,
                start(
                    ResetCause::Firmware,
                    panic,
                    "panicked at src/a.rs:1:1:\nx",
                    9,
                ),
            ),
            entry(15, 20, None),
            entry(14, 1, start(ResetCause::Power, None, "", 0)),
        ];
        let page = LogPage {
            boot: 31,
            trips: 5,
            storage: LogStorage::Kept,
            entry: None,
        };
        let history = History::new((page, entries));
        assert_eq!(
            history.to_string(),
            include_str!("../../tests/golden/history.txt")
        );
        let json = serde_json::to_value(&history).expect("numbers and text");
        let trip = &json["entries"][0]["trip"];
        assert_eq!(trip["faults"][1], "over-temperature");
        assert_eq!(trip["resistance_ohm"][0], 700.0);
        assert_eq!(json["entries"][3]["start"]["skipped"], 9);
        assert_eq!(json["entries"][4]["unknown"], serde_json::Value::Null);
    }
}
