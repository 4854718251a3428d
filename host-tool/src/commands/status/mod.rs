//! `status`: who the board is and what it is doing. `clear`: the same once its faults are forgotten.

mod report;

use std::fmt;

use serde::Serialize;

use self::report::StatusReport;
use crate::board::{Board, Found, Owner, Seen};
use crate::error::ToolError;
use crate::report::print;

pub(crate) use self::report::kept_words;
pub(super) use self::report::{calibrated_words, uncertainty_k};

/// Lets the board forget its faults, and shows what it does then.
pub(super) async fn clear(board: &Board, json: bool) -> Result<(), ToolError> {
    board.clear().await?;
    let report = StatusReport::read(board, false).await?;
    print(&report, json);
    Ok(())
}

/// What can be known of a board that another process has, who does not answer.
#[derive(Serialize)]
struct InUse<'a> {
    board: &'a Found,
    /// Who has it.
    owner: Owner,
}

impl fmt::Display for InUse<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "board      {}", self.board.name)?;
        writeln!(f, "owner      {}", self.owner)
    }
}

/// Shows the board's status, through who has it where that is another process; or who that is, where it does not answer.
pub(super) async fn look(found: &Found, history: bool, json: bool) -> Result<(), ToolError> {
    let seen = Board::look(found).await?;
    if let Seen::InUse(owner) = &seen {
        let (board, owner) = (found, owner.clone());
        print(&InUse { board, owner }, json);
    }
    let mut report = StatusReport::read(seen.view(found)?, history).await?;
    report.is_in_use = seen.owner().is_some();
    report.owner = match &seen {
        Seen::Open(board) => board.waited_for().cloned(),
        _ => seen.owner().cloned(),
    };
    print(&report, json);
    Ok(())
}
