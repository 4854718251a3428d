//! Frames on the bus: of every length, broken ones, and those that a reset, a sleep or a dead tool comes between.

use embassy_futures::yield_now;
use firmware_on_host::{Device, connect, enumerate, send_frame, with_board};
use mirror_protocol::{HelloEndpoint, MAX_FRAME_BYTES, Stream, StreamEndpoint};
use postcard_rpc::header::{VarHeader, VarKey, VarSeq};
use postcard_rpc::standard_icd::ERROR_KEY;
use postcard_rpc::{Endpoint, Key};
use virtual_usb::{ControlRequest, HostSide, MAX_PACKET_BYTES, UsbFailure};

use crate::usb::{HELLO, greet};

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
