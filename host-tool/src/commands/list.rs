//! `list`: the boards that are there, and who they say they are.

use std::fmt;

use mirror_protocol::Identity;
use serde::Serialize;

use crate::board::{Board, Found, Owner, Place, Seen, find, none_found};
use crate::error::ToolError;
use crate::report;

#[derive(Serialize)]
struct BoardList {
    boards: Vec<ListedBoard>,
}

#[derive(Serialize)]
struct ListedBoard {
    #[serde(flatten)]
    found: Found,
    /// What it says of itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    identity: Option<Identity>,
    /// Another process has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    owner: Option<Owner>,
    /// Why it says nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

pub(super) async fn run(json: bool) -> Result<(), ToolError> {
    let mut boards = Vec::new();
    for found in find() {
        let seen = Board::look(&found).await;
        let view = seen.as_ref().ok().and_then(|seen| seen.view(&found).ok());
        boards.push(ListedBoard {
            identity: view.map(|view| view.identity().clone()),
            owner: seen.as_ref().ok().and_then(Seen::owner).cloned(),
            error: seen.as_ref().err().map(ToString::to_string),
            found,
        });
    }
    if boards.is_empty() && !json {
        return Err(none_found());
    }
    report::print(&BoardList { boards }, json);
    Ok(())
}

impl fmt::Display for BoardList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for board in &self.boards {
            let link = match board.found.place {
                Place::Usb { .. } => "USB",
                Place::Socket { .. } => "socket",
            };
            let identity = board.identity.as_ref().map(|identity| {
                format!(
                    "{}, firmware {} ({})",
                    identity.board, identity.firmware_version, identity.build
                )
            });
            let owner = board
                .owner
                .as_ref()
                .map(|owner| format!("in use by {owner}"));
            let said: Vec<String> = [identity, owner, board.error.clone()]
                .into_iter()
                .flatten()
                .collect();
            writeln!(f, "{:<26} {link:<7} {}", board.found.name, said.join(", "))?;
        }
        Ok(())
    }
}
