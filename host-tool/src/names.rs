//! What faults, limits and states are called.

use control_core::Limits;
use mirror_protocol::ChannelState;
use protection::Fault;

/// The names of the limits that acted.
pub(crate) fn limit_names(bits: u16) -> Vec<&'static str> {
    Limits::from_bits(bits)
        .iter()
        .map(|limit| limit.name())
        .collect()
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
