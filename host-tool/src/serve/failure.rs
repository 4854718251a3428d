//! Failures of the tool as errors of the instrument.

use miette::Diagnostic;
use mirror_protocol::Refusal;

use crate::error::{BeyondBoard, ToolError};
use crate::scpi::{Error, Kind};

/// What happened, and what to do next.
pub(super) fn told(error: &ToolError) -> Error {
    let kind = match error {
        missing if missing.is_of_missing_board() => Kind::HardwareMissing,
        ToolError::Tripped { .. }
        | ToolError::Refused {
            refusal: Refusal::Tripped { .. } | Refusal::NoLease,
            ..
        } => Kind::Hardware,
        ToolError::Refused {
            refusal: Refusal::NoHello,
            ..
        } => return stopped(),
        ToolError::BeyondBoard(
            BeyondBoard::PositionOutOfRange { .. }
            | BeyondBoard::PoseOutOfReach { .. }
            | BeyondBoard::PoseKeptWarm { .. }
            | BeyondBoard::PoseBeyondDrives { .. }
            | BeyondBoard::DriveOutOfRange { .. }
            | BeyondBoard::PositionBelowRoom { .. }
            | BeyondBoard::Period { .. }
            | BeyondBoard::PartOfTick { .. },
        ) => Kind::DataOutOfRange,
        _ => Kind::Execution,
    };
    let advice = match error {
        ToolError::SeveralBoards { .. } | ToolError::NoSuchBoard { .. } => {
            Some("choose one of them with SYSTem:BOARd \"NAME\"".to_owned())
        }
        ToolError::Tripped { .. } | ToolError::Refused { .. } if kind == Kind::Hardware => {
            Some("STATus:CHANnels? names faults, OUTPut:PROTection:CLEar forgets them".to_owned())
        }
        other => other.help().map(|help| help.to_string()),
    };
    let sentences = [Some(error.to_string()), advice];
    let detail: Vec<String> = sentences.into_iter().flatten().collect();
    Error::new(kind, detail.join(". "))
}

/// That the board was stopped beside this process, or has started anew.
pub(super) fn stopped() -> Error {
    let said = "the board was reset, or turned off by `host-tool off`; it is not driven again before SYSTem:LOCK:REQuest?";
    Error::new(Kind::CommandProtected, said)
}
