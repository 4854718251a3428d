use super::*;
use mirror_protocol::{ChannelState, Health, Pose, Sentence, Telemetry};

fn text(text: &str) -> Text {
    Text::try_from(text).expect("short")
}

fn calibration() -> CalibrationInfo {
    CalibrationInfo {
        device: text("mirror 7"),
        date: text("2026-11-21"),
        model_hash: 7,
        max_position_um: 173.7,
        max_drive_v: 3.5,
        cold_resistance_ohm: [361.25, 358.0, 360.0, 362.5],
        tcr_per_k: [3.92e-3; 4],
        levers: [Lever::default(); 4],
        kept: Kept::Yes,
    }
}

#[test]
fn a_calibration_is_told_by_its_mirror_and_the_factorys_by_none() {
    let of = |device: &str, date: &str, kept| {
        calibrated_words(&CalibrationInfo {
            device: text(device),
            date: text(date),
            kept,
            ..calibration()
        })
    };
    assert_eq!(
        of("mirror 7", "2026-11-21", Kept::Yes),
        "mirror 7, 2026-11-21, kept in flash"
    );
    assert_eq!(of("", "", Kept::Yes), "an unnamed mirror, kept in flash");
    assert_eq!(of("", "", Kept::Factory), "as the factory left it");
}

/// A heater of 357 ohm whose resistance bends, and the line through it where it is hot.
#[test]
fn a_cold_resistance_is_what_the_heater_told_and_not_where_its_line_begins() {
    const FILE: &str = include_str!("../../../../../hil/tests/mirror-77.toml");
    let calibration = calibration::from_toml("mirror-77.toml", FILE).expect("a calibration");
    let mut parts = *calibration.parts();
    for actuator in &mut parts.actuators {
        actuator.cold_resistance.0 = 369.0;
        actuator.tcr.0 = 4e-3;
        actuator.sensed_rises.knots[0] = -8.0;
    }
    let bent = Calibration::new(parts).expect("a mirror can have it");
    for ohm in cold_ohm(&bent) {
        // 369 ohm less 8 K of 4e-3 / K; numbers are f32.
        assert!((ohm - 357.19).abs() < 0.01, "{ohm}");
    }
}

#[test]
fn is_printed_as_in_the_golden_file() {
    let identity = Identity {
        protocol_version: 1,
        firmware_version: text("0.1.0"),
        build: text("a396533"),
        board: text("STM32G474RE driver board"),
        is_emulated: false,
        tick_hz: 10_000,
    };
    let calibration = calibration();
    let status = Status {
        telemetry: Telemetry {
            tick: 123_456,
            drive_v: [1.9, 0.2, 0.0, 0.2],
            current_a: [4.43e-3, 0.554e-3, 0.0, 0.549e-3],
            temperature_k: [Some(48.8), Some(0.7), None, Some(3.0)],
            limits: 0,
            uncertainty: Some(mirror_protocol::Uncertainty {
                z_nm: 412,
                tilt_urad: 350,
            }),
            settles_in_ms: Some(3),
            trigger: mirror_protocol::Trigger::NONE,
            states: [
                ChannelState::Driving,
                ChannelState::Driving,
                ChannelState::Tripped(1),
                ChannelState::Driving,
            ],
            sensor_z_um: Some(17.25),
            pose: Pose {
                z_um: 16.5,
                tilt_rad: Some([0.5e-3, -0.25]),
            },
            room: Some(mirror_protocol::Room {
                rise_ck: 1020,
                deviation_ck: 5,
            }),
        },
        health: Health {
            lease_left_ms: Some(598_765),
            supply_v: 5.004,
            missed_ticks: 2,
            late_ticks: 3,
            limits_since_command: 0,
            compensates_room: true,
            lowest_position_um: 12.3,
            loss: Some(mirror_protocol::Loss {
                change: 0.012,
                deviation: 0.002,
            }),
        },
        max_position_um: 173.7,
        max_drive_v: 3.5,
        dropped_samples: 7,
        stops: 0,
        last_stop: Sentence::try_from("panicked at src/control.rs:1:1").expect("short"),
        option_bytes: Some(OptionBytes {
            brown_out_level: 0,
            boots_by_pin: true,
            is_dual_bank: true,
        }),
    };
    let report = StatusReport::new(identity.clone(), calibration.clone(), &status);
    assert_eq!(
        report.to_string(),
        include_str!("../../../../tests/golden/status.txt")
    );
    let waited_for = Owner {
        process: 7,
        command: "host-tool record".to_owned(),
        since: "2026-11-21T14:05:00Z".to_owned(),
    };
    let mut report = StatusReport {
        owner: Some(waited_for),
        ..report
    };
    let line =
        "owner      `host-tool record` (process 7), since 2026-11-21T14:05:00Z, until just now";
    let tells = |report: &StatusReport, line: &str| {
        assert!(
            report.to_string().lines().any(|told| told == line),
            "{report}"
        );
    };
    tells(&report, line);
    report.is_in_use = true;
    let line = "in use     by `host-tool record` (process 7), since 2026-11-21T14:05:00Z";
    tells(&report, line);
    report.sense_gain = [1.003, 0.9975, 1.0, 1.0];
    let line =
        "sense           0.30 %     -0.25 %      0.00 %      0.00 %  from the gains as designed";
    tells(&report, line);
    let json = serde_json::to_value(&report).expect("JSON");
    assert_eq!(json["calibration"]["model_hash"], "0000000000000007");
    let factorys = CalibrationInfo {
        kept: Kept::Factory,
        cold_resistance_ohm: [360.0; 4],
        ..calibration
    };
    let report = StatusReport::new(identity, factorys, &status);
    // 15 of 360 ohm are 10.6 K cold, and in proportion to the resistance when it is warm.
    let uncertainty_k = report.uncertainty_k.expect("nothing was measured");
    assert!((uncertainty_k[0] - 12.66).abs() < 0.01, "{uncertainty_k:?}");
    assert!((uncertainty_k[2] - 10.63).abs() < 0.01, "{uncertainty_k:?}");
    let line = "known to 15 ohm, so temperatures to 12.7 K, until";
    assert!(report.to_string().contains(line), "{report}");
}
