//! USB as a host sees it: the device that embassy-usb and the firmware make, on a bus in memory.

use embassy_futures::select::{Either, select};
use embassy_futures::yield_now;
use firmware_on_host::{
    Device, SERIAL, connect, enumerate, get_descriptor, send_frame, with_board,
};
use mirror_protocol::usb::{MANUFACTURER, PRODUCT, PRODUCT_ID, VENDOR_ID};
use mirror_protocol::{
    EnterBootloaderEndpoint, Hello, HelloEndpoint, Identity, MAX_FRAME_BYTES, PROTOCOL_VERSION,
    Position, Refusal, SetPositionEndpoint, StatusEndpoint, Stream, StreamEndpoint, TelemetryTopic,
    WireError,
};
use postcard_rpc::header::{VarHeader, VarKey, VarSeq};
use postcard_rpc::host_client::{HostClient, HostErr};
use postcard_rpc::standard_icd::ERROR_KEY;
use postcard_rpc::{Endpoint, Key};
use virtual_usb::{ControlRequest, HostSide, MAX_PACKET_BYTES, UsbFailure};

const HELLO: Hello = Hello {
    protocol_version: PROTOCOL_VERSION,
};

async fn greet(client: &HostClient<WireError>) -> Identity {
    client
        .send_resp::<HelloEndpoint>(&HELLO)
        .await
        .expect("an answer")
}

/// A greeting as it stands on the bus.
fn hello_frame(sequence: u16) -> Vec<u8> {
    let mut frame = frame(HelloEndpoint::REQ_KEY, sequence);
    frame.extend(postcard::to_stdvec(&HELLO).expect("it serialises"));
    frame
}

fn frame(key: Key, sequence: u16) -> Vec<u8> {
    let header = VarHeader {
        key: VarKey::Key8(key),
        seq_no: VarSeq::Seq2(sequence),
    };
    header.write_to_vec()
}

/// The sequence number of the next answer, and whether it says that it did not understand.
async fn answer(host: &HostSide, device: &Device) -> (u32, bool) {
    let packet = host.bulk_in(device.endpoints.1).await.expect("a packet");
    assert!(packet.len() < MAX_PACKET_BYTES, "short answers only");
    let (header, _) = VarHeader::take_from_slice(&packet).expect("a header");
    let sequence = match header.seq_no {
        VarSeq::Seq1(sequence) => sequence.into(),
        VarSeq::Seq2(sequence) => sequence.into(),
        VarSeq::Seq4(sequence) => sequence,
    };
    let mut error = VarKey::Key8(ERROR_KEY);
    error.shrink_to(header.key.kind());
    (sequence, header.key == error)
}

fn string(descriptor: &[u8]) -> String {
    let units = descriptor[2..]
        .chunks_exact(2)
        .map(|unit| u16::from_le_bytes([unit[0], unit[1]]));
    char::decode_utf16(units)
        .map(|c| c.expect("UTF-16"))
        .collect()
}

#[test]
fn it_enumerates_and_says_who_it_is() {
    with_board(async |host| {
        let Device {
            device,
            endpoints,
            configuration,
        } = enumerate(&host).await.expect("it answers");
        assert_ne!(host.address(), 0);
        assert_eq!(device.len(), 18);
        let word = |at| u16::from_le_bytes([device[at], device[at + 1]]);
        assert!(word(2) >= 0x0201, "a device with BOS");
        assert_eq!(device[7], 64, "packets of the control endpoint");
        assert_eq!((word(8), word(10)), (VENDOR_ID, PRODUCT_ID));
        assert_eq!(endpoints, (1, 1));
        let bulk = |address| [7, 5, address, 2, 64, 0, 0];
        for address in [0x01, 0x81] {
            let there = configuration.windows(7).any(|part| part == bulk(address));
            assert!(there, "endpoint {address:#x} in {configuration:x?}");
        }
        for (index, text) in [(14, MANUFACTURER), (15, PRODUCT), (16, SERIAL)] {
            let descriptor = get_descriptor(&host, 3, device[index], 255).await;
            assert_eq!(string(&descriptor.expect("a string")), text);
        }
    });
}

/// Microsoft OS 2.0 descriptors: platform capability, and the set that it points to.
#[test]
fn windows_finds_its_driver_by_the_descriptors() {
    const PLATFORM: [u8; 16] = [
        0xdf, 0x60, 0xdd, 0xd8, 0x89, 0x45, 0xc7, 0x4c, 0x9c, 0xd2, 0x65, 0x9d, 0x9e, 0x64, 0x8a,
        0x9f,
    ];
    with_board(async |host| {
        enumerate(&host).await.expect("it answers");
        let bos = get_descriptor(&host, 15, 0, 255).await.expect("a BOS");
        let at = bos
            .windows(16)
            .position(|part| part == PLATFORM)
            .expect("the platform capability");
        let info = &bos[at + 16..];
        let length = u16::from_le_bytes([info[4], info[5]]);
        let vendor_code = info[6];
        let request = ControlRequest {
            request_type: 0xc0,
            request: vendor_code,
            value: 0,
            index: 7,
            length,
        };
        let set = host.control_in(request).await.expect("a descriptor set");
        assert_eq!(set.len(), usize::from(length));
        assert!(set.windows(8).any(|part| part == b"WINUSB\0\0"), "{set:x?}");
        let guid: Vec<u8> = "{AFB9A6FB-"
            .encode_utf16()
            .flat_map(u16::to_le_bytes)
            .collect();
        assert!(set.windows(guid.len()).any(|part| part == guid));
    });
}

#[test]
fn what_it_does_not_know_is_stalled_and_it_goes_on() {
    with_board(async |host| {
        let device = enumerate(&host).await.expect("it answers");
        assert_eq!(
            get_descriptor(&host, 99, 0, 64).await,
            Err(UsbFailure::Stalled)
        );
        let vendor = ControlRequest {
            request_type: 0x40,
            request: 0xee,
            value: 1,
            index: 2,
            length: 200,
        };
        assert_eq!(
            host.control_out(vendor, &[7; 200]).await,
            Err(UsbFailure::Stalled)
        );
        assert_eq!(host.bulk_out(5, &[]).await, Err(UsbFailure::NoEndpoint));
        greet(&connect(&host, &device)).await;
    });
}

#[test]
fn commands_and_samples_pass_as_on_any_link() {
    with_board(async |host| {
        let device = enumerate(&host).await.expect("it answers");
        let client = connect(&host, &device);
        assert_eq!(greet(&client).await.protocol_version, PROTOCOL_VERSION);
        let position = Position {
            z_um: 100.0,
            lease_ms: 1000,
        };
        let reply = client.send_resp::<SetPositionEndpoint>(&position).await;
        reply.expect("an answer").expect("carried out");

        let mut samples = client
            .subscribe_multi::<TelemetryTopic>(64)
            .await
            .expect("open");
        let stream = Stream {
            period_ticks: 20,
            count: 30,
            ..Stream::default()
        };
        let reply = client.send_resp::<StreamEndpoint>(&stream).await;
        let first = reply.expect("an answer").expect("a stream").first_tick;
        let mut arrived = Vec::new();
        while arrived.len() < 30 {
            arrived.extend(samples.recv().await.expect("a sample"));
        }
        for (sample, telemetry) in (0..).zip(&arrived) {
            assert_eq!(telemetry.tick, first + 20 * sample);
            // The way there is smooth, and begins at 0 V.
            let is_there = telemetry.drive_v.iter().all(|drive| *drive > 1.0);
            assert!(is_there || sample < 20, "{telemetry:?}");
        }
        let status = client.send_resp::<StatusEndpoint>(&()).await;
        assert_eq!(
            status.expect("an answer").expect("status").dropped_samples,
            0
        );
    });
}

#[test]
fn a_stream_that_fills_the_bus_keeps_no_answer_waiting() {
    with_board(async |host| {
        let device = enumerate(&host).await.expect("it answers");
        let client = connect(&host, &device);
        greet(&client).await;
        let every_tick = Stream {
            period_ticks: 1,
            count: u32::MAX,
            ..Stream::default()
        };
        let begun = client.send_resp::<StreamEndpoint>(&every_tick).await;
        begun.expect("an answer").expect("it streams");
        for _ in 0..10 {
            let answer = client.send_resp::<StatusEndpoint>(&());
            // A frame on its way goes first, and one or two wait in the device: some 20 packets, each a turn.
            let turns = async {
                for _ in 0..200 {
                    yield_now().await;
                }
            };
            let Either::First(status) = select(answer, turns).await else {
                panic!("only samples come")
            };
            status.expect("an answer").expect("a status");
        }
    });
}

#[test]
fn a_board_without_a_bootloader_says_so_and_stays() {
    with_board(async |host| {
        let device = enumerate(&host).await.expect("it answers");
        let client = connect(&host, &device);
        greet(&client).await;
        let reply = client.send_resp::<EnterBootloaderEndpoint>(&()).await;
        assert_eq!(reply.expect("an answer"), Err(Refusal::NoBootloader));
        greet(&client).await;
    });
}

#[test]
fn frames_of_every_length_arrive_whole_and_too_long_ones_are_passed_over() {
    let unknown = Key::for_path::<()>("nobody/knows");
    with_board(async |host| {
        let device = enumerate(&host).await.expect("it answers");
        let head = frame(unknown, 0).len();
        for length in head..=MAX_FRAME_BYTES {
            let sequence = length as u16;
            let mut frame = frame(unknown, sequence);
            frame.resize(length, 0xa5);
            send_frame(&host, device.endpoints.0, &frame)
                .await
                .expect("room");
            assert_eq!(
                answer(&host, &device).await,
                (sequence.into(), true),
                "{length} bytes"
            );
        }
        for length in MAX_FRAME_BYTES + 1..MAX_FRAME_BYTES + 4 * MAX_PACKET_BYTES {
            let mut frame = frame(unknown, 1);
            frame.resize(length, 0xa5);
            send_frame(&host, device.endpoints.0, &frame)
                .await
                .expect("room");
            send_frame(&host, device.endpoints.0, &hello_frame(2))
                .await
                .expect("room");
            while answer(&host, &device).await.0 != 2 {}
        }
    });
}

#[test]
fn empty_and_broken_frames_are_passed_over() {
    with_board(async |host| {
        let device = enumerate(&host).await.expect("it answers");
        for (sequence, broken) in (1..).zip([&[][..], &[0xff], &[0; 10], &[0xff; 63]]) {
            send_frame(&host, device.endpoints.0, broken)
                .await
                .expect("room");
            send_frame(&host, device.endpoints.0, &hello_frame(sequence))
                .await
                .expect("room");
            while answer(&host, &device).await != (sequence.into(), false) {}
        }
    });
}

#[test]
fn a_reset_anywhere_in_a_frame_leaves_a_device_that_enumerates_again() {
    let unknown = Key::for_path::<()>("nobody/knows");
    with_board(async |host| {
        for packets in 0..=3 {
            for waits in 0..4 {
                let device = enumerate(&host).await.expect("it answers");
                let mut long = frame(unknown, 1);
                long.resize(200, 0xa5);
                for packet in long.chunks(MAX_PACKET_BYTES).take(packets) {
                    host.bulk_out(device.endpoints.0, packet)
                        .await
                        .expect("room");
                }
                for _ in 0..waits {
                    yield_now().await;
                }
                host.reset();
                let again = enumerate(&host).await.expect("it answers again");
                assert_eq!(again, device);
                send_frame(&host, again.endpoints.0, &hello_frame(9))
                    .await
                    .expect("room");
                assert_eq!(answer(&host, &again).await, (9, false), "{packets} {waits}");
            }
        }
    });
}

#[test]
fn a_reset_in_the_middle_of_a_control_request_is_survived() {
    with_board(async |host| {
        for waits in 0..6 {
            enumerate(&host).await.expect("it answers");
            let strings = ControlRequest {
                request_type: 0x80,
                request: 6,
                value: 0x0302,
                index: 0x0409,
                length: 255,
            };
            host.begin(strings, &[]);
            for _ in 0..waits {
                yield_now().await;
            }
            host.reset();
        }
        let device = enumerate(&host).await.expect("it answers");
        greet(&connect(&host, &device)).await;
    });
}

#[test]
fn a_frame_goes_on_after_suspend_and_resume() {
    let unknown = Key::for_path::<()>("nobody/knows");
    with_board(async |host| {
        let device = enumerate(&host).await.expect("it answers");
        let mut long = frame(unknown, 77);
        long.resize(150, 0xa5);
        let (first, rest) = long.split_at(MAX_PACKET_BYTES);
        host.bulk_out(device.endpoints.0, first)
            .await
            .expect("room");
        host.suspend();
        assert_eq!(
            host.bulk_out(device.endpoints.0, rest).await,
            Err(UsbFailure::Suspended)
        );
        for _ in 0..100 {
            yield_now().await;
        }
        host.resume();
        send_frame(&host, device.endpoints.0, rest)
            .await
            .expect("room");
        assert_eq!(answer(&host, &device).await, (77, true));
        greet(&connect(&host, &device)).await;
    });
}

#[test]
fn a_tool_that_died_within_a_frame_costs_the_next_one_a_request_at_most() {
    with_board(async |host| {
        let device = enumerate(&host).await.expect("it answers");
        host.bulk_out(device.endpoints.0, &[0xa5; MAX_PACKET_BYTES])
            .await
            .expect("room");
        send_frame(&host, device.endpoints.0, &hello_frame(1))
            .await
            .expect("room");
        send_frame(&host, device.endpoints.0, &hello_frame(2))
            .await
            .expect("room");
        while answer(&host, &device).await != (2, false) {}
    });
}

#[test]
fn a_host_that_fetches_nothing_for_a_while_finds_the_device_ready() {
    with_board(async |host| {
        let device = enumerate(&host).await.expect("it answers");
        let greeted = connect(&host, &device);
        greet(&greeted).await;
        let stream = Stream {
            period_ticks: 1,
            count: 500,
            ..Stream::default()
        };
        greeted
            .send_resp::<StreamEndpoint>(&stream)
            .await
            .expect("an answer")
            .expect("a stream");
        greeted.close();
        for _ in 0..2000 {
            yield_now().await;
        }
        send_frame(&host, device.endpoints.0, &hello_frame(3))
            .await
            .expect("room");
        loop {
            let packet = host.bulk_in(device.endpoints.1).await.expect("a packet");
            let header = VarHeader::take_from_slice(&packet);
            if header.is_some_and(|(header, _)| header.seq_no == VarSeq::Seq2(3)) {
                break;
            }
        }
    });
}

#[test]
fn a_request_that_is_not_understood_is_told_to_the_client() {
    with_board(async |host| {
        let device = enumerate(&host).await.expect("it answers");
        let client = connect(&host, &device);
        let reply = client
            .send_resp_raw(
                postcard_rpc::host_client::RpcFrame {
                    header: VarHeader {
                        key: VarKey::Key8(SetPositionEndpoint::REQ_KEY),
                        seq_no: VarSeq::Seq2(4),
                    },
                    body: vec![],
                },
                SetPositionEndpoint::RESP_KEY,
            )
            .await;
        assert!(matches!(reply, Err(HostErr::Wire(_))));
    });
}
