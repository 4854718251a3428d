//! USB as a host sees it: the device that embassy-usb and the firmware make, on a bus in memory.

use embassy_futures::select::{Either, select};
use embassy_futures::yield_now;
use firmware_on_host::{Device, SERIAL, connect, enumerate, get_descriptor, with_board};
use mirror_protocol::usb::{MANUFACTURER, PRODUCT, PRODUCT_ID, VENDOR_ID};
use mirror_protocol::{
    EnterBootloaderEndpoint, Hello, HelloEndpoint, Identity, PROTOCOL_VERSION, Position, Refusal,
    SetPositionEndpoint, StatusEndpoint, Stream, StreamEndpoint, TelemetryTopic, WireError,
};
use postcard_rpc::Endpoint;
use postcard_rpc::header::{VarHeader, VarKey, VarSeq};
use postcard_rpc::host_client::{HostClient, HostErr};
use virtual_usb::{ControlRequest, UsbFailure};

pub(crate) const HELLO: Hello = Hello {
    protocol_version: PROTOCOL_VERSION,
};

pub(crate) async fn greet(client: &HostClient<WireError>) -> Identity {
    client
        .send_resp::<HelloEndpoint>(&HELLO)
        .await
        .expect("an answer")
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

/// It takes them out of what its image says of itself.
#[test]
fn it_says_version_and_commit() {
    with_board(async |host| {
        let device = enumerate(&host).await.expect("it answers");
        let identity = greet(&connect(&host, &device)).await;
        assert_eq!(&*identity.firmware_version, env!("CARGO_PKG_VERSION"));
        let is_word = |text: &str| text.chars().all(char::is_alphanumeric);
        let build = &*identity.build;
        assert!(!build.is_empty() && is_word(build), "{build}");
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
