//! Uploads of calibrations, frame by frame: cut, repeated, in another order, mutated, and of two clients at once. Whatever
//! comes, the board uses one of the calibrations that were sent whole or the one it had, keeps that through a power cut,
//! and answers.
//!
//! A long run tries a hundred times as many.

use std::cell::RefCell;
use std::collections::BTreeMap;

use control_core::Calibration;
use control_core::calibration::{Label, Parts};
use embassy_futures::yield_now;
use firmware_on_host::{Device, FLASH_PAGES, connect, enumerate, send_frame, with_board_on};
use mirror_firmware::factory;
use mirror_protocol::{
    CalibrationChunk, CalibrationEndpoint, CalibrationInfo, CalibrationUse, CalibrationUseEndpoint,
    CalibrationUseReply, CalibrationWriteEndpoint, Chunk, Hello, HelloEndpoint, PROTOCOL_VERSION,
};
use postcard_rpc::Endpoint;
use postcard_rpc::header::{VarHeader, VarKey, VarSeq};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use simulated_flash::{HalfWords, SharedFlash, SimulatedFlash};
use virtual_usb::{HostSide, MAX_PACKET_BYTES};

const UPLOADS: usize = 60;
const UPLOADS_IN_FULL: usize = 6000;
const SEED: u64 = 20_261_122;
/// Boards that take them, one after the other.
const BOARDS: usize = 6;
/// What this process may have more at the end than after the first of the boards (KiB): each board leaves its memory
/// behind, some 15 KiB, and the allocator keeps what it had.
const MEMORY_KIB: u64 = 4096;

fn of_device(device: &str) -> Calibration {
    let mut parts: Parts = *factory::calibration().parts();
    parts.origin.device = Label::new(device).expect("short");
    Calibration::new(parts).expect("only its name is another")
}

fn frame<E: Endpoint>(sequence: u16, message: &E::Request) -> Vec<u8>
where
    E::Request: Serialize,
{
    let header = VarHeader {
        key: VarKey::Key8(E::REQ_KEY),
        seq_no: VarSeq::Seq2(sequence),
    };
    let mut frame = header.write_to_vec();
    frame.extend(postcard::to_stdvec(message).expect("it serialises"));
    frame
}

/// The frames of a whole upload; the last one puts it to use for good.
fn frames(calibration: &Calibration, sequence: u16) -> Vec<Vec<u8>> {
    let bytes = calibration.to_bytes();
    let capacity = Chunk::new().capacity();
    let mut frames: Vec<_> = bytes
        .chunks(capacity)
        .enumerate()
        .map(|(i, piece)| {
            let chunk = CalibrationChunk {
                offset: (i * capacity) as u16,
                bytes: Chunk::from_slice(piece).expect("it fits"),
            };
            frame::<CalibrationWriteEndpoint>(sequence, &chunk)
        })
        .collect();
    frames.push(frame::<CalibrationUseEndpoint>(
        sequence,
        &CalibrationUse::ForGood,
    ));
    frames
}

/// What happens to an upload on its way; it names itself.
fn disturb(frames: &mut Vec<Vec<u8>>, other: &[Vec<u8>], rng: &mut ChaCha8Rng) -> &'static str {
    let any = rng.random_range(0..frames.len());
    match rng.random_range(0..8) {
        0 => "nothing",
        1 => {
            frames.remove(any);
            "a frame is lost"
        }
        2 => {
            let end = rng.random_range(0..frames[any].len());
            frames[any].truncate(end);
            "a frame is cut"
        }
        3 => {
            frames.insert(any, frames[any].clone());
            "a frame comes twice"
        }
        4 => {
            let another = rng.random_range(0..frames.len());
            frames.swap(any, another);
            "two frames change places"
        }
        5 => {
            for _ in 0..rng.random_range(1..4) {
                let place = rng.random_range(0..frames[any].len());
                frames[any][place] ^= 1 << rng.random_range(0..8);
            }
            "bits fall over"
        }
        6 => {
            frames.shuffle(rng);
            "all frames change places"
        }
        _ => {
            // Both clients keep their own order.
            let mut theirs = other.iter();
            let mine = std::mem::take(frames);
            for frame in mine {
                while rng.random_bool(0.5) {
                    frames.extend(theirs.next().cloned());
                }
                frames.push(frame);
            }
            frames.extend(theirs.cloned());
            "two clients at once"
        }
    }
}

/// Sends all of them, lets the board work on them, and returns what it put to use.
async fn upload(host: &HostSide, device: &Device, frames: &[Vec<u8>]) -> Vec<CalibrationInfo> {
    let sending = async {
        for frame in frames {
            send_frame(host, device.endpoints.0, frame)
                .await
                .expect("room");
        }
        // A frame is answered, and a calibration exchanged, within some ticks.
        for _ in 0..200 {
            yield_now().await;
        }
    };
    let used = RefCell::new(Vec::new());
    let fetching = async {
        let mut frame = Vec::new();
        while let Ok(packet) = host.bulk_in(device.endpoints.1).await {
            frame.extend(&packet);
            if packet.len() < MAX_PACKET_BYTES {
                used.borrow_mut().extend(put_to_use(&frame));
                frame.clear();
            }
        }
    };
    embassy_futures::select::select(sending, fetching).await;
    used.into_inner()
}

/// What an answer says was put to use, if it is one to that.
fn put_to_use(frame: &[u8]) -> Option<CalibrationInfo> {
    let (header, body) = VarHeader::take_from_slice(frame)?;
    let mut key = VarKey::Key8(CalibrationUseEndpoint::RESP_KEY);
    key.shrink_to(header.key.kind());
    let reply = (header.key == key).then(|| postcard::from_bytes::<CalibrationUseReply>(body));
    reply?.expect("an answer of the board's").ok()
}

/// Starts a board on `flash`, greets it, lets `act` send what it wants, and asks what is in use then.
fn in_use(flash: &SharedFlash, act: impl AsyncFnOnce(&HostSide, &Device)) -> CalibrationInfo {
    with_board_on(flash, async |host| {
        let device = enumerate(&host).await.expect("it answers");
        let hello = Hello {
            protocol_version: PROTOCOL_VERSION,
        };
        send_frame(
            &host,
            device.endpoints.0,
            &frame::<HelloEndpoint>(1, &hello),
        )
        .await
        .expect("room");
        act(&host, &device).await;
        let client = connect(&host, &device);
        let greeting = client.send_resp::<HelloEndpoint>(&hello).await;
        greeting.expect("it still answers");
        let reply = client.send_resp::<CalibrationEndpoint>(&()).await;
        reply.expect("an answer").expect("greeted")
    })
}

/// Memory of this process (KiB).
fn resident_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux tells");
    let line = status.lines().find(|line| line.starts_with("VmRSS:"));
    let word = line.and_then(|line| line.split_whitespace().nth(1));
    word.and_then(|word| word.parse().ok()).expect("a number")
}

#[test]
fn whatever_becomes_of_uploads_the_board_has_a_whole_calibration_and_answers() {
    let uploads = if long_runs::are_asked_for() {
        UPLOADS_IN_FULL
    } else {
        UPLOADS
    };
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let flash = SharedFlash::new(SimulatedFlash::new(FLASH_PAGES, HalfWords::Settle, 3));
    let devices = ["first", "second"];
    let whole = devices.map(of_device);
    let top = whole[0].max_position().0;
    let is_sound = |info: &CalibrationInfo| {
        devices.contains(&info.device.as_str()) && info.max_position_um == top
    };
    let (mut used, mut by_kind) = (0, BTreeMap::<&str, u32>::new());
    let mut before_kib = None;
    for board in 0..BOARDS {
        let now = in_use(&flash, async |host, device| {
            for _ in 0..uploads / BOARDS {
                let [mine, other] = if rng.random() { [0, 1] } else { [1, 0] };
                let (mut mine, other) = (frames(&whole[mine], 2), frames(&whole[other], 3));
                let kind = disturb(&mut mine, &other, &mut rng);
                let put_to_use = upload(host, device, &mine).await;
                assert!(put_to_use.iter().all(is_sound), "{kind}: {put_to_use:?}");
                assert!(
                    kind != "nothing" || put_to_use.len() == 1,
                    "a whole one is taken"
                );
                used += put_to_use.len();
                *by_kind.entry(kind).or_default() += 1;
            }
            // The last one comes whole.
            upload(host, device, &frames(&whole[board % 2], 2)).await;
        });
        assert_eq!(now.device, devices[board % 2]);
        let kept = in_use(&flash, async |_, _| ());
        assert_eq!(kept, now, "through the power cut");
        before_kib.get_or_insert_with(resident_kib);
    }
    let more_kib = resident_kib().saturating_sub(before_kib.unwrap_or_default());
    println!("{uploads} uploads, {by_kind:?}; {used} put to use; {more_kib} KiB more at the end");
    assert!(more_kib < MEMORY_KIB, "{more_kib} KiB");
}
