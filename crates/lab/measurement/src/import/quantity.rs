//! Names that people give to quantities.

use crate::column::{COLUMNS, Column};

/// In lower case, with `_` between words.
const NAMES: [(&str, Column); 60] = [
    ("t", Column::Time),
    ("t_s", Column::Time),
    ("time", Column::Time),
    ("zeit", Column::Time),
    ("elapsed", Column::Time),
    ("timestamp", Column::Time),
    ("zeitstempel", Column::Time),
    ("s", Column::Time),
    ("ms", Column::Time),
    ("us", Column::Time),
    ("v", Column::VoltageOfAll),
    ("u", Column::VoltageOfAll),
    ("mv", Column::VoltageOfAll),
    ("volt", Column::VoltageOfAll),
    ("volts", Column::VoltageOfAll),
    ("voltage", Column::VoltageOfAll),
    ("spannung", Column::VoltageOfAll),
    ("drive", Column::VoltageOfAll),
    ("bias", Column::VoltageOfAll),
    ("i", Column::CurrentOfEach),
    ("ma", Column::CurrentOfEach),
    ("ua", Column::CurrentOfEach),
    ("amps", Column::CurrentOfEach),
    ("current", Column::CurrentOfEach),
    ("strom", Column::CurrentOfEach),
    ("z", Column::Displacement),
    ("d", Column::Displacement),
    ("um", Column::Displacement),
    ("nm", Column::Displacement),
    ("height", Column::Displacement),
    ("höhe", Column::Displacement),
    ("hoehe", Column::Displacement),
    ("displacement", Column::Displacement),
    ("deflection", Column::Displacement),
    ("position", Column::Displacement),
    ("weg", Column::Displacement),
    ("hub", Column::Displacement),
    ("auslenkung", Column::Displacement),
    ("verschiebung", Column::Displacement),
    ("t_ambient", Column::Ambient),
    ("ambient", Column::Ambient),
    ("t_amb", Column::Ambient),
    ("t_room", Column::Ambient),
    ("room_t", Column::Ambient),
    ("room", Column::Ambient),
    ("room_temp", Column::Ambient),
    ("room_temperature", Column::Ambient),
    ("ambient_temp", Column::Ambient),
    ("ambient_temperature", Column::Ambient),
    ("umgebungstemperatur", Column::Ambient),
    ("oven", Column::Ambient),
    ("temperature", Column::Ambient),
    ("temp", Column::Ambient),
    ("temperatur", Column::Ambient),
    ("raumtemperatur", Column::Ambient),
    ("tilt_x", Column::TiltX),
    ("tilt_y", Column::TiltY),
    ("kippung_x", Column::TiltX),
    ("kippung_y", Column::TiltY),
    ("reference", Column::Reference),
];

/// Names that say it where none of the others does.
const OTHER_NAMES: [(&str, Column); 17] = [
    ("second", Column::Time),
    ("seconds", Column::Time),
    ("sec", Column::Time),
    ("time_stamp", Column::Time),
    ("date", Column::Time),
    ("datum", Column::Time),
    ("date_time", Column::Time),
    ("datetime", Column::Time),
    ("datum_uhrzeit", Column::Time),
    ("uhrzeit", Column::Time),
    ("x_value", Column::Time),
    ("disp", Column::Displacement),
    ("gap", Column::Displacement),
    ("travel", Column::Displacement),
    ("stroke", Column::Displacement),
    ("amp", Column::CurrentOfEach),
    ("ampere", Column::CurrentOfEach),
];

/// Words that may stand beside a quantity and leave it the same.
const BESIDE: [&str; 11] = [
    "avg", "average", "mean", "mittel", "delta", "\u{3b4}", "elapsed", "relative", "rel", "in",
    "utc",
];

/// What may stand between a quantity and its actuator's number, `Voltage CH1`, `Strom Kanal 2`, or with it before the quantity, `CH1 Voltage`.
const CHANNELS: [&str; 4] = ["ch", "channel", "kanal", "actuator"];

/// The quantity of this name; with a number from 1 to 4 behind it, that of one actuator.
pub(super) fn named(name: &str) -> Option<Column> {
    named_from(1, name)
}

/// The same where actuators count from another number.
pub(super) fn named_from(first: u32, name: &str) -> Option<Column> {
    let name = key(name);
    let whole = NAMES.iter().find(|(known, _)| *known == name);
    let of_all = whole.map(|&(_, column)| column);
    of_all.or_else(|| of_one(first, &name))
}

/// The quantity that a name says in other words: `Uhrzeit`, `z avg`, `Δz`.
pub(super) fn in_other_words(name: &str) -> Option<Column> {
    let apart = name
        .replace(['\u{394}', '\u{2206}'], "delta ")
        .to_lowercase();
    let words = apart.split(|c: char| !c.is_alphanumeric());
    let words = words.filter(|word| !word.is_empty() && !BESIDE.contains(word));
    let name = words.collect::<Vec<_>>().join("_");
    let mut others = OTHER_NAMES.iter();
    let other = others.find(|(known, _)| *known == name);
    other.map(|&(_, column)| column).or_else(|| named(&name))
}

/// The displacement of a name with a number behind it, as of one of several points: `z1`.
pub(super) fn numbered(name: &str) -> Option<Column> {
    let all = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let column = in_other_words(all).filter(|_| all.len() < name.len());
    column.filter(|column| *column == Column::Displacement)
}

/// Names of temperatures of anything.
const OF_ANYTHING: [&str; 3] = ["temperature", "temp", "temperatur"];

/// Whether a name says a temperature, and not what has it.
pub(super) fn is_of_anything(name: &str) -> bool {
    OF_ANYTHING.contains(&key(name).as_str())
}

/// The quantity that a user says, who may say it as measurement files do.
pub(super) fn said(name: &str) -> Option<Column> {
    let mut columns = COLUMNS.iter().filter(|(_, c)| *c != Column::Trigger);
    let in_files = columns.find(|(known, _)| known.eq_ignore_ascii_case(name));
    named(name).or(in_files.map(|&(_, column)| column))
}

/// A name to compare by.
pub(super) fn key(name: &str) -> String {
    let words: Vec<&str> = name.split([' ', '_']).filter(|w| !w.is_empty()).collect();
    words.join("_").to_lowercase()
}

fn of_one(first: u32, name: &str) -> Option<Column> {
    let (quantity, digit) = behind_its_channel(name).or_else(|| before_its_number(name))?;
    let number = digit.to_digit(10)?;
    let actuator = number.checked_sub(first).filter(|&index| index < 4)? as usize;
    match named(quantity)? {
        Column::VoltageOfAll => Some(Column::Voltage(actuator)),
        Column::CurrentOfEach => Some(Column::Current(actuator)),
        _ => None,
    }
}

/// The quantity and the number of `voltage_ch1`, `strom_2` or `u1`.
fn before_its_number(name: &str) -> Option<(&str, char)> {
    let digit = name.chars().last()?;
    let all = name[..name.len() - digit.len_utf8()].trim_end_matches('_');
    let mut channels = CHANNELS.iter();
    let quantity = channels.find_map(|channel| all.strip_suffix(channel)?.strip_suffix('_'));
    Some((quantity.unwrap_or(all), digit))
}

/// The same of `ch1_voltage` or `kanal_2_strom`.
fn behind_its_channel(name: &str) -> Option<(&str, char)> {
    let mut channels = CHANNELS.iter();
    let behind = channels.find_map(|channel| name.strip_prefix(channel))?;
    let (number, quantity) = behind.trim_start_matches('_').split_once('_')?;
    let mut digits = number.chars();
    let digit = digits.next().filter(|_| digits.next().is_none())?;
    Some((quantity, digit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_of_one_actuator_are_told_by_their_number() {
        for (name, column) in [
            ("U1", Some(Column::Voltage(0))),
            ("Spannung 2", Some(Column::Voltage(1))),
            ("Voltage CH3", Some(Column::Voltage(2))),
            ("Strom Kanal 4", Some(Column::Current(3))),
            ("i_1", Some(Column::Current(0))),
            ("CH1 Voltage", Some(Column::Voltage(0))),
            ("Kanal_4_Strom", Some(Column::Current(3))),
            ("channel12_voltage", None),
            ("CH5 Current", None),
            ("CH1 Height", None),
            ("Höhe", Some(Column::Displacement)),
            ("HÖHE", Some(Column::Displacement)),
            ("V5", None),
            ("V12", None),
            ("z1", None),
            ("1", None),
            ("CH1", None),
            ("V0", None),
            ("", None),
        ] {
            assert_eq!(named(name), column, "{name}");
        }
        assert_eq!(named_from(0, "V0"), Some(Column::Voltage(0)));
        assert_eq!(named_from(0, "Strom 3"), Some(Column::Current(3)));
    }

    #[test]
    fn a_user_may_say_the_name_that_files_have() {
        for (name, column) in COLUMNS.iter().filter(|(_, c)| *c != Column::Trigger) {
            assert_eq!(said(name), Some(*column), "{name}");
        }
    }
}
