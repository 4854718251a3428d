//! A board's answer, for tests.

use mirror_protocol::{Health, Sentence, Status, Telemetry};

/// Of a mirror of 170 um at up to 3.5 V.
pub(crate) fn status(telemetry: Telemetry) -> Status {
    Status {
        telemetry,
        health: Health::default(),
        max_position_um: 170.0,
        max_drive_v: 3.5,
        dropped_samples: 0,
        stops: 0,
        last_stop: Sentence::default(),
        option_bytes: None,
    }
}
