//! Looking at a board, which nobody has to wait for: who has it answers in its place.

use std::time::Duration;

use tokio::time::{Instant, timeout_at};

use super::claim::{Claim, Claimed, in_use};
use super::find::{Found, Place};
use super::link::{Board, check_place};
use super::owner::{Owner, look_socket};
use super::stop_mark::StopMark;
use super::view::View;
use crate::error::ToolError;

/// Who has a board answers within a few control ticks. This is for busy machines; after it he is taken to be stuck.
const PATIENCE: Duration = Duration::from_secs(1);

/// A board that was looked at.
#[derive(Debug)]
pub enum Seen {
    /// It answers, and is this process's own until it is dropped.
    Open(Box<Board>),
    /// Another process has it, and answers in its place.
    Through(Box<View>, Owner),
    /// Another process has it, and does not: it is stuck, of another version, or of before there was such a thing.
    InUse(Owner),
}

impl Seen {
    /// What can be read of it.
    ///
    /// # Errors
    /// Where another has it who does not answer.
    pub fn view(&self, found: &Found) -> Result<&View, ToolError> {
        match self {
            Self::Open(board) => Ok(board),
            Self::Through(view, _) => Ok(view),
            Self::InUse(owner) => Err(in_use(found, Some(owner))),
        }
    }

    /// Who has it, where that is another process.
    pub fn owner(&self) -> Option<&Owner> {
        match self {
            Self::Open(_) => None,
            Self::Through(_, owner) | Self::InUse(owner) => Some(owner),
        }
    }
}

impl Board {
    /// Opens a board to ask it something, itself or through who has it for longer than a moment.
    ///
    /// # Errors
    /// As of [`Self::open`]; where another has it who neither answers nor says who it is.
    pub async fn look(found: &Found) -> Result<Seen, ToolError> {
        check_place(found)?;
        let deadline = Instant::now() + PATIENCE;
        loop {
            let owner = match Claim::at_a_glance(found).await {
                Claimed::Ours(claim) => {
                    return Ok(Seen::Open(Box::new(Self::greet(found, claim).await?)));
                }
                Claimed::Anothers(owner) => owner,
            };
            // One that has let go meanwhile is followed by another, or by nobody.
            match (through(found).await, owner) {
                (Some(view), Some(owner)) => return Ok(Seen::Through(Box::new(view), owner)),
                (_, owner) if Instant::now() > deadline => {
                    return owner.map(Seen::InUse).ok_or_else(|| in_use(found, None));
                }
                _ => {}
            }
        }
    }

    /// Opens a board for good where nobody else has it for longer than a moment.
    ///
    /// # Errors
    /// As of [`Self::open`], at once.
    pub async fn open_if_free(found: &Found) -> Result<Self, ToolError> {
        let mark = StopMark::read(found);
        check_place(found)?;
        match Claim::at_a_glance(found).await {
            Claimed::Ours(claim) => {
                let board = Self::greet(found, claim).await?;
                mark.check(found)?;
                Ok(board)
            }
            Claimed::Anothers(owner) => Err(in_use(found, owner.as_ref())),
        }
    }
}

/// The board as who has it shows it; `None` where that is nobody, or somebody who does not answer in time.
async fn through(found: &Found) -> Option<View> {
    let path = look_socket(found)?;
    let socket = Found {
        place: Place::Socket { path: path.clone() },
        ..found.clone()
    };
    check_place(&socket).ok()?;
    let greeted = async {
        let view = View::greet_stand_in(found, &path).await?;
        // He greets by himself; that the board answers him is seen of this.
        view.status().await.map(|_| view)
    };
    timeout_at(Instant::now() + PATIENCE, greeted)
        .await
        .ok()?
        .ok()
}
