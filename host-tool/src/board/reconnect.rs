//! A board that comes and goes: opened where it is not, and anew once it was gone.

use std::sync::Arc;

use tokio::sync::Mutex;

use super::find::Found;
use super::link::Board;
use crate::error::ToolError;

/// A board that is opened when it is needed, again and again.
#[derive(Debug)]
pub(crate) struct Reconnecting {
    found: Found,
    open: Mutex<Option<Arc<Board>>>,
}

impl Reconnecting {
    /// The board at this place, which nobody opens yet.
    pub(crate) fn new(found: Found) -> Self {
        Self {
            found,
            open: Mutex::default(),
        }
    }

    /// The same, which is open.
    pub(crate) fn open(found: Found, board: Board) -> Self {
        Self {
            found,
            open: Mutex::new(Some(Arc::new(board))),
        }
    }

    /// Where it is found.
    pub(crate) fn found(&self) -> &Found {
        &self.found
    }

    /// The board, opened where it is not.
    ///
    /// # Errors
    /// Where it is not there, another process has it, or it does not answer.
    pub(crate) async fn board(&self) -> Result<Arc<Board>, ToolError> {
        let mut open = self.open.lock().await;
        if let Some(board) = &*open {
            return Ok(board.clone());
        }
        let board = Arc::new(Board::open_if_free(&self.found).await?);
        *open = Some(board.clone());
        Ok(board)
    }

    /// The board, if it is open.
    pub(crate) async fn opened(&self) -> Option<Arc<Board>> {
        self.open.lock().await.clone()
    }

    /// Whether asking `board` failed since it is gone. It is opened anew the next time then.
    pub(crate) async fn is_gone(&self, board: &Arc<Board>, error: &ToolError) -> bool {
        let is_gone = error.is_of_missing_board();
        if is_gone {
            let mut open = self.open.lock().await;
            if open.as_ref().is_some_and(|now| Arc::ptr_eq(now, board)) {
                *open = None;
            }
        }
        is_gone
    }
}
