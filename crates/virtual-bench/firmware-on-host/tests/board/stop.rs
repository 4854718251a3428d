//! The stop on endpoint 0, which needs no interface: whoever holds the link, and whatever it is doing.

use embassy_futures::join::join;
use embassy_futures::yield_now;
use firmware_on_host::{connect, enumerate, with_board};
use mirror_protocol::usb::STOP_REQUEST;
use mirror_protocol::{
    Drives, Hello, HelloEndpoint, OffEndpoint, PROTOCOL_VERSION, Play, PlayEndpoint, Quantity,
    Refusal, RenewEndpoint, Renewal, SetDriveEndpoint, Shape, StatusEndpoint, Stream,
    StreamEndpoint, Telemetry, Triggers, Waveform, WireError,
};
use postcard_rpc::host_client::HostClient;
use virtual_usb::{ControlRequest, HostSide};

type Client = HostClient<WireError>;

const DRIVES: Drives = Drives {
    drive_v: [1.5; 4],
    lease_ms: 60_000,
};

async fn greet(client: &Client) {
    let hello = Hello {
        protocol_version: PROTOCOL_VERSION,
    };
    let identity = client.send_resp::<HelloEndpoint>(&hello).await;
    identity.expect("an answer");
}

async fn drive(client: &Client) -> Result<(), Refusal> {
    let reply = client.send_resp::<SetDriveEndpoint>(&DRIVES).await;
    reply.expect("an answer").map(drop)
}

async fn play(client: &Client) -> Result<(), Refusal> {
    let stream = Stream {
        period_ticks: 10,
        count: 1,
        ..Stream::default()
    };
    let play = Play {
        waveform: Waveform {
            quantity: Quantity::Drive {
                active: [true; 4],
                others_v: 0.0,
            },
            shape: Shape::Sine { frequency_hz: 10.0 },
            offset: 1.5,
            amplitude: 0.5,
            cycles: u32::MAX,
            ends_off: true,
            triggers: Triggers::default(),
        },
        stream,
        lease_ms: 60_000,
    };
    let reply = client.send_resp::<PlayEndpoint>(&play).await;
    reply.expect("an answer").map(drop)
}

async fn telemetry(client: &Client) -> Telemetry {
    let status = client.send_resp::<StatusEndpoint>(&()).await;
    status.expect("an answer").expect("a status").telemetry
}

/// Stops the board, and waits until it says that it has.
async fn stop(host: &HostSide) {
    let request = |request_type, length| ControlRequest {
        request_type,
        request: STOP_REQUEST,
        value: 0,
        index: 0,
        length,
    };
    let stopped = host.control_out(request(0x40, 0), &[]).await;
    stopped.expect("it is accepted");
    while host.control_in(request(0xc0, 1)).await.expect("a byte") != [1] {}
}

#[test]
fn a_stop_turns_off_what_another_drives_who_does_not_drive_again() {
    with_board(async |host| {
        let client = connect(&host, &enumerate(&host).await.expect("it answers"));
        greet(&client).await;
        drive(&client).await.expect("it drives");
        stop(&host).await;
        assert_eq!(telemetry(&client).await.drive_v, [0.0; 4]);

        assert_eq!(drive(&client).await, Err(Refusal::NoHello));
        assert_eq!(play(&client).await, Err(Refusal::NoHello));
        let renewal = Renewal { lease_ms: 100 };
        let renewed = client.send_resp::<RenewEndpoint>(&renewal).await;
        assert_eq!(renewed.expect("an answer"), Err(Refusal::NoHello));
        // What a tool does when it ends is done.
        let off = client.send_resp::<OffEndpoint>(&()).await;
        off.expect("an answer").expect("off is off");
        assert_eq!(telemetry(&client).await.drive_v, [0.0; 4]);

        greet(&client).await;
        drive(&client).await.expect("it drives anew");
    });
}

#[test]
fn a_stop_comes_before_what_waits_for_the_heaters_to_be_checked() {
    // The first command after a start waits 0.26 s for its heaters; a stop meets it at any tick of that, and after it.
    for waits in [0, 100, 2500, 2600, 3000] {
        for plays in [false, true] {
            with_board(async |host| {
                let client = connect(&host, &enumerate(&host).await.expect("it answers"));
                greet(&client).await;
                let driving = async {
                    match plays {
                        true => play(&client).await,
                        false => drive(&client).await,
                    }
                };
                let stopping = async {
                    for _ in 0..waits {
                        yield_now().await;
                    }
                    stop(&host).await;
                };
                let (driven, ()) = join(driving, stopping).await;
                // It came before the heaters were checked, or the drive had begun.
                let is_early = waits <= 1000;
                assert!(
                    driven == Err(Refusal::NoHello) || driven.is_ok() && !is_early,
                    "{waits} {plays} {driven:?}"
                );
                for _ in 0..3000 {
                    yield_now().await;
                }
                let now = telemetry(&client).await;
                assert_eq!(now.drive_v, [0.0; 4], "{waits} {plays} {driven:?}");
            });
        }
    }
}

#[test]
fn a_host_that_fetches_nothing_does_not_keep_the_board_from_stopping() {
    with_board(async |host| {
        let client = connect(&host, &enumerate(&host).await.expect("it answers"));
        greet(&client).await;
        drive(&client).await.expect("it drives");
        let stream = Stream {
            period_ticks: 1,
            count: 500,
            ..Stream::default()
        };
        let streaming = client.send_resp::<StreamEndpoint>(&stream).await;
        streaming.expect("an answer").expect("a stream");
        client.close();
        for _ in 0..1000 {
            yield_now().await;
        }
        // It is answered, which a tick does; another client would have to share the packets with the first.
        stop(&host).await;
    });
}

#[test]
fn other_requests_of_a_vendor_do_not_stop() {
    with_board(async |host| {
        let client = connect(&host, &enumerate(&host).await.expect("it answers"));
        greet(&client).await;
        drive(&client).await.expect("it drives");
        // To the interface, of a class, or with another number.
        for (request_type, request) in [
            (0x41, STOP_REQUEST),
            (0x20, STOP_REQUEST),
            (0x40, STOP_REQUEST + 1),
        ] {
            let request = ControlRequest {
                request_type,
                request,
                value: 0,
                index: 0,
                length: 0,
            };
            let refused = host.control_out(request, &[]).await;
            assert!(refused.is_err(), "{request:?}");
        }
        drive(&client).await.expect("it goes on");
    });
}
