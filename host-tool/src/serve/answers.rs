//! Answers in SCPI's words: numbers in base units, texts in quotes.

use mirror_protocol::Status;

use crate::board::find;
use crate::names::{limit_names, state_name};
use crate::report::decimal;
use crate::scpi::{NOT_A_NUMBER, quoted};
use crate::serve::action::Reading;
use crate::serve::states::{has_tripped, is_driven};

/// The boards that are there, as strings; an empty one where there is none.
pub(super) fn boards() -> String {
    let names: Vec<String> = find().iter().map(|board| quoted(&board.name)).collect();
    match names[..] {
        [] => quoted(""),
        _ => names.join(","),
    }
}

/// What the board's status answers.
pub(super) fn read_from(reading: Reading, status: &Status) -> String {
    let sample = &status.telemetry;
    let rises = sample.temperature_k.map(|kelvin| kelvin.map(decimal));
    let resistance =
        |i: usize| rises[i].map(|_| decimal(sample.drive_v[i]) / decimal(sample.current_a[i]));
    match reading {
        Reading::IsDriven => u8::from(is_driven(status)).to_string(),
        Reading::HasTripped => u8::from(has_tripped(status)).to_string(),
        Reading::MostPosition => number(decimal(status.max_position_um) * 1e-6),
        Reading::MostDrive => number(decimal(status.max_drive_v)),
        Reading::Supply => number(decimal(status.health.supply_v)),
        Reading::Position => {
            let sensor = sample.sensor_z_um.filter(|um| um.is_finite());
            sensor.map_or(NOT_A_NUMBER.to_owned(), |um| number(decimal(um) * 1e-6))
        }
        Reading::Drives => numbers(sample.drive_v.map(|v| Some(decimal(v)))),
        Reading::Currents => numbers(sample.current_a.map(|i| Some(decimal(i)))),
        Reading::Resistances => numbers(std::array::from_fn(resistance)),
        Reading::Temperatures => numbers(rises),
        Reading::Limits => quoted(&limit_names(status.health.limits_since_command).join(" ")),
        Reading::Channels => sample
            .states
            .map(|state| quoted(&state_name(state)))
            .join(","),
    }
}

/// As SCPI writes a number.
pub(super) fn number(value: f64) -> String {
    format!("{value:E}")
}

pub(super) fn numbers(values: [Option<f64>; 4]) -> String {
    values
        .map(|value| value.map_or(NOT_A_NUMBER.to_owned(), number))
        .join(",")
}
