//! The wire format and the way from a command to the control tick, on the target.
#![no_std]
#![no_main]

use mirror_firmware as _;

#[embedded_test::tests]
mod tests {
    use control_core::{
        AdcCode, Calibration, Controller, LANES, Micrometre, PwmCode, Setpoint, Volt,
    };
    use embassy_futures::join::join;
    use embassy_futures::yield_now;
    use experiment::{FULL_SCALE, POINTS, Player, Quantity, Shape, Table, Waveform};
    use mirror_firmware::TICK_HZ;
    use mirror_firmware::board::Sensed;
    use mirror_firmware::control::Control;
    use mirror_firmware::factory;
    use mirror_firmware::mailbox::MAILBOX;
    use mirror_protocol::{
        CommandReply, Commanded, Drives, Hello, MAX_FRAME_BYTES, Position, Refusal, Status,
        StatusReply, Stream, Telemetry,
    };
    use serde::{Serialize, de::DeserializeOwned};
    use static_cell::StaticCell;

    fn comes_back<T: Serialize + DeserializeOwned + PartialEq + core::fmt::Debug>(message: T) {
        let mut frame = [0; MAX_FRAME_BYTES];
        let bytes = postcard::to_slice(&message, &mut frame).expect("it fits a frame");
        assert_eq!(
            postcard::from_bytes::<T>(bytes).expect("it is read again"),
            message
        );
    }

    #[test]
    fn messages_come_back_whole() {
        let telemetry = Telemetry {
            tick: u32::MAX,
            drive_v: [0.0, 1.9, 3.5, 1e-3],
            current_a: [5e-3; LANES],
            temperature_k: [Some(70.5), None, Some(-1.0), Some(0.0)],
            limits: 3,
            sensor_z_um: Some(119.97),
        };
        comes_back(Hello {
            protocol_version: u16::MAX,
        });
        comes_back(Position { z_um: 120.0 });
        comes_back(Drives {
            drive_v: [1.9; LANES],
        });
        comes_back(Stream {
            period_ticks: 10,
            count: 1000,
            mean_ticks: 10,
            slowing: 20,
        });
        comes_back::<CommandReply>(Ok(Commanded {
            tick: 1,
            drive_v: [1.9; LANES],
            limits: 0,
        }));
        comes_back::<CommandReply>(Err(Refusal::ProtocolVersion { board: 1, tool: 2 }));
        comes_back::<StatusReply>(Ok(Status {
            telemetry,
            limits_since_command: 0x1ff,
            max_position_um: 173.7,
            max_drive_v: 3.5,
            dropped_samples: 0,
        }));
    }

    #[test]
    fn random_bytes_are_an_error_and_no_panic() {
        let mut seed = 7_u32;
        let mut bytes = [0_u8; 64];
        for _ in 0..5_000 {
            for byte in &mut bytes {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *byte = (seed >> 24) as u8;
            }
            let _ = postcard::from_bytes::<Hello>(&bytes);
            let _ = postcard::from_bytes::<Drives>(&bytes);
            let _ = postcard::from_bytes::<Stream>(&bytes[..7]);
            let _ = postcard::from_bytes::<StatusReply>(&bytes);
        }
    }

    fn control() -> Control {
        static CALIBRATION: StaticCell<Calibration> = StaticCell::new();
        let calibration = CALIBRATION.init(factory::calibration());
        Control::new(Controller::new(calibration), &MAILBOX)
    }

    #[test]
    fn all_channels_are_off_at_start() {
        let codes = control().tick(Sensed::default());
        assert_eq!(codes, [PwmCode(0); LANES]);
    }

    #[test]
    async fn a_command_is_carried_out_by_the_next_tick_and_confirmed() {
        let mut control = control();
        let command = MAILBOX.command(Setpoint::Track(Micrometre(100.0)));
        let ticks = async {
            yield_now().await;
            control.tick(Sensed::default())
        };
        let (confirmed, codes) = join(command, ticks).await;
        let confirmed = confirmed.expect("a tick came");
        assert_eq!(confirmed.tick, 0);
        assert!(codes[0].0 > 1000, "{codes:?}");
        assert_eq!(confirmed.drive_v, codes.map(|code| code.drive().0));
    }

    #[test]
    async fn codes_become_currents_and_temperatures() {
        let mut control = control();
        let command = MAILBOX.command(Setpoint::Drive([Volt(2.0); LANES]));
        let (_, _) = join(command, async {
            yield_now().await;
            control.tick(Sensed::default());
        })
        .await;
        // 2 V through 400 ohm are 5 mA: 26214 steps of 12.5 mA / 65536.
        control.tick(Sensed {
            currents: [AdcCode(26_214); LANES],
            sensor_z: None,
        });
        let telemetry = MAILBOX.latest();
        let rise = telemetry.temperature_k[0].expect("the drive is large enough to tell");
        assert!((telemetry.current_a[0] - 5e-3).abs() < 1e-6);
        assert!(
            (rise - (400.0 / 360.0 - 1.0) / 3.92e-3).abs() < 0.05,
            "{rise}"
        );
    }

    #[test]
    async fn a_stream_ends_by_itself() {
        let mut control = control();
        MAILBOX.request_stream(Stream {
            period_ticks: 3,
            count: 4,
            ..Stream::default()
        });
        for _ in 0..100 {
            control.tick(Sensed::default());
        }
        for tick in [0, 3, 6, 9] {
            assert_eq!(MAILBOX.next_sample().await.tick, tick);
        }
        assert_eq!(MAILBOX.dropped_samples(), 0);
    }

    #[test]
    async fn a_waveform_is_driven_from_the_tick_after_it_was_asked_for() {
        assert!(MAILBOX.load_points(0, &[FULL_SCALE, 0]));
        assert!(!MAILBOX.load_points(POINTS - 1, &[1, 2]), "beyond the end");
        let waveform = Waveform {
            quantity: Quantity::Drive {
                active: [true, false, true, false],
                others_v: 0.5,
            },
            shape: Shape::Steps(Table {
                points: 2,
                dwell_ticks: 3,
            }),
            offset: 1.0,
            amplitude: 1.0,
            cycles: 1,
            ends_off: true,
        };
        let stream = Stream {
            period_ticks: 100,
            count: 10,
            slowing: 1,
            ..Stream::default()
        };
        let mut control = control();
        let player = Player::new(waveform, TICK_HZ).expect("playable");
        let (first_tick, ()) = join(MAILBOX.play(player, stream), async {
            yield_now().await;
            for _ in 0..9 {
                control.tick(Sensed::default());
            }
        })
        .await;
        assert_eq!(first_tick, Ok(0));
        // Before the waveform, at its two steps, and when it is over.
        for (tick, drive_v) in [
            (0, [0.0; 4]),
            (1, [2.0, 0.5, 2.0, 0.5]),
            (4, [1.0, 0.5, 1.0, 0.5]),
            (7, [0.0; 4]),
        ] {
            let sample = MAILBOX.next_sample().await;
            assert_eq!((sample.tick, sample.drive_v), (tick, drive_v));
        }
    }

    #[test]
    async fn samples_that_nobody_fetches_are_counted_as_dropped() {
        let mut control = control();
        MAILBOX.request_stream(Stream {
            period_ticks: 1,
            count: 100,
            ..Stream::default()
        });
        for _ in 0..100 {
            control.tick(Sensed::default());
        }
        assert!(MAILBOX.is_congested());
        assert_eq!(MAILBOX.dropped_samples(), 100 - 16);
    }
}
