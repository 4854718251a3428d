//! Answers in SCPI's words: numbers in base units, texts in quotes.

use mirror_protocol::Status;

use crate::board::{find, level_um};
use crate::commands::Uncertainty;
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
    // A temperature may be of three ticks ago, when there was a drive still.
    let resistance = |i: usize| {
        let ohm = decimal(sample.drive_v[i]) / decimal(sample.current_a[i]);
        rises[i].map(|_| ohm).filter(|ohm| ohm.is_finite())
    };
    match reading {
        Reading::IsDriven => u8::from(is_driven(status)).to_string(),
        Reading::HasTripped => u8::from(has_tripped(status)).to_string(),
        Reading::LeastPosition => number(level_um(status).0 * 1e-6),
        Reading::MostPosition => number(decimal(status.max_position_um) * 1e-6),
        Reading::MostDrive => number(decimal(status.max_drive_v)),
        Reading::Supply => number(decimal(status.health.supply_v)),
        Reading::Position => {
            let sensor = sample.sensor_z_um.filter(|um| um.is_finite());
            sensor.map_or(NOT_A_NUMBER.to_owned(), |um| number(decimal(um) * 1e-6))
        }
        Reading::Pose => {
            let tilts = sample.pose.tilt_rad;
            let tilt = |i: usize| tilts.map(|rad| decimal(rad[i]));
            let z = decimal(sample.pose.z_um) * 1e-6;
            numbers([Some(z), tilt(0), tilt(1)])
        }
        Reading::Drives => numbers(sample.drive_v.map(|v| Some(decimal(v)))),
        Reading::Currents => numbers(sample.current_a.map(|i| Some(decimal(i)))),
        Reading::Resistances => numbers::<4>(std::array::from_fn(resistance)),
        Reading::Temperatures => numbers(rises),
        Reading::Room => numbers(sample.room.map_or([None; 2], |room| {
            let kelvin = |hundredths: f64| Some(decimal((hundredths / 100.0) as f32));
            [
                kelvin(room.rise_ck.into()),
                kelvin(room.deviation_ck.into()),
            ]
        })),
        Reading::Uncertainty => {
            let told = Uncertainty::from(sample);
            numbers([
                told.z_um.map(|um| um * 1e-6),
                told.tilt_deg.map(f64::to_radians),
            ])
        }
        Reading::SettlesIn => numbers([Uncertainty::from(sample).settles_in_s]),
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

pub(super) fn numbers<const N: usize>(values: [Option<f64>; N]) -> String {
    values
        .map(|value| value.map_or(NOT_A_NUMBER.to_owned(), number))
        .join(",")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::tests::status;
    use mirror_protocol::{Room, Telemetry};

    #[test]
    fn a_room_is_two_numbers_and_none_where_it_is_not_known() {
        let mut asked = status(Telemetry::default());
        let unknown = format!("{NOT_A_NUMBER},{NOT_A_NUMBER}");
        assert_eq!(read_from(Reading::Room, &asked), unknown);
        asked.telemetry.room = Some(Room {
            rise_ck: 899,
            deviation_ck: 4,
        });
        assert_eq!(read_from(Reading::Room, &asked), "8.99E0,4E-2");
    }

    /// A temperature of the last turn, and a drive that has ended since.
    #[test]
    fn a_resistance_is_of_a_drive_and_a_current() {
        let off = status(Telemetry {
            temperature_k: [Some(40.0), None, Some(40.0), None],
            drive_v: [0.0, 0.0, 2.0, 0.0],
            current_a: [0.0, 0.0, 5e-3, 0.0],
            ..Telemetry::default()
        });
        let told = format!("{NOT_A_NUMBER},{NOT_A_NUMBER},4E2,{NOT_A_NUMBER}");
        assert_eq!(read_from(Reading::Resistances, &off), told);
    }
}
