//! Whether a calibration or a session is of the mirror on the board: its heaters tell, hardly driven, by what their resistances differ from each other.

use std::path::Path;

use calibration_procedure::{Drift, Heaters};
use control_core::Calibration;
use measurement::Session;
use mirror_protocol::Refusal;
use quantities::Span;

use super::calibrate_sense::driven;
use crate::board::Board;
use crate::error::{ToolError, UnusableInput};
use crate::verbosity::{note, say};

/// It makes 0.8 mA, of which a zero that was taken leaves 0.1 uA, and warms a heater by less than 2 K, which moves a mirror by 2 um.
const PROBE_V: f32 = 0.3;
/// A mirror that was just held at its largest tilt has some percent of that rise left in its slow poles, 2 % of a resistance, and a third of
/// it after this.
const COOLED: Span = Span { s: 20.0 };

/// Whether `calibration` is of the mirror on the board, whose channels are off afterwards. One that takes all heaters for alike may be any
/// mirror's. A board that has tripped, perhaps for a calibration of another mirror, tells nothing and is not asked to: that is warned of.
///
/// # Errors
/// Where it is another mirror's, or the board does not answer.
pub(super) async fn check(
    board: &Board,
    file: &Path,
    calibration: &Calibration,
) -> Result<(), ToolError> {
    let Some(there) = Heaters::at_rest(calibration) else {
        return Ok(());
    };
    let here = match differ(board, &there).await {
        Err(error) if is_tripped(&error) => {
            say(format_args!(
                "warning: whether {} is of the mirror on this board is not known, for the board has turned itself off; `host-tool clear`, and load it again",
                file.display()
            ));
            return Ok(());
        }
        here => here?,
    };
    here.map_or(Ok(()), |(actuator, _, here)| {
        Err(UnusableInput::OtherMirror {
            file: file.to_owned(),
            actuator: actuator + 1,
            there_ohm: there.0,
            here_ohm: here.0,
        }
        .into())
    })
}

/// Whether a session is of the mirror on the board, whose channels are off afterwards: before it is driven as far as a calibration drives it, for
/// the board may take another mirror's heaters for too warm. One that has tripped is not asked.
///
/// # Errors
/// As [`check`].
pub(super) async fn check_session(board: &Board, session: &Session) -> Result<(), ToolError> {
    let Some(there) = Heaters::hardly_driven(session) else {
        return Ok(());
    };
    let here = match differ(board, &there).await {
        Err(error) if is_tripped(&error) => None,
        here => here?,
    };
    board.off().await?;
    here.map_or(Ok(()), |(actuator, there_ohm, here)| {
        Err(Drift::OtherMirror {
            actuator: actuator + 1,
            there_ohm,
            here_ohm: here.0[actuator],
        }
        .into())
    })
}

fn is_tripped(error: &ToolError) -> bool {
    matches!(
        error,
        ToolError::Tripped { .. }
            | ToolError::Refused {
                refusal: Refusal::Tripped { .. },
                ..
            }
    )
}

/// The actuator whose heater differs from the others otherwise than `there`, what it has there as warm as here, and what all have here (ohm).
/// Heaters that were driven are waited for.
async fn differ(
    board: &Board,
    there: &Heaters,
) -> Result<Option<(usize, f64, Heaters)>, ToolError> {
    if there.differ(&read(board).await?).is_none() {
        return Ok(None);
    }
    note(format_args!(
        "the heaters differ from each other otherwise than in what was measured: they are read again when they have cooled, in {COOLED}"
    ));
    let off = board.off().await?;
    board.wait(off.tick, COOLED).await?;
    let here = read(board).await?;
    Ok(there
        .differ(&here)
        .map(|(actuator, there_ohm, _)| (actuator, there_ohm, here)))
}

async fn read(board: &Board) -> Result<Heaters, ToolError> {
    let currents_a = driven(board, PROBE_V).await?;
    Ok(Heaters(
        currents_a.map(|current_a| f64::from(PROBE_V) / current_a),
    ))
}
