//! The wire format: what is sent comes back whole, garbage is refused, frames fit, and the greeting
//! keeps the bytes it has always had.

use mirror_protocol::{
    CHUNK_POINTS, ChannelState, CommandReply, Commanded, Drives, Health, Hello, Identity,
    MAX_FRAME_BYTES, Play, Points, Position, Refusal, Renewal, Sentence, Status, StatusReply,
    Stream, Telemetry, Text,
};
use proptest::prelude::*;

fn number() -> impl Strategy<Value = f32> {
    -1e6_f32..1e6
}

fn state() -> impl Strategy<Value = ChannelState> {
    prop_oneof![
        Just(ChannelState::Off),
        Just(ChannelState::Starting),
        Just(ChannelState::Ready),
        Just(ChannelState::Driving),
        Just(ChannelState::Limited),
        any::<u8>().prop_map(ChannelState::Tripped),
    ]
}

fn health() -> impl Strategy<Value = Health> {
    (proptest::option::of(any::<u32>()), number(), any::<u32>()).prop_map(
        |(lease_left_ms, supply_v, missed_ticks)| Health {
            lease_left_ms,
            supply_v,
            missed_ticks,
            limits_since_command: 0x3ff,
        },
    )
}

fn telemetry() -> impl Strategy<Value = Telemetry> {
    (
        any::<u32>(),
        proptest::array::uniform4(number()),
        proptest::array::uniform4(number()),
        proptest::array::uniform4(proptest::option::of(number())),
        any::<u16>(),
        proptest::array::uniform4(state()),
        proptest::option::of(number()),
    )
        .prop_map(
            |(tick, drive_v, current_a, temperature_k, limits, states, sensor_z_um)| Telemetry {
                tick,
                drive_v,
                current_a,
                temperature_k,
                limits,
                states,
                sensor_z_um,
            },
        )
}

proptest! {
    #[test]
    fn status_comes_back_whole_and_fits_a_frame(
        telemetry in telemetry(),
        health in health(),
        dropped_samples: u32,
        last_stop in "[ -~]{0,128}",
    ) {
        let status: StatusReply =
            Ok(Status { telemetry, health, max_position_um: 173.7, max_drive_v: 3.5, dropped_samples, last_stop: Sentence::try_from(last_stop.as_str()).unwrap() });
        let bytes = postcard::to_stdvec(&status).unwrap();
        prop_assert!(bytes.len() + 13 <= MAX_FRAME_BYTES, "{} bytes and a header", bytes.len());
        prop_assert_eq!(postcard::from_bytes::<StatusReply>(&bytes).unwrap(), status);
    }

    #[test]
    fn garbage_is_an_error_and_no_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let _ = postcard::from_bytes::<Hello>(&bytes);
        let _ = postcard::from_bytes::<Identity>(&bytes);
        let _ = postcard::from_bytes::<Position>(&bytes);
        let _ = postcard::from_bytes::<Drives>(&bytes);
        let _ = postcard::from_bytes::<Renewal>(&bytes);
        let _ = postcard::from_bytes::<Stream>(&bytes);
        let _ = postcard::from_bytes::<Play>(&bytes);
        let _ = postcard::from_bytes::<Points>(&bytes);
        let _ = postcard::from_bytes::<CommandReply>(&bytes);
        let _ = postcard::from_bytes::<StatusReply>(&bytes);
    }
}

#[test]
fn the_longest_chunk_of_points_fits_a_frame() {
    let points = Points {
        first: u16::MAX,
        points: [i16::MIN; CHUNK_POINTS].into_iter().collect(),
    };
    let bytes = postcard::to_stdvec(&points).unwrap();
    assert!(
        bytes.len() + 13 <= MAX_FRAME_BYTES,
        "{} bytes and a header",
        bytes.len()
    );
    assert_eq!(postcard::from_bytes::<Points>(&bytes).unwrap(), points);
}

#[test]
fn a_reply_is_either_done_or_refused() {
    let done: CommandReply = Ok(Commanded {
        tick: 7,
        drive_v: [1.0; 4],
        limits: 0,
    });
    let refused: CommandReply = Err(Refusal::ProtocolVersion { board: 1, tool: 2 });
    for reply in [done, refused] {
        let bytes = postcard::to_stdvec(&reply).unwrap();
        assert_eq!(postcard::from_bytes::<CommandReply>(&bytes).unwrap(), reply);
    }
}

#[test]
fn the_greeting_is_frozen() {
    use mirror_protocol::HelloEndpoint;
    use postcard_rpc::Endpoint;
    assert_eq!(
        HelloEndpoint::REQ_KEY.to_bytes(),
        [250, 253, 29, 56, 214, 179, 237, 38]
    );
    assert_eq!(
        HelloEndpoint::RESP_KEY.to_bytes(),
        [119, 42, 254, 37, 52, 131, 7, 159]
    );
    let hello = postcard::to_stdvec(&Hello {
        protocol_version: 1,
    })
    .unwrap();
    assert_eq!(hello, [1]);
    let identity = Identity {
        protocol_version: 1,
        firmware_version: Text::try_from("0.1.0").unwrap(),
        build: Text::try_from("abc").unwrap(),
        board: Text::try_from("b").unwrap(),
        is_emulated: true,
        tick_hz: 10_000,
    };
    let bytes = postcard::to_stdvec(&identity).unwrap();
    assert_eq!(bytes, *b"\x01\x050.1.0\x03abc\x01b\x01\x90\x4e");
}
