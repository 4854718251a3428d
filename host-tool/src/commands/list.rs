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
    /// What it says of itself, or why it does not.
    #[serde(flatten)]
    said: Said,
}

#[derive(Serialize)]
#[serde(rename_all = "lowercase")]
enum Said {
    Identity(Identity),
    /// Another process has it.
    Owner(Owner),
    Error(String),
}

pub(super) async fn run(json: bool) -> Result<(), ToolError> {
    let mut boards = Vec::new();
    for found in find() {
        let said = match Board::look(&found).await {
            Ok(Seen::Open(board)) => Said::Identity(board.identity().clone()),
            Ok(Seen::InUse(owner)) => Said::Owner(owner),
            Err(error) => Said::Error(error.to_string()),
        };
        boards.push(ListedBoard { found, said });
    }
    if boards.is_empty() && !json {
        return Err(none_found());
    }
    report::print(&BoardList { boards }, json);
    Ok(())
}

impl fmt::Display for BoardList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for ListedBoard { found, said } in &self.boards {
            let link = match found.place {
                Place::Usb { .. } => "USB",
                Place::Socket { .. } => "socket",
            };
            match said {
                Said::Identity(identity) => writeln!(
                    f,
                    "{:<26} {link:<7} {}, firmware {} ({})",
                    found.name, identity.board, identity.firmware_version, identity.build
                )?,
                Said::Owner(owner) => {
                    writeln!(f, "{:<26} {link:<7} in use by {owner}", found.name)?;
                }
                Said::Error(error) => writeln!(f, "{:<26} {link:<7} {error}", found.name)?,
            }
        }
        Ok(())
    }
}
