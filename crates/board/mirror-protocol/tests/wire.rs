//! The wire format: what is sent comes back whole, garbage is refused, frames fit, and the greeting
//! keeps the bytes it has always had.

use mirror_protocol::{
    ANSWER_TIMEOUT_MS, BATCH_SAMPLES, CHUNK_POINTS, ChannelState, CommandReply, Commanded, Drives,
    Excerpt, FaultLogReply, Health, Hello, Identity, LOG_FORMAT, LogBytes, LogEntry, LogEvent,
    LogPage, LogStorage, Loss, MAX_FRAME_BYTES, OptionBytes, Play, Points, Pose, Position, Refusal,
    Renewal, ResetCause, Room, Sentence, StartEvent, Status, StatusReply, Stream, Telemetry,
    TelemetryBatch, Text, Trigger, TripEvent, Uncertainty,
};
use proptest::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

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

const OPTIONS: Option<OptionBytes> = Some(OptionBytes {
    brown_out_level: 4,
    boots_by_pin: true,
    is_dual_bank: true,
});

fn health() -> impl Strategy<Value = Health> {
    (proptest::option::of(any::<u32>()), number(), any::<u32>()).prop_map(
        |(lease_left_ms, supply_v, missed_ticks)| Health {
            lease_left_ms,
            supply_v,
            missed_ticks,
            late_ticks: missed_ticks / 2,
            limits_since_command: 0xfff,
            compensates_room: true,
            lowest_position_um: 18.25,
            loss: Some(Loss {
                change: -0.2,
                deviation: 0.1,
            }),
        },
    )
}

fn log_event() -> impl Strategy<Value = LogEvent> {
    let start = (
        any::<u32>(),
        proptest::option::of(any::<u8>()),
        "[ -~]{0,72}",
    )
        .prop_map(|(skipped, stop, said)| {
            LogEvent::Start(StartEvent {
                cause: ResetCause::Watchdog,
                stop,
                said: Excerpt::try_from(said.as_str()).unwrap(),
                skipped,
            })
        });
    let trip = (
        any::<u64>(),
        proptest::array::uniform4(proptest::option::of(any::<u8>())),
        any::<u32>(),
        telemetry(),
    )
        .prop_map(|(up_us, faults, times, telemetry)| {
            LogEvent::Trip(TripEvent {
                up_us,
                faults,
                times,
                drive_v: telemetry.drive_v,
                current_a: telemetry.current_a,
                temperature_k: telemetry.temperature_k,
                supply_v: 5.0,
                missed_ticks: times,
            })
        });
    prop_oneof![start, trip]
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
        (number(), proptest::option::of([number(), number()])),
        proptest::option::of(any::<(i16, u16)>()),
        proptest::option::of(any::<(u16, u16)>()),
        proptest::option::of(any::<u16>()),
    )
        .prop_map(
            |(
                tick,
                drive_v,
                current_a,
                temperature_k,
                limits,
                states,
                sensor_z_um,
                (z_um, tilt_rad),
                room,
                uncertainty,
                settles_in_ms,
            )| Telemetry {
                trigger: Trigger::from_bits(limits as u8),
                settles_in_ms,
                uncertainty: uncertainty.map(|(z_nm, tilt_urad)| Uncertainty { z_nm, tilt_urad }),
                room: room.map(|(rise_ck, deviation_ck)| Room {
                    rise_ck,
                    deviation_ck,
                }),
                pose: Pose { z_um, tilt_rad },
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
            Ok(Status { telemetry, health, max_position_um: 173.7, max_drive_v: 3.5, dropped_samples, stops: dropped_samples, last_stop: Sentence::try_from(last_stop.as_str()).unwrap(), option_bytes: OPTIONS });
        let bytes = postcard::to_stdvec(&status).unwrap();
        prop_assert!(bytes.len() + 13 <= MAX_FRAME_BYTES, "{} bytes and a header", bytes.len());
        prop_assert_eq!(postcard::from_bytes::<StatusReply>(&bytes).unwrap(), status);
    }

    #[test]
    fn an_entry_of_the_fault_log_comes_back_whole_and_fits_its_place_in_flash_and_a_frame(
        event in log_event(), boot: u32, trips: u32, number: u32,
    ) {
        let in_flash = event.to_bytes();
        prop_assert!(!in_flash.is_empty(), "it does not fit");
        // An entry holds 112 bytes (`fault_log::MAX_BYTES`), of which format and boot take five.
        prop_assert_eq!(LogBytes::new().capacity() + 5, 112);
        let entry = LogEntry { number, boot, format: LOG_FORMAT, bytes: in_flash };
        prop_assert_eq!(LogEvent::of(&entry), Some(event));
        let of_another_format = LogEntry { format: LOG_FORMAT + 1, ..entry.clone() };
        prop_assert_eq!(LogEvent::of(&of_another_format), None);
        let entry = Some(LogEntry { bytes: LogBytes::from_slice(&[7; 107]).unwrap(), ..entry });
        let reply: FaultLogReply = Ok(LogPage { boot, trips, storage: LogStorage::Kept, entry });
        let bytes = postcard::to_stdvec(&reply).unwrap();
        prop_assert!(bytes.len() + 13 <= MAX_FRAME_BYTES, "{} bytes and a header", bytes.len());
        prop_assert_eq!(postcard::from_bytes::<FaultLogReply>(&bytes).unwrap(), reply);
    }

    #[test]
    fn garbage_is_refused_or_is_a_message_that_stays_the_same(
        bytes in proptest::collection::vec(any::<u8>(), 0..200),
    ) {
        refused_or_stable::<Hello>(&bytes)?;
        refused_or_stable::<Identity>(&bytes)?;
        refused_or_stable::<Position>(&bytes)?;
        refused_or_stable::<Drives>(&bytes)?;
        refused_or_stable::<Renewal>(&bytes)?;
        refused_or_stable::<Stream>(&bytes)?;
        refused_or_stable::<Play>(&bytes)?;
        refused_or_stable::<Points>(&bytes)?;
        refused_or_stable::<CommandReply>(&bytes)?;
        refused_or_stable::<StatusReply>(&bytes)?;
        refused_or_stable::<FaultLogReply>(&bytes)?;
        refused_or_stable::<LogEvent>(&bytes)?;
        refused_or_stable::<TelemetryBatch>(&bytes)?;
    }

    #[test]
    fn a_message_that_is_cut_short_is_refused(telemetry in telemetry(), health in health(), part in 0.0..1.0) {
        let status: StatusReply = Ok(Status {
            telemetry,
            health,
            max_position_um: 173.7,
            max_drive_v: 3.5,
            dropped_samples: 0,
            stops: 0,
            last_stop: Sentence::new(),
            option_bytes: OPTIONS,
        });
        let bytes = postcard::to_stdvec(&status).unwrap();
        let cut = (part * bytes.len() as f64) as usize;
        prop_assert!(postcard::from_bytes::<StatusReply>(&bytes[..cut]).is_err());
    }
}

/// What is read of `bytes`, if anything is, takes no more bytes than there are and reads as itself again. (Bytes are
/// compared, because NaN is not itself.)
fn refused_or_stable<T: Serialize + DeserializeOwned>(bytes: &[u8]) -> Result<(), TestCaseError> {
    if let Ok(message) = postcard::from_bytes::<T>(bytes) {
        let written = postcard::to_stdvec(&message).unwrap();
        prop_assert!(written.len() <= bytes.len());
        let again: T = postcard::from_bytes(&written).unwrap();
        prop_assert_eq!(postcard::to_stdvec(&again).unwrap(), written);
    }
    Ok(())
}

#[test]
fn an_unknown_kind_of_message_is_refused() {
    // A result is 0 or 1, a channel's state 0 to 5.
    assert!(postcard::from_bytes::<CommandReply>(&[2; 64]).is_err());
    assert!(postcard::from_bytes::<ChannelState>(&[6, 0]).is_err());
    assert!(
        postcard::from_bytes::<Hello>(&[0xff; 8]).is_err(),
        "a u16 has no eight bytes"
    );
}

#[test]
fn the_documents_time_out_is_the_one_in_use() {
    let seconds = ANSWER_TIMEOUT_MS / 1000;
    let sentence = format!("Every request of the tool ends after {seconds} s");
    assert!(
        include_str!("../../../../docs/reference/protocol.md").contains(&sentence),
        "{sentence}"
    );
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
fn as_many_of_the_longest_samples_as_travel_together_fit_a_frame_and_no_more() {
    let longest = Telemetry {
        tick: u32::MAX,
        drive_v: [1.0; 4],
        current_a: [1.0; 4],
        temperature_k: [Some(1.0); 4],
        limits: u16::MAX,
        states: [ChannelState::Tripped(1); 4],
        sensor_z_um: Some(1.0),
        pose: Pose {
            z_um: 1.0,
            tilt_rad: Some([1.0; 2]),
        },
        room: Some(Room {
            rise_ck: i16::MIN,
            deviation_ck: u16::MAX,
        }),
        uncertainty: Some(Uncertainty {
            z_nm: u16::MAX,
            tilt_urad: u16::MAX,
        }),
        settles_in_ms: Some(u16::MAX),
        trigger: Trigger::FRAME.with(Trigger::LINE),
    };
    let batch: TelemetryBatch = [longest; BATCH_SAMPLES].into_iter().collect();
    let bytes = postcard::to_stdvec(&batch).unwrap();
    let with_header = bytes.len() + 13;
    assert!(with_header <= MAX_FRAME_BYTES, "{with_header} bytes");
    assert!(with_header + bytes.len() / BATCH_SAMPLES > MAX_FRAME_BYTES);
    assert_eq!(
        postcard::from_bytes::<TelemetryBatch>(&bytes).unwrap(),
        batch
    );
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
