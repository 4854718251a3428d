//! The worst that a board's stack has to bear, and whether 30 % are to spare then: a calibration uploaded and put to use
//! while a waveform drives all four channels and every tick is streamed, with good and bad requests in between.

use std::path::Path;
use std::process::ExitCode;

use control_core::calibration::BYTES;
use hil::{Bench, RawLink};
use mirror_protocol::{
    CHUNK_POINTS, CalibrationChunk, CalibrationEndpoint, CalibrationUse, CalibrationUseEndpoint,
    CalibrationWriteEndpoint, Chunk, LEASE_FOREVER_MS, LoadPointsEndpoint, PROTOCOL_VERSION, Play,
    PlayEndpoint, Points, Position, Quantity, Sense, SenseEndpoint, SetPositionEndpoint,
    SetSenseEndpoint, Shape, StatusEndpoint, Stream, Triggers, Waveform,
};

/// Of the stack, at most.
const PERCENT: usize = 70;

fn main() -> ExitCode {
    let bench = match hil::is_on_twin() {
        true => Bench::new(),
        false => Bench::changed(|emulation| emulation.has_monitor = true),
    };
    let mut link = RawLink::connect(Path::new(bench.board())).expect("the board listens");
    link.greet(PROTOCOL_VERSION).unwrap().unwrap();
    let bytes = calibration::tabulate(&mirror_model::Model::load("reconciled").expect("a preset"))
        .expect("a calibration")
        .calibration
        .to_bytes();
    for _ in 0..3 {
        work(&mut link, &bytes);
    }
    let stack = bench.stack();
    println!(
        "\nstack: {} of {} bytes used at most, {} % of it; {PERCENT} % are allowed",
        stack.used,
        stack.size,
        100 * stack.used / stack.size
    );
    if stack.used * 100 <= stack.size * PERCENT && stack.used > 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Everything that a tool can ask, on top of each other.
fn work(link: &mut RawLink, calibration: &[u8; BYTES]) {
    let play = Play {
        waveform: Waveform {
            quantity: Quantity::Position,
            shape: Shape::Sine { frequency_hz: 20.0 },
            offset: 80.0,
            amplitude: 70.0,
            cycles: u32::MAX,
            ends_off: true,
            triggers: Triggers::default(),
        },
        stream: Stream {
            period_ticks: 1,
            count: 2000,
            ..Stream::default()
        },
        lease_ms: LEASE_FOREVER_MS,
    };
    let points = Points {
        first: 0,
        points: [1000; CHUNK_POINTS].into_iter().collect(),
    };
    let _ = link.ask::<LoadPointsEndpoint>(&points);
    let _ = link.ask::<PlayEndpoint>(&play);
    for (i, piece) in calibration.chunks(192).enumerate() {
        let chunk = CalibrationChunk {
            offset: (192 * i) as u16,
            bytes: Chunk::from_slice(piece).expect("a piece fits"),
        };
        let _ = link.ask::<CalibrationWriteEndpoint>(&chunk);
        let _ = link.ask::<StatusEndpoint>(&());
        let _ = link.send_bytes(&[0x55; 300]);
        let _ = link.send_bytes(&[0]);
    }
    let used = link
        .ask::<CalibrationUseEndpoint>(&CalibrationUse::ForGood)
        .expect("an answer");
    used.expect("understood").expect("it is good");
    let _ = link.ask::<CalibrationEndpoint>(&());
    let sense = Sense {
        zero_a: [1e-6; 4],
        gain: [1.001; 4],
    };
    let set = link.ask::<SetSenseEndpoint>(&sense).expect("an answer");
    set.expect("understood").expect("plausible");
    let _ = link.ask::<SenseEndpoint>(&());
    // A bad one: its refusal is made of words.
    let _ = link.ask::<CalibrationUseEndpoint>(&CalibrationUse::ForGood);
    let position = Position {
        z_um: 170.0,
        lease_ms: 100,
    };
    let _ = link.ask::<SetPositionEndpoint>(&position);
}
