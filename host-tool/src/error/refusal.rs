//! What a board refuses, and for which fault, in words: why, and what to do.

use mirror_protocol::{Flaw, PROTOCOL_VERSION, Refusal};
use protection::Fault;

use crate::names::fault_name;

pub(super) fn update_advice(board: u16) -> &'static str {
    if board < PROTOCOL_VERSION {
        "update the board's firmware: `cargo xtask flash`"
    } else {
        "update this tool: it is older than the board's firmware"
    }
}

pub(super) fn refusal_words(refusal: Refusal) -> String {
    match refusal {
        Refusal::ProtocolVersion { board, tool } => {
            format!("it speaks protocol version {board}, and was greeted in version {tool}")
        }
        Refusal::ControlStopped => "its control loop does not run".to_owned(),
        Refusal::Cooling => "its heaters are still warm from before a reset or a fault".to_owned(),
        Refusal::NoHello => {
            "it was reset, or turned off by `host-tool off`, since this tool greeted it".to_owned()
        }
        Refusal::Tripped { fault } => format!("it has turned itself off: {}", fault_name(fault)),
        Refusal::NoLease => {
            "it drives nothing: it was turned off, or was not asked to go on in time".to_owned()
        }
        Refusal::SenseImplausible => "no sound board's current sense is off by so much".to_owned(),
        Refusal::NoBootloader => "it takes no firmware this way, as it is emulated".to_owned(),
        Refusal::NotANumber => "a value was not a number".to_owned(),
        Refusal::UploadGap { expected } => {
            format!("a piece of the upload was lost; the next must begin at byte {expected}")
        }
        Refusal::UploadTooLong => "the upload is longer than what it is for".to_owned(),
        Refusal::ZeroPeriod => "samples need a period of at least one control tick".to_owned(),
        Refusal::Waveform(flaw) => format!("the waveform {}", flaw_words(flaw)),
        Refusal::TableEnd => "its table has no room for so many points".to_owned(),
    }
}

fn flaw_words(flaw: Flaw) -> &'static str {
    match flaw {
        Flaw::NotANumber => "has a value that is not a number",
        Flaw::Frequency => "is slower or faster than the board can play",
        Flaw::NoCycles => "has no cycles",
        Flaw::Points => "has too few points or too many",
        Flaw::NoDwell => "has points that last no time",
        Flaw::Triggers => "has lines or frames that begin more often than the board can tell",
    }
}

pub(super) fn refusal_advice(refusal: Refusal) -> String {
    match refusal {
        Refusal::Tripped { fault } => fault_advice(fault),
        Refusal::SenseImplausible => {
            "is there a resistor on each channel, and is it the one that was named?".to_owned()
        }
        Refusal::Cooling => {
            "in vacuum that takes seconds: ask again, until `host-tool status` no longer says `starting`"
                .to_owned()
        }
        _ => "`host-tool status` shows what the board is doing".to_owned(),
    }
}

pub(super) fn fault_advice(fault: u8) -> String {
    let exchanged = match Fault::from_code(fault) {
        Some(Fault::OverTemperature) => {
            ". A mirror in the place of another whose heaters have less ohm is calibrated with `--cold-resistance`"
        }
        _ => "",
    };
    format!(
        "`host-tool explain {}` tells its cause and remedy; `host-tool clear` lets the board be \
         driven again{exchanged}",
        fault_name(fault)
    )
}
