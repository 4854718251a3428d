//! `off`: turns all channels off, whoever has the board.

use std::fmt;

use serde::Serialize;

use crate::board::{Board, Found, Owner, announce_stop, owner, stop};
use crate::error::ToolError;
use crate::report::{self, decimal, row};

#[derive(Serialize)]
struct Off {
    drive_v: [f64; 4],
    /// Who had the board.
    owner: Option<Owner>,
}

pub(super) async fn run(found: &Found, json: bool) -> Result<(), ToolError> {
    let owner = owner(found);
    announce_stop(found);
    let drive_v = if stop(found).await? {
        [0.0; 4]
    } else {
        let commanded = Board::open(found).await?.off().await?;
        commanded.drive_v.map(decimal)
    };
    report::print(&Off { drive_v, owner }, json);
    Ok(())
}

impl fmt::Display for Off {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "drives     {}", row(self.drive_v, 3, "V"))?;
        match &self.owner {
            Some(owner) => writeln!(f, "owner      {owner}; it may no longer drive"),
            None => Ok(()),
        }
    }
}
