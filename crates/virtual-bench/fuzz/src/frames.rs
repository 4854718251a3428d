//! Frames to the firmware's own server, over the USB bus in memory.

use std::cell::Cell;

use embassy_futures::select::select;
use embassy_futures::yield_now;
use firmware_on_host::{enumerate, with_board};
use mirror_protocol::{
    Drives, ENDPOINTS, Hello, HelloEndpoint, PROTOCOL_VERSION, Position, SetDriveEndpoint,
    SetPositionEndpoint,
};
use postcard_rpc::header::{VarHeader, VarKey, VarSeq};
use postcard_rpc::{Endpoint, Key};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use virtual_usb::MAX_PACKET_BYTES;

use crate::mutate::mutated;

/// Cases that one board takes, one after the other.
pub(crate) const CASES_A_BOARD: u64 = 1000;

/// Cases after which the board must still answer a greeting.
const CASES_A_GREETING: u64 = 20;

/// The board's ticks within which it must.
const PATIENCE_TICKS: u32 = 100_000;

/// The sequence number of the greetings that must be answered.
const GREETING: u16 = 0xbeef;

/// A greeting, two commands, and every endpoint with bytes of any length behind it.
pub(crate) fn seeds() -> Vec<Vec<u8>> {
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut seeds = vec![
        greeting(1),
        frame(
            SetPositionEndpoint::REQ_KEY,
            2,
            &Position {
                z_um: 50.0,
                lease_ms: 1000,
            },
        ),
        frame(
            SetDriveEndpoint::REQ_KEY,
            3,
            &Drives {
                drive_v: [1.0; 4],
                lease_ms: 1000,
            },
        ),
    ];
    for (_, request, _) in ENDPOINTS.endpoints {
        for length in [0, 1, 5, 17, 64, 200] {
            let mut seed = frame(*request, 4, &());
            seed.extend((0..length).map(|_| rng.random::<u8>()));
            seeds.push(seed);
        }
    }
    seeds
}

/// Has one board take the cases from `first` on.
pub(crate) fn run(seeds: &[Vec<u8>], first: u64, count: u64, case: &Cell<u64>) {
    with_board(async |host| {
        let device = enumerate(&host).await.expect("it enumerates");
        let (out, in_) = device.endpoints;
        let answered = Cell::new(false);
        let fetch = async {
            loop {
                let packet = host.bulk_in(in_).await.expect("the board is there");
                let header = VarHeader::take_from_slice(&packet).map(|(header, _)| header.seq_no);
                if header == Some(VarSeq::Seq2(GREETING)) {
                    answered.set(true);
                }
            }
        };
        let send = async |frame: &[u8]| {
            for packet in frame.chunks(MAX_PACKET_BYTES) {
                host.bulk_out(out, packet)
                    .await
                    .expect("the board is there");
            }
            if frame.len().is_multiple_of(MAX_PACKET_BYTES) {
                host.bulk_out(out, &[]).await.expect("the board is there");
            }
        };
        let cases = async {
            for number in first..first + count {
                case.set(number);
                let mut rng = ChaCha8Rng::seed_from_u64(number);
                send(&mutated(seeds, &mut rng)).await;
                if number % CASES_A_GREETING == 0 {
                    answered.set(false);
                    send(&greeting(GREETING)).await;
                    for _ in 0..PATIENCE_TICKS {
                        if answered.get() {
                            break;
                        }
                        yield_now().await;
                    }
                    assert!(answered.get(), "the board does not answer any more");
                }
            }
        };
        select(fetch, cases).await;
    });
}

fn greeting(sequence: u16) -> Vec<u8> {
    let hello = Hello {
        protocol_version: PROTOCOL_VERSION,
    };
    frame(HelloEndpoint::REQ_KEY, sequence, &hello)
}

fn frame(key: Key, sequence: u16, body: &impl serde::Serialize) -> Vec<u8> {
    let header = VarHeader {
        key: VarKey::Key8(key),
        seq_no: VarSeq::Seq2(sequence),
    };
    let mut frame = header.write_to_vec();
    frame.extend(postcard::to_stdvec(body).expect("it serialises"));
    frame
}
