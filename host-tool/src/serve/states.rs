//! What the two groups of registers say of a board.

use control_core::{Limit, Limits};
use mirror_protocol::{ChannelState, Kept, Status};
use quantities::Span;

use crate::board::Board;
use crate::scpi::{Error, Kind};
use crate::serve::device::{Asked, Moved};

/// A register's bits, and what each means.
pub(super) type Bits = &'static [(u16, &'static str)];

const CALIBRATION: u16 = 8;
const LIMITED: u16 = 9;
const TRIPPED: u16 = 10;
const STOPPED: u16 = 11;
const UNFORESEEN: u16 = 12;
/// The register of what may not be as it should. Bit 8 is SCPI's, from 9 on they are the instrument's own (SCPI-1999, 20.3).
pub(super) const QUESTIONABLE: Bits = &[
    (
        CALIBRATION,
        "the calibration is not this mirror's: the factory's, or one that has rotted",
    ),
    (
        LIMITED,
        "a limit has acted since the last command that drives; `STATus:LIMits?` names it",
    ),
    (
        TRIPPED,
        "a fault has turned the channels off; `STATus:CHANnels?` names it",
    ),
    (
        STOPPED,
        "the board was stopped beside this client, which may drive it again after `SYSTem:LOCK:REQuest?`",
    ),
    (
        UNFORESEEN,
        "the board cannot tell when the mirror has settled at the position asked for, so `*OPC?` and `*WAI` wait by time: a limit keeps it away, it cools, or the calibration was never tried on it",
    ),
];

const SETTLING: u16 = 1;
const DRIVEN: u16 = 8;
/// The register of what is going on. Bit 1 is SCPI's, from 8 on they are the instrument's own (SCPI-1999, 20.1).
pub(super) const OPERATION: Bits = &[
    (SETTLING, "the mirror settles"),
    (DRIVEN, "something is driven"),
];

fn bits(which: &[(u16, bool)]) -> u16 {
    which
        .iter()
        .map(|(bit, is_so)| u16::from(*is_so) << bit)
        .sum()
}

/// The questionable condition.
pub(super) fn questionable(
    status: &Status,
    kept: Kept,
    is_stopped: bool,
    moved: Option<Moved>,
) -> u16 {
    bits(&[
        (CALIBRATION, !is_own(kept)),
        (
            LIMITED,
            status.health.limits_since_command != Limits::NONE.bits(),
        ),
        (TRIPPED, has_tripped(status)),
        (STOPPED, is_stopped),
        (
            UNFORESEEN,
            moved.is_some_and(|moved| is_unforeseen(status, moved)),
        ),
    ])
}

/// The condition of operation.
pub(super) fn operation(status: &Status, is_settling: bool) -> u16 {
    bits(&[(SETTLING, is_settling), (DRIVEN, is_driven(status))])
}

/// Whether a calibration is one that was made, and the last that was.
pub(super) fn is_own(kept: Kept) -> bool {
    matches!(kept, Kept::Yes | Kept::No | Kept::OnTrial)
}

pub(super) fn has_tripped(status: &Status) -> bool {
    let is_tripped = |state: &ChannelState| matches!(state, ChannelState::Tripped(_));
    status.telemetry.states.iter().any(is_tripped)
}

pub(super) fn is_driven(status: &Status) -> bool {
    status.telemetry.drive_v.iter().any(|volts| *volts != 0.0)
}

/// How long a mirror takes to settle where neither a client nor the board says: what `set-z --settle` is without being given.
const USUAL_SETTLING: Span = Span { s: 1.0 };

/// How long the mirror still takes to settle after a command that drives, in the board's time.
pub(super) fn settles_in(board: &Board, status: &Status, moved: Moved) -> Span {
    let spent = board.span(moved.tick, status.telemetry.tick);
    let left_s = match (moved.settling, status.telemetry.settles_in_ms) {
        (Some(said), _) => said.s - spent.s,
        (None, Some(foreseen_ms)) => 1e-3 * f64::from(foreseen_ms),
        (None, None) => USUAL_SETTLING.s - spent.s,
    };
    Span { s: left_s.max(0.0) }
}

/// Whether the mirror is on its way after a command that drives.
pub(super) fn is_settling(board: &Board, status: &Status, moved: Moved) -> bool {
    settles_in(board, status, moved).s > 0.0
}

/// Whether a position was asked for, and the board cannot tell when the mirror has settled there.
fn is_unforeseen(status: &Status, moved: Moved) -> bool {
    matches!(moved.asked, Asked::Pose(_)) && status.telemetry.settles_in_ms.is_none()
}

/// Limits that do not end by themselves.
const FOR_GOOD: [Limit; 3] = [Limit::DriveHigh, Limit::PowerHigh, Limit::TemperatureHigh];

/// That the mirror is not where the last command asked it to be, and stays away, where the board knows that.
pub(super) fn kept_away(board: &Board, status: &Status, moved: Moved) -> Option<Error> {
    let sample = &status.telemetry;
    let is_tried = sample.uncertainty.is_some();
    let acting = Limits::from_bits(sample.limits);
    let limits = FOR_GOOD.iter().filter(|limit| acting.contains(**limit));
    let names: Vec<&str> = limits.map(|limit| limit.name()).collect();
    let is_so = is_tried && is_unforeseen(status, moved) && !names.is_empty();
    is_so.then(|| {
        let waited = board.span(moved.tick, sample.tick);
        let said = format!(
            "the mirror has not settled {:.1} s after the command and will not, for {} keeps it away; ask for a lower position, or see `host-tool explain {}`",
            waited.s,
            names.join(" and "),
            names[0]
        );
        Error::new(Kind::TimeOut, said)
    })
}
