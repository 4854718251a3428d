//! What the matrix asks of a board.

use std::path::Path;

use hil::RawLink;
use mirror_protocol::{
    CalibrationChunk, CalibrationWriteEndpoint, ChannelState, Chunk, LEASE_FOREVER_MS,
    PROTOCOL_VERSION, Play, PlayEndpoint, Quantity, Refusal, Shape, Status, StatusEndpoint, Stream,
    Waveform,
};
use protection::Fault;

pub(crate) fn connect(socket: &str) -> RawLink {
    let mut link = RawLink::connect(Path::new(socket)).expect("the board listens");
    link.greet(PROTOCOL_VERSION).unwrap().unwrap();
    link
}

/// Drives a sine of 1 to 3 V, 5 Hz.
pub(crate) fn play(link: &mut RawLink) -> Result<(), Refusal> {
    let play = Play {
        waveform: Waveform {
            quantity: Quantity::Drive {
                active: [true; 4],
                others_v: 0.0,
            },
            shape: Shape::Sine { frequency_hz: 5.0 },
            offset: 2.0,
            amplitude: 1.0,
            cycles: u32::MAX,
            ends_off: true,
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
