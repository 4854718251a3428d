//! What the matrix asks of a board.

use std::path::Path;

use control_core::Calibration;
use crc::{CRC_32_ISO_HDLC, Crc};
use hil::RawLink;
use mirror_protocol::{
    CalibrationChunk, CalibrationWriteEndpoint, ChannelState, Chunk, FaultLogEndpoint,
    LEASE_FOREVER_MS, LoadPointsEndpoint, LogEvent, LogQuery, PROTOCOL_VERSION, Play, PlayEndpoint,
    Points, Quantity, Refusal, Shape, Status, StatusEndpoint, Stream, Triggers, Waveform,
};
use protection::Fault;
use waveforms::{FULL_SCALE, Table};

use crate::cases::Fast;

pub(crate) fn connect(socket: &str) -> RawLink {
    let mut link = RawLink::connect(Path::new(socket)).expect("the board listens");
    link.greet(PROTOCOL_VERSION).unwrap().unwrap();
    link
}

/// The same calibration as bytes, good ones and bad ones.
pub(crate) struct Calibrations {
    pub(crate) good: Vec<u8>,
}

impl Calibrations {
    pub(crate) fn of(calibration: &Calibration) -> Self {
        Self {
            good: calibration.to_bytes().to_vec(),
        }
    }

    /// With another number at this place among its numbers, and a checksum that fits
    /// (`crates/board/control-core/src/calibration/bytes.rs`).
    pub(crate) fn with_number(&self, place: usize, number: f32) -> Vec<u8> {
        let mut bytes = self.good.clone();
        let start = HEAD_BYTES + 4 * place;
        bytes[start..start + 4].copy_from_slice(&number.to_le_bytes());
        let end = bytes.len() - 4;
        let checksum = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&bytes[..end]);
        bytes[end..].copy_from_slice(&checksum.to_le_bytes());
        bytes
    }

    /// Where the one that was stored last begins; those before it lie below.
    pub(crate) fn newest_in(&self, stored: &[u8]) -> usize {
        let is_here = |start: &usize| stored[*start..].starts_with(&self.good);
        (0..stored.len()).rev().find(is_here).expect("it is stored")
    }
}

/// Letters, format, two labels of 48 bytes, the model's hash.
const HEAD_BYTES: usize = 4 + 2 + 2 * 48 + 8;

/// Drives a sine of 1 to 3 V, 5 Hz.
pub(crate) fn play(link: &mut RawLink) -> Result<(), Refusal> {
    play_shape(link, Shape::Sine { frequency_hz: 5.0 }, 2.0, 1.0)
}

/// Drives between 0 and 3.5 V, too fast for a look at each current.
pub(crate) fn play_fast(link: &mut RawLink, fast: Fast) -> Result<(), Refusal> {
    let shape = match fast {
        Fast::Sine(hz) => Shape::Sine {
            frequency_hz: hz.into(),
        },
        Fast::AllButOne(high) => {
            let points: Vec<i16> = (0..high).map(|_| FULL_SCALE).chain([-FULL_SCALE]).collect();
            let load = Points {
                first: 0,
                points: points.iter().copied().collect(),
            };
            let loaded = link.ask::<LoadPointsEndpoint>(&load).expect("an answer");
            loaded.expect("understood")?;
            Shape::Steps(Table {
                points: high + 1,
                dwell_ticks: 1,
            })
        }
    };
    play_shape(link, shape, 1.75, 1.75)
}

fn play_shape(
    link: &mut RawLink,
    shape: Shape,
    offset: f32,
    amplitude: f32,
) -> Result<(), Refusal> {
    let play = Play {
        waveform: Waveform {
            quantity: Quantity::Drive {
                active: [true; 4],
                others_v: 0.0,
            },
            shape,
            offset,
            amplitude,
            cycles: u32::MAX,
            ends_off: true,
            triggers: Triggers::default(),
        },
        stream: Stream {
            period_ticks: 1,
            ..Stream::default()
        },
        lease_ms: LEASE_FOREVER_MS,
    };
    link.ask::<PlayEndpoint>(&play)
        .expect("an answer")
        .expect("understood")
        .map(drop)
}

/// Lets 0.2 s of the board's time pass.
pub(crate) fn settle(link: &mut RawLink) {
    let tick = |link: &mut RawLink| {
        let status = link.ask::<StatusEndpoint>(&()).expect("an answer");
        status.expect("understood").expect("granted").telemetry.tick
    };
    let start = tick(link);
    while tick(link).wrapping_sub(start) < 2000 {}
}

/// Whether the fault log names the fault in one of its trips.
pub(crate) fn is_logged(link: &mut RawLink, fault: Fault) -> bool {
    let mut most = Some(u32::MAX);
    while let Some(query) = most.map(|most| LogQuery { most }) {
        let page = link.ask::<FaultLogEndpoint>(&query).expect("an answer");
        let Some(entry) = page.expect("understood").expect("greeted").entry else {
            break;
        };
        if let Some(LogEvent::Trip(trip)) = LogEvent::of(&entry)
            && trip.faults.contains(&Some(fault.code()))
        {
            return true;
        }
        most = entry.number.checked_sub(1);
    }
    false
}

/// Writes pieces of a calibration; a board that has restarted in between takes them or not.
pub(crate) fn upload(link: &mut RawLink, from: usize, bytes: &[u8]) {
    for (i, piece) in bytes.chunks(192).enumerate() {
        let chunk = CalibrationChunk {
            offset: (from + 192 * i) as u16,
            bytes: Chunk::from_slice(piece).expect("a piece fits"),
        };
        let _ = link.ask::<CalibrationWriteEndpoint>(&chunk);
    }
}

/// The status once something has happened: a trip, or a restart, after which the board is greeted anew.
pub(crate) fn tripped_or_restarted(link: &mut RawLink) -> Option<Status> {
    match link.ask::<StatusEndpoint>(&()).ok()?.ok()? {
        Err(Refusal::NoHello) => {
            link.greet(PROTOCOL_VERSION).ok()?.ok()?;
            link.ask::<StatusEndpoint>(&()).ok()?.ok()?.ok()
        }
        Err(_) => None,
        Ok(status) => cause(&status).is_some().then_some(status),
    }
}

pub(crate) fn cause(status: &Status) -> Option<Fault> {
    status
        .telemetry
        .states
        .iter()
        .find_map(|state| match state {
            ChannelState::Tripped(code) => Fault::from_code(*code),
            _ => None,
        })
}
