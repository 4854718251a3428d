//! What faults, limits and states are called.

use control_core::{Limit, Limits};
use mirror_protocol::{ChannelState, Status};
use protection::Fault;

/// The names of the limits that acted.
pub(crate) fn limit_names(bits: u16) -> Vec<&'static str> {
    Limits::from_bits(bits)
        .iter()
        .map(|limit| limit.name())
        .collect()
}

/// The names of the limits that acted since the mirror was asked to a position. That the surroundings bend it further than that is so only
/// where it is still so: the way there from rest may begin below.
pub(crate) fn limits_of_position(status: &Status) -> Vec<&'static str> {
    let acting = Limits::from_bits(status.telemetry.limits);
    Limits::from_bits(status.health.limits_since_command)
        .iter()
        .filter(|limit| *limit != Limit::RoomWarm || acting.contains(*limit))
        .map(|limit| limit.name())
        .collect()
}

/// What the mirror's own limit is called beside those of the board.
pub(crate) const BANDWIDTH: &str = "bandwidth";

/// Names less alike than this (Jaro's similarity) are not meant, as clap has it for its own.
const ALIKE: f64 = 0.7;

/// The name of `known` that is most like `name`, if one is.
pub(crate) fn nearest<T: AsRef<str>>(
    name: &str,
    known: impl IntoIterator<Item = T>,
) -> Option<String> {
    let similarity = |known: T| {
        (
            strsim::jaro(name, known.as_ref()),
            known.as_ref().to_owned(),
        )
    };
    let alike = known.into_iter().map(similarity);
    let (similarity, nearest) = alike.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (similarity > ALIKE).then_some(nearest)
}

/// The limits that acted, as a line for people.
pub(crate) fn limited_line(names: &[&str]) -> String {
    let names = if names.is_empty() {
        "by nothing".to_owned()
    } else {
        names.join(", ")
    };
    format!("limited    {names}")
}

/// What a channel is doing, in a word that scripts know too.
pub(crate) fn state_name(state: ChannelState) -> String {
    match state {
        ChannelState::Off => "off".to_owned(),
        ChannelState::Starting => "starting".to_owned(),
        ChannelState::Ready => "ready".to_owned(),
        ChannelState::Driving => "driving".to_owned(),
        ChannelState::Limited => "limited".to_owned(),
        ChannelState::Tripped(fault) => format!("tripped: {}", fault_name(fault)),
    }
}

/// The name of the fault with this code.
pub(crate) fn fault_name(code: u8) -> &'static str {
    Fault::from_code(code).map_or("a fault that this tool does not know", Fault::name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::tests::status;
    use mirror_protocol::Telemetry;

    #[test]
    fn a_room_that_bends_the_mirror_further_only_on_the_way_is_no_limit_of_a_position() {
        let mut warm = Limits::NONE;
        warm.insert(Limit::RoomWarm);
        let mut acted = warm;
        acted.insert(Limit::Cooling);
        let told = |acting: Limits| {
            let limits = acting.bits();
            let mut told = status(Telemetry {
                limits,
                ..Telemetry::default()
            });
            told.health.limits_since_command = acted.bits();
            limits_of_position(&told)
        };
        assert_eq!(told(Limits::NONE), ["cooling"]);
        assert_eq!(told(warm), ["cooling", "room-warm"]);
    }

    #[test]
    fn what_is_meant_is_found_and_what_is_not_is_none() {
        let known = ["over-temperature", "over-current", "open-heater"];
        assert_eq!(
            nearest("overtemp", known).as_deref(),
            Some("over-temperature")
        );
        assert_eq!(nearest("open-heatr", known).as_deref(), Some("open-heater"));
        assert_eq!(nearest("xyz", known), None);
        assert_eq!(nearest("", known), None);
    }
}
