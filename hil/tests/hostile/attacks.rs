//! What a hostile client does.

use std::io::{Read, Write};
use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::thread;
use std::time::Duration;

use hil::RawLink;
use host_tool::board::framing::encode;
use mirror_protocol::{
    CalibrationChunk, CalibrationRevertEndpoint, CalibrationUse, CalibrationUseEndpoint,
    CalibrationWriteEndpoint, Chunk, ClearEndpoint, Drives, EnterBootloaderEndpoint,
    FaultLogEndpoint, Hello, HelloEndpoint, LoadPointsEndpoint, LogQuery, Play, PlayEndpoint,
    Points, Position, Quantity, RenewEndpoint, Renewal, Sense, SetDriveEndpoint,
    SetPositionEndpoint, SetSenseEndpoint, Shape, StatusEndpoint, Stream, StreamEndpoint, Triggers,
    Waveform,
};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// How long a client holds the board that does nothing.
const HOLDS: Duration = Duration::from_millis(50);
/// From one byte of a slow client to the next.
const SLOW: Duration = Duration::from_millis(1);
/// Clients at once.
const MANY: usize = 16;
/// The longest frame, and the longest run of bytes without an end.
const HUGE: usize = 8 * 1024;

/// A kind of attack. It gives back the link on which commands must go on to work, if there is one.
pub(crate) struct Attack {
    pub(crate) name: &'static str,
    pub(crate) act: fn(&Path, &mut ChaCha8Rng) -> Option<RawLink>,
}

pub(crate) const ATTACKS: [Attack; 9] = [
    Attack {
        name: "random bytes",
        act: |socket, rng| {
            let length = rng.random_range(1..2000);
            sent(socket, &random(rng, length))
        },
    },
    Attack {
        name: "broken COBS",
        act: |socket, rng| {
            let mut link = greeted(socket)?;
            let mut bytes = Vec::new();
            for _ in 0..rng.random_range(1..8) {
                let mut framed = any_request(&mut link, rng);
                let place = rng.random_range(0..framed.len());
                match rng.random_range(0..4) {
                    0 => framed[place] = rng.random(),
                    1 => framed.truncate(place),
                    2 => framed.insert(place, 0),
                    _ => framed.retain(|byte| *byte != 0),
                }
                bytes.extend(framed);
            }
            link.send_bytes(&bytes).ok()?;
            Some(link)
        },
    },
    Attack {
        name: "mutated frames",
        act: |socket, rng| {
            let mut link = greeted(socket)?;
            for _ in 0..rng.random_range(1..8) {
                let framed = any_request(&mut link, rng);
                let mut frame = cobs_decoded(&framed);
                for _ in 0..rng.random_range(1..4) {
                    let place = rng.random_range(0..frame.len());
                    frame[place] = rng.random();
                }
                link.send_bytes(&encode(&frame)).ok()?;
            }
            Some(link)
        },
    },
    Attack {
        name: "absurd requests",
        act: |socket, rng| {
            let mut link = greeted(socket)?;
            for _ in 0..rng.random_range(1..8) {
                let framed = any_request(&mut link, rng);
                link.send_bytes(&framed).ok()?;
            }
            Some(link)
        },
    },
    Attack {
        name: "huge frames",
        act: |socket, rng| {
            let length = rng.random_range(257..HUGE);
            let bytes = random(rng, length);
            match rng.random_bool(0.5) {
                true => sent(socket, &encode(&bytes)),
                false => sent(socket, &vec![1 + bytes[0] % 255; length]),
            }
        },
    },
    Attack {
        name: "a slow client",
        act: |socket, rng| {
            let mut link = greeted(socket)?;
            let framed = any_request(&mut link, rng);
            let end = rng.random_range(1..=framed.len().min(60));
            for byte in &framed[..end] {
                link.send_bytes(&[*byte]).ok()?;
                thread::sleep(SLOW);
            }
            Some(link)
        },
    },
    Attack {
        name: "a half-open client",
        act: |socket, rng| {
            let mut link = connected(socket)?;
            let length = rng.random_range(1..100);
            link.write_all(&random(rng, length)).ok()?;
            let half = [Shutdown::Write, Shutdown::Read][rng.random_range(0..2)];
            link.shutdown(half).ok()?;
            thread::sleep(HOLDS);
            None
        },
    },
    Attack {
        name: "many clients",
        act: |socket, rng| {
            let seeds: Vec<u8> = random(rng, MANY);
            // The queue is short, so most of them wait for their turn.
            thread::scope(|scope| {
                for seed in &seeds {
                    scope.spawn(move || {
                        let mut client = connected(socket)?;
                        let bytes = vec![*seed; 1 + usize::from(*seed) / 4];
                        client.write_all(&bytes).ok()?;
                        client.set_read_timeout(Some(SLOW)).ok()?;
                        client.read(&mut [0; 64]).ok()
                    });
                }
            });
            None
        },
    },
    Attack {
        name: "a client that fetches nothing",
        act: |socket, rng| {
            let mut link = greeted(socket)?;
            let stream = Stream {
                period_ticks: rng.random_range(1..4),
                count: u32::MAX,
                ..Stream::default()
            };
            let request = link.request::<StreamEndpoint>(&stream);
            link.send_bytes(&request).ok()?;
            thread::sleep(HOLDS);
            None
        },
    },
];

fn random(rng: &mut ChaCha8Rng, length: usize) -> Vec<u8> {
    (0..length).map(|_| rng.random()).collect()
}

fn connected(socket: &Path) -> Option<UnixStream> {
    UnixStream::connect(socket).ok()
}

fn sent(socket: &Path, bytes: &[u8]) -> Option<RawLink> {
    let mut link = RawLink::connect(socket).ok()?;
    link.send_bytes(bytes).ok()?;
    Some(link)
}

fn greeted(socket: &Path) -> Option<RawLink> {
    let mut link = sent(socket, &[0])?;
    link.greet(mirror_protocol::PROTOCOL_VERSION).ok()?.ok()?;
    Some(link)
}

/// The frame in what stands on the link, up to its end.
fn cobs_decoded(framed: &[u8]) -> Vec<u8> {
    let mut decoder = host_tool::board::framing::Decoder::default();
    decoder.buffer().extend(framed);
    decoder.next_frame().expect("a whole frame")
}

/// A request of any kind, with numbers that a board must not trust.
fn any_request(link: &mut RawLink, rng: &mut ChaCha8Rng) -> Vec<u8> {
    const ABSURD: [f32; 8] = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        -1.0,
        1e-40,
        3.5,
        100.0,
    ];
    let number = ABSURD[rng.random_range(0..ABSURD.len())];
    let lease_ms = [0, 1, 100, u32::MAX][rng.random_range(0..4)];
    let stream = Stream {
        period_ticks: rng.random_range(0..3),
        count: rng.random_range(0..50),
        ..Stream::default()
    };
    let bytes = random(rng, 192);
    match rng.random_range(0..16) {
        0 => link.request::<HelloEndpoint>(&Hello {
            protocol_version: rng.random(),
        }),
        1 => link.request::<StatusEndpoint>(&()),
        2 => link.request::<SetPositionEndpoint>(&Position {
            z_um: number,
            lease_ms,
        }),
        3 => link.request::<SetDriveEndpoint>(&Drives {
            drive_v: [number; 4],
            lease_ms,
        }),
        4 => link.request::<RenewEndpoint>(&Renewal { lease_ms }),
        5 => link.request::<ClearEndpoint>(&()),
        6 => link.request::<StreamEndpoint>(&stream),
        7 => link.request::<CalibrationWriteEndpoint>(&CalibrationChunk {
            offset: rng.random_range(0..3000),
            bytes: Chunk::from_slice(&bytes).expect("it fits"),
        }),
        8 => link.request::<CalibrationUseEndpoint>(&CalibrationUse::ForGood),
        9 => link.request::<CalibrationRevertEndpoint>(&()),
        10 => link.request::<SetSenseEndpoint>(&Sense {
            zero_a: [number; 4],
            gain: [number; 4],
        }),
        11 => link.request::<LoadPointsEndpoint>(&Points {
            first: rng.random_range(0..600),
            points: (0..64).map(|_| rng.random()).collect(),
        }),
        12 => link.request::<EnterBootloaderEndpoint>(&()),
        13 => link.request::<FaultLogEndpoint>(&LogQuery { most: rng.random() }),
        _ => link.request::<PlayEndpoint>(&Play {
            waveform: Waveform {
                quantity: Quantity::Drive {
                    active: [rng.random(), true, false, rng.random()],
                    others_v: number,
                },
                shape: Shape::Sine {
                    frequency_hz: number,
                },
                offset: number,
                amplitude: number,
                cycles: rng.random_range(0..3),
                ends_off: rng.random(),
                triggers: Triggers {
                    frames: rng.random(),
                    lines: rng.random(),
                },
            },
            stream,
            lease_ms,
        }),
    }
}
