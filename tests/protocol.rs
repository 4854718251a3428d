//! The wire format and the way from a command to the control tick, on the target.
#![no_std]
#![no_main]

use mirror_firmware as _;

#[embedded_test::tests]
mod tests {
    use control_core::{
        AdcCode, Ampere, CHANNELS, Calibration, Controller, Micrometre, PwmCode, SenseCalibration,
        Setpoint, SupplyCode, Volt,
    };
    use embassy_futures::join::join;
    use embassy_futures::yield_now;
    use mirror_firmware::TICK_HZ;
    use mirror_firmware::board::{Board, Sensed};
    use mirror_firmware::control::Control;
    use mirror_firmware::factory;
    use mirror_firmware::mailbox::{self, Failure, LinkSide, Order, QUEUED_SAMPLES};
    use mirror_firmware::retained::{KEPT_EVERY, Keep};
    use mirror_protocol::{
        ChannelState, CommandReply, Commanded, Drives, Health, Hello, LEASE_FOREVER_MS, Loss,
        MAX_FRAME_BYTES, OptionBytes, Pose, Position, Refusal, Renewal, Room, Sentence, Status,
        StatusReply, Stream, Telemetry, Uncertainty,
    };
    use protection::{Denied, Fault, Lease};
    use serde::{Serialize, de::DeserializeOwned};
    use static_cell::StaticCell;
    use waveforms::{
        FULL_SCALE, POINTS, Player, Quantity, Shape, Table, Trigger, Triggers, Waveform,
    };

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
            uncertainty: Some(Uncertainty {
                z_nm: 412,
                tilt_urad: 350,
            }),
            settles_in_ms: Some(3),
            trigger: Trigger::LINE,
            tick: u32::MAX,
            drive_v: [0.0, 1.9, 3.5, 1e-3],
            current_a: [5e-3; CHANNELS],
            temperature_k: [Some(70.5), None, Some(-1.0), Some(0.0)],
            limits: 3,
            states: [
                ChannelState::Off,
                ChannelState::Driving,
                ChannelState::Limited,
                ChannelState::Tripped(11),
            ],
            sensor_z_um: Some(119.97),
            pose: Pose {
                z_um: 120.0,
                tilt_rad: Some([1e-3, -2e-3]),
            },
            room: Some(Room {
                rise_ck: -1234,
                deviation_ck: 5,
            }),
        };
        comes_back(Hello {
            protocol_version: u16::MAX,
        });
        comes_back(Position {
            z_um: 120.0,
            lease_ms: LEASE_FOREVER_MS,
        });
        comes_back(Renewal { lease_ms: 100 });
        comes_back(Drives {
            drive_v: [1.9; CHANNELS],
            lease_ms: 0,
        });
        comes_back(Stream {
            period_ticks: 10,
            count: 1000,
            mean_ticks: 10,
            slowing: 20,
        });
        comes_back::<CommandReply>(Ok(Commanded {
            tick: 1,
            drive_v: [1.9; CHANNELS],
            limits: 0,
        }));
        comes_back::<CommandReply>(Err(Refusal::ProtocolVersion { board: 1, tool: 2 }));
        comes_back::<StatusReply>(Ok(Status {
            telemetry,
            health: Health {
                lease_left_ms: Some(599_999),
                supply_v: 5.0,
                missed_ticks: 0,
                late_ticks: 0,
                limits_since_command: 0xfff,
                compensates_room: true,
                lowest_position_um: 18.25,
                loss: Some(Loss {
                    change: -0.2,
                    deviation: 0.1,
                }),
            },
            max_position_um: 173.7,
            max_drive_v: 3.5,
            dropped_samples: 0,
            stops: 3,
            last_stop: Sentence::try_from("panicked").expect("short"),
            option_bytes: Some(OptionBytes {
                brown_out_level: 4,
                boots_by_pin: false,
                is_dual_bank: true,
            }),
        }));
    }

    #[test]
    fn random_bytes_are_refused_or_a_message_that_stays_the_same() {
        let mut seed = 7_u32;
        let mut bytes = [0_u8; 64];
        for _ in 0..5_000 {
            for byte in &mut bytes {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *byte = (seed >> 24) as u8;
            }
            refused_or_stable::<Hello>(&bytes);
            refused_or_stable::<Drives>(&bytes);
            refused_or_stable::<Stream>(&bytes[..7]);
            refused_or_stable::<StatusReply>(&bytes);
        }
    }

    /// What is read of `bytes`, if anything is, reads as itself again. (Bytes are compared, because NaN is not itself.)
    fn refused_or_stable<T: Serialize + DeserializeOwned>(bytes: &[u8]) {
        let (mut first, mut second) = ([0; 128], [0; 128]);
        if let Ok(message) = postcard::from_bytes::<T>(bytes) {
            let written =
                postcard::to_slice(&message, &mut first).expect("no longer than what was read");
            let again: T = postcard::from_bytes(written).expect("it was a message");
            let rewritten = postcard::to_slice(&again, &mut second).expect("as long");
            assert_eq!(rewritten, written);
        }
    }

    /// What outlives a reset of it.
    static RETAINED: Keep = Keep::empty();

    /// A control loop under the factory's calibration, and the link's side of its mailbox.
    fn control() -> (LinkSide, Control) {
        static CALIBRATION: StaticCell<Calibration> = StaticCell::new();
        let calibration = CALIBRATION.init(factory::calibration());
        let (link, side) = mailbox::take();
        let control = Control::new(
            Controller::new(calibration),
            &SenseCalibration::DESIGNED,
            side,
            &RETAINED,
        );
        (link, control)
    }

    /// Two checks of the heaters, the supply of the stages before each, and the pause between.
    const START_TICKS: u32 = 2591;

    #[test]
    fn nothing_is_driven_at_start_but_the_check_of_the_heaters() {
        let (link, mut control) = control();
        let mut codes = [PwmCode(0); CHANNELS];
        for _ in 0..START_TICKS {
            codes = control.tick(sound(codes));
            assert!(codes.iter().all(|code| code.0 <= 300), "{codes:?}");
        }
        assert_eq!(codes, [PwmCode(0); CHANNELS]);
        assert_eq!(link.latest().states, [ChannelState::Ready; CHANNELS]);
    }

    /// Four heaters of 400 ohm at the codes that are driven, and a sound supply.
    fn sound(codes: [PwmCode; CHANNELS]) -> Sensed {
        heaters(codes, [400.0; CHANNELS])
    }

    fn heaters(codes: [PwmCode; CHANNELS], ohm: [f32; CHANNELS]) -> Sensed {
        let code = |i: usize| AdcCode::nearest(Ampere(codes[i].drive().0 / ohm[i]));
        Sensed {
            currents: core::array::from_fn(code),
            supply: SupplyCode::from_millivolt(5000),
            ..Sensed::default()
        }
    }

    /// Wants `setpoint` and lets `ticks` pass with sound heaters; what was driven last. A test that awaits nothing takes less of RAM.
    fn driven(
        (link, control): (LinkSide, &mut Control),
        setpoint: Setpoint,
        ticks: u32,
    ) -> [PwmCode; CHANNELS] {
        link.post(Order::Drive(setpoint, Lease::FOREVER));
        let mut codes = [PwmCode(0); CHANNELS];
        for _ in 0..ticks {
            codes = control.tick(sound(codes));
        }
        codes
    }

    /// Gives `order` and lets `ticks` pass with `board` behind the pins; what was driven last.
    async fn carry_out(
        (link, control): (LinkSide, &mut Control),
        order: Order,
        ticks: u32,
        board: impl Fn([PwmCode; CHANNELS]) -> Sensed,
    ) -> (Result<Commanded, Failure>, [PwmCode; CHANNELS]) {
        let ordered = link.order(order);
        let ticking = async {
            yield_now().await;
            let mut codes = [PwmCode(0); CHANNELS];
            for _ in 0..ticks {
                codes = control.tick(board(codes));
            }
            codes
        };
        join(ordered, ticking).await
    }

    #[test]
    async fn a_command_is_carried_out_once_the_heaters_are_checked_and_confirmed() {
        let (link, mut control) = control();
        let order = Order::Drive(Setpoint::track(Micrometre(100.0)), Lease::FOREVER);
        let (confirmed, codes) =
            carry_out((link, &mut control), order, START_TICKS + 15, sound).await;
        let confirmed = confirmed.expect("the heaters are sound");
        // In one of the 15 ticks that went by.
        assert!(confirmed.tick.abs_diff(START_TICKS) < 15, "{confirmed:?}");
        assert!(codes[0].0 > 1000, "{codes:?}");
        // The heaters were cold then, and took less voltage for the same power.
        assert!((1.0..codes[0].drive().0).contains(&confirmed.drive_v[0]));
        assert_eq!(link.latest().states, [ChannelState::Driving; CHANNELS]);
        // From then on the next tick does it.
        let order = Order::Drive(Setpoint::track(Micrometre(50.0)), Lease::FOREVER);
        let (confirmed, lower) = carry_out((link, &mut control), order, 1, |_| sound(codes)).await;
        assert!(confirmed.is_ok() && lower[0].0 < codes[0].0, "{lower:?}");
    }

    #[test]
    fn what_the_mirror_remembers_outlives_a_reset() {
        let (link, mut control) = control();
        assert!(RETAINED.kept().is_none());
        let there = Setpoint::position(Micrometre(50.0));
        driven((link, &mut control), there, START_TICKS + 5 * KEPT_EVERY);
        let kept = RETAINED.kept().expect("it is whole");
        let mut words = kept.iter().flat_map(|actuator| actuator.to_words());
        assert!(words.any(|word| word != 0));
    }

    #[test]
    async fn an_open_heater_trips_in_the_check_and_is_told() {
        let (link, mut control) = control();
        let order = Order::Drive(Setpoint::Drive([Volt(3.0); CHANNELS]), Lease::FOREVER);
        let open = |codes| heaters(codes, [400.0, f32::INFINITY, 400.0, 400.0]);
        let (confirmed, codes) = carry_out((link, &mut control), order, 40, open).await;
        let denied = Err(Failure::Denied(Denied::Tripped(Fault::OpenHeater)));
        assert_eq!(confirmed, denied);
        assert_eq!(codes, [PwmCode(0); CHANNELS]);
        let off = ChannelState::Off;
        let tripped = ChannelState::Tripped(Fault::OpenHeater.code());
        assert_eq!(link.latest().states, [off, tripped, off, off]);
        assert_eq!(
            carry_out((link, &mut control), order, 1, sound).await.0,
            denied
        );
        let (cleared, _) =
            carry_out((link, &mut control), Order::Clear, 2 * START_TICKS, sound).await;
        assert!(cleared.is_ok());
        let (confirmed, codes) =
            carry_out((link, &mut control), order, START_TICKS + 15, sound).await;
        assert!(confirmed.is_ok());
        assert_eq!(codes, [PwmCode(3000); CHANNELS]);
    }

    #[test]
    async fn a_lease_that_is_not_renewed_ends_in_a_ramp_to_zero() {
        let (link, mut control) = control();
        let drive = Setpoint::Drive([Volt(2.0); CHANNELS]);
        let order = Order::Drive(drive, Lease::ticks(100));
        let (_, mut codes) = carry_out((link, &mut control), order, START_TICKS + 85, sound).await;
        assert_eq!(codes, [PwmCode(2000); CHANNELS]);
        let renewed = carry_out(
            (link, &mut control),
            Order::Renew(Lease::ticks(30)),
            1,
            |_| sound(codes),
        );
        assert!(renewed.await.0.is_ok());
        for _ in 0..30 {
            codes = control.tick(sound(codes));
        }
        assert!(codes[0].0 < 2000, "{codes:?}");
        let falls = |codes: [PwmCode; CHANNELS], next: [PwmCode; CHANNELS]| codes[0].0 - next[0].0;
        for _ in 0..600 {
            let next = control.tick(sound(codes));
            assert!(falls(codes, next) <= 4, "a ramp, no step");
            codes = next;
        }
        assert_eq!(codes, [PwmCode(0); CHANNELS]);
        let late = carry_out(
            (link, &mut control),
            Order::Renew(Lease::FOREVER),
            1,
            |_| sound(codes),
        );
        assert_eq!(late.await.0, Err(Failure::Denied(Denied::NoLease)));
    }

    /// A board on which every tick is too late for the next.
    struct Late;

    impl Board for Late {
        const NAME: &'static str = "late";
        const IS_EMULATED: bool = true;
        const BOOTLOADER: Option<fn() -> !> = None;

        fn drive(&mut self, _codes: [PwmCode; CHANNELS], _trigger: Trigger) -> bool {
            false
        }

        fn disable(&mut self) {}
    }

    #[test]
    async fn a_tick_that_is_too_late_is_counted_and_what_is_applied_is_not_said_to_be_new() {
        let (link, mut control) = control();
        let drive = Setpoint::Drive([Volt(2.0); CHANNELS]);
        let order = Order::Drive(drive, Lease::FOREVER);
        let (_, codes) = carry_out((link, &mut control), order, START_TICKS + 15, sound).await;
        link.post(Order::Drive(
            Setpoint::Drive([Volt(1.0); CHANNELS]),
            Lease::FOREVER,
        ));
        control.tick_on(&mut Late, sound(codes));
        control.tick(sound(codes));
        assert_eq!(link.health().late_ticks, 1);
        assert_eq!(link.latest().drive_v, [2.0; CHANNELS]);
    }

    #[test]
    fn codes_become_currents_and_temperatures() {
        let (link, mut control) = control();
        let drive = Setpoint::Drive([Volt(2.0); CHANNELS]);
        let codes = driven((link, &mut control), drive, START_TICKS + 15);
        // 2 V through 400 ohm are 5 mA: 26214 steps of 0.19 uA, above a zero at 649.
        control.tick(Sensed {
            currents: [AdcCode(26_214 + 649); CHANNELS],
            ..sound(codes)
        });
        let telemetry = link.latest();
        let rise = telemetry.temperature_k[0].expect("the drive is large enough to tell");
        assert!((telemetry.current_a[0] - 5e-3).abs() < 1e-6);
        // Five steps of the converter: 0.19 uA of 5 mA is 0.011 K.
        assert!(
            (rise - (400.0 / 360.0 - 1.0) / 3.92e-3).abs() < 0.05,
            "{rise}"
        );
    }

    #[test]
    async fn a_stream_ends_by_itself() {
        let (link, mut control) = control();
        link.request_stream(Stream {
            period_ticks: 3,
            count: 4,
            ..Stream::default()
        });
        for _ in 0..100 {
            control.tick(Sensed::default());
        }
        // As many as fill a frame, and then what is left.
        for ticks in [&[0, 3, 6][..], &[9]] {
            let samples = link.next_samples().await;
            assert!(samples.iter().map(|sample| &sample.tick).eq(ticks));
        }
        assert_eq!(link.dropped_samples(), 0);
    }

    #[test]
    async fn a_waveform_is_driven_from_the_tick_after_it_was_asked_for() {
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
            triggers: Triggers::default(),
        };
        let stream = Stream {
            period_ticks: 100,
            count: 10,
            slowing: 1,
            ..Stream::default()
        };
        let (link, mut control) = control();
        assert!(link.load_points(0, &[FULL_SCALE, 0]));
        assert!(!link.load_points(POINTS - 1, &[1, 2]), "beyond the end");
        let player = Player::new(waveform, TICK_HZ).expect("playable");
        let playing = link.play(player, stream, Lease::FOREVER);
        let (first_tick, ()) = join(playing, async {
            yield_now().await;
            let mut codes = [PwmCode(0); CHANNELS];
            for _ in 0..START_TICKS + 10 {
                codes = control.tick(sound(codes));
            }
        })
        .await;
        let first_tick = first_tick.expect("the heaters are sound");
        assert!(first_tick >= START_TICKS - 1, "after their check");
        // Before the waveform, at its two steps, and when it is over.
        for expected in [
            &[
                (0, [0.0; 4]),
                (1, [2.0, 0.5, 2.0, 0.5]),
                (4, [1.0, 0.5, 1.0, 0.5]),
            ][..],
            &[(7, [0.0; 4])],
        ] {
            let samples = link.next_samples().await;
            let samples = samples
                .iter()
                .map(|sample| (sample.tick - first_tick, sample.drive_v));
            assert!(samples.eq(expected.iter().copied()));
        }
    }

    #[test]
    async fn samples_that_nobody_fetches_are_counted_as_dropped() {
        let (link, mut control) = control();
        link.request_stream(Stream {
            period_ticks: 1,
            count: 100,
            ..Stream::default()
        });
        for _ in 0..100 {
            control.tick(Sensed::default());
        }
        assert!(control.is_congested());
        assert_eq!(link.dropped_samples(), 100 - QUEUED_SAMPLES as u32);
    }
}
