//! Random traffic on the bus, control and bulk, malformed, too short, too long, with resets and idle times in between. After
//! it the board enumerates, answers, and has missed nothing.

use mirror_protocol::{
    CalibrationChunk, CalibrationWriteEndpoint, Chunk, Drives, FaultLogEndpoint, LogQuery,
    Position, SetDriveEndpoint, SetPositionEndpoint, StatusEndpoint, Stream, StreamEndpoint,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use silicon_twin::chip::Reset;
use silicon_twin::tool::{Tool, frame};
use silicon_twin::usb_host::Raw;

use crate::common;

/// Rounds of traffic, each of which ends in an enumeration; and transactions in one.
const ROUNDS: u64 = 8;
const FULL_ROUNDS: u64 = 400;
const TRANSACTIONS: usize = 150;
/// A round of transactions takes less: each some 50 us of the bus.
const ROUND_S: f64 = 0.2;
/// How often a host tries again.
const TRIES: u32 = 1;
const SEED: u64 = 20_261_122;

/// Requests that a good tool makes; another frame is one of them, mutated.
fn request(rng: &mut ChaCha8Rng) -> Vec<u8> {
    let sequence = rng.random();
    match rng.random_range(0..6) {
        0 => frame::<StatusEndpoint>(sequence, &()),
        1 => {
            let z_um = f32::from_bits(rng.random());
            frame::<SetPositionEndpoint>(sequence, &Position { z_um, lease_ms: 50 })
        }
        2 => {
            let drive_v = std::array::from_fn(|_| rng.random_range(-1.0..5.0));
            let drives = Drives {
                drive_v,
                lease_ms: rng.random_range(0..100),
            };
            frame::<SetDriveEndpoint>(sequence, &drives)
        }
        3 => {
            let stream = Stream {
                period_ticks: rng.random_range(0..20),
                count: rng.random_range(0..200),
                ..Stream::default()
            };
            frame::<StreamEndpoint>(sequence, &stream)
        }
        4 => {
            let most = rng.random();
            frame::<FaultLogEndpoint>(sequence, &LogQuery { most })
        }
        _ => {
            let bytes: Vec<u8> = (0..rng.random_range(0..=192))
                .map(|_| rng.random())
                .collect();
            let chunk = CalibrationChunk {
                offset: rng.random(),
                bytes: Chunk::from_slice(&bytes).expect("it fits"),
            };
            frame::<CalibrationWriteEndpoint>(sequence, &chunk)
        }
    }
}

fn mutated(rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = request(rng);
    for _ in 0..rng.random_range(0..4) {
        let at = rng.random_range(0..bytes.len());
        match rng.random_range(0..3) {
            0 => bytes[at] ^= 1 << rng.random_range(0..8),
            1 => bytes.truncate(at.max(1)),
            _ => bytes.insert(at, rng.random()),
        }
    }
    bytes
}

/// A SETUP packet: of the standard's requests with random fields, of ours, or of nobody's.
fn setup(rng: &mut ChaCha8Rng) -> [u8; 8] {
    let mut packet: [u8; 8] = rng.random();
    match rng.random_range(0..4) {
        // A descriptor, whole or in part.
        0 => {
            packet[..4].copy_from_slice(&[0x80, 6, rng.random_range(0..4), rng.random_range(0..18)])
        }
        // Any of the standard's requests to device, interface or endpoint, but no other address or configuration.
        1 => {
            packet[0] = [0x00, 0x80, 0x01, 0x81, 0x02, 0x82][rng.random_range(0..6)];
            packet[1] = [0, 1, 3, 6, 7, 8, 10, 11, 12][rng.random_range(0..9)];
        }
        // Vendors'.
        2 => packet[0] = [0x40, 0xc0, 0x41, 0xc1][rng.random_range(0..4)],
        _ => {}
    }
    packet
}

/// One transaction, or some that belong together.
fn transact(rng: &mut ChaCha8Rng, tool: &mut Tool) {
    let host = &mut tool.twin.chip.usb_host;
    let address = match rng.random_range(0..20) {
        0 => rng.random_range(0..128),
        _ => host.address(),
    };
    let (out, in_) = host.device().map_or((1, 1), |device| device.endpoints);
    let random = |rng: &mut ChaCha8Rng, most: usize| -> Vec<u8> {
        (0..rng.random_range(0..=most))
            .map(|_| rng.random())
            .collect()
    };
    match rng.random_range(0..100) {
        0 => host.transact_raw(Raw::Reset),
        1 => host.transact_raw(Raw::Idle),
        2..25 => {
            host.transact_raw(Raw::Setup(address, setup(rng)));
            for _ in 0..rng.random_range(0..4) {
                match rng.random_range(0..2) {
                    0 => host.transact_raw(Raw::In(address, 0)),
                    _ => {
                        let packet = random(rng, 70);
                        host.transact_raw(Raw::Out(address, 0, packet, rng.random()));
                    }
                }
            }
        }
        25..45 => host.transact_raw(Raw::Out(address, out, random(rng, 70), rng.random())),
        45..75 => {
            for packet in mutated(rng).chunks(64) {
                // One of both is what the device waits for.
                for toggle in [false, true] {
                    host.transact_raw(Raw::Out(address, out, packet.to_vec(), toggle));
                }
            }
        }
        75..80 => {
            let endpoint = rng.random_range(0..16);
            host.transact_raw(Raw::Out(address, endpoint, random(rng, 64), rng.random()));
        }
        _ => host.transact_raw(Raw::In(address, in_)),
    }
}

/// Has the device carry out requests on endpoint 0 that bring two bytes at most, whatever it answers.
fn request_all(tool: &mut Tool, packets: &[[u8; 8]]) {
    let host = &mut tool.twin.chip.usb_host;
    let address = host.address();
    for packet in packets {
        host.transact_raw(Raw::Setup(address, *packet));
        (0..8).for_each(|_| host.transact_raw(Raw::In(address, 0)));
        host.transact_raw(Raw::Out(address, 0, Vec::new(), true));
    }
    tool.twin
        .run_for(0.05)
        .unwrap_or_else(|failure| panic!("{failure}"));
}

/// SET_FEATURE and CLEAR_FEATURE of an endpoint's halt, and GET_STATUS (USB 2.0, section 9.4).
fn halt(endpoint: u8) -> [u8; 8] {
    [0x02, 3, 0, 0, endpoint, 0, 0, 0]
}

fn clear_halt(endpoint: u8) -> [u8; 8] {
    [0x02, 1, 0, 0, endpoint, 0, 0, 0]
}

fn status_of(endpoint: u8) -> [u8; 8] {
    [0x82, 0, 0, 0, endpoint, 0, 2, 0]
}

#[test]
fn requests_about_endpoints_that_are_not_there_stop_nothing() {
    let mut tool = common::greeted();
    for endpoint in [0, 0x80, 7, 0x87, 8, 9, 15, 0x88, 0x8f] {
        let all = [halt(endpoint), clear_halt(endpoint), status_of(endpoint)];
        request_all(&mut tool, &all);
    }
    let status = tool.ask::<StatusEndpoint>(&()).expect("an answer");
    status.expect("it was greeted, and not reset since");
}

#[test]
fn an_endpoint_that_is_halted_no_more_goes_on_with_data_0() {
    let mut tool = common::greeted();
    let device = tool.twin.chip.usb_host.device().expect("it is known");
    let (out, in_) = device.endpoints;
    let both = [out, in_ | 0x80];
    for is_halted in [false, true] {
        // A good host asks a halted endpoint for nothing.
        tool.twin.chip.usb_host.listen(false);
        if is_halted {
            request_all(&mut tool, &both.map(halt));
        }
        request_all(&mut tool, &both.map(clear_halt));
        // As a host does it that has cleared a halt.
        tool.twin.chip.usb_host.begin_with_data_0();
        tool.twin.chip.usb_host.listen(true);
        let status = tool.ask::<StatusEndpoint>(&());
        let status = status.unwrap_or_else(|error| panic!("halted before: {is_halted}: {error}"));
        status.expect("it was greeted, and not reset since");
    }
}

#[test]
fn a_bus_that_is_reset_within_a_control_transfer_is_enumerated_again() {
    let mut tool = common::greeted();
    for packet in [
        // A descriptor that nobody fetches, a configuration and a stop that nobody asks the status of.
        [0x80, 6, 0, 2, 0, 0, 255, 0],
        [0x00, 9, 1, 0, 0, 0, 0, 0],
        [0x40, 0x53, 0, 0, 0, 0, 0, 0],
    ] {
        let host = &mut tool.twin.chip.usb_host;
        let address = host.address();
        host.transact_raw(Raw::Setup(address, packet));
        tool.twin.run_for(0.002).expect("it runs");
        tool.twin.chip.usb_host.transact_raw(Raw::Reset);
        tool.twin.run_for(0.01).expect("it runs");
        let clock = tool.twin.chip.clock;
        tool.twin.chip.usb_host.start_over(&clock);
        let identity = tool.connect();
        identity.unwrap_or_else(|error| panic!("after {packet:02x?}: {error}"));
    }
}

/// Resets the bus and gets to know the device, as a host does that tries again once it has waited in vain (Linux up to four
/// times); how often it had to.
fn enumerate(tool: &mut Tool, round: u64) -> u32 {
    let mut again = 0;
    loop {
        let clock = tool.twin.chip.clock;
        tool.twin.chip.usb_host.start_over(&clock);
        match tool.connect() {
            Ok(_) => return again,
            Err(error) if again == TRIES => panic!("round {round}: {error}"),
            Err(_) => again += 1,
        }
    }
}

#[test]
fn a_board_answers_after_any_traffic_on_its_bus() {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut tool = common::greeted();
    let rounds = match long_runs::are_asked_for() {
        true => FULL_ROUNDS,
        false => ROUNDS,
    };
    let mut again = 0;
    for round in 0..rounds {
        for _ in 0..TRANSACTIONS {
            transact(&mut rng, &mut tool);
        }
        let end_s = tool.twin.seconds() + ROUND_S;
        let ran = tool
            .twin
            .run_until(|twin| twin.chip.usb_host.has_transacted() || twin.seconds() > end_s);
        ran.unwrap_or_else(|failure| panic!("round {round}: {failure}"));
        again += enumerate(&mut tool, round);
        let status = tool.ask::<StatusEndpoint>(&()).expect("an answer");
        let stopped = status.expect("greeted").last_stop;
        assert_eq!(
            tool.twin.resets(),
            [Reset::Power],
            "round {round}: {stopped}"
        );
    }
    common::leave_coverage(&tool.twin);
    let status = tool.ask::<StatusEndpoint>(&()).expect("an answer");
    let health = status.expect("greeted").health;
    assert_eq!((health.missed_ticks, health.late_ticks), (0, 0));
    println!(
        "{rounds} rounds of {TRANSACTIONS} random transactions and more, {:.1} s of the board's time: it answers after each, \
         {again} times at a host's second try",
        tool.twin.seconds()
    );
}
