//! The stop: a second way to the board, which no process can keep from another. On USB a request on endpoint 0, for which
//! no interface is claimed; at an emulated board a byte into a FIFO.

use tokio::time::timeout;

use super::answer::{ANSWER_TIMEOUT, no_answer};
use super::fifo::by_fifo;
use super::find::{Found, Place};
use super::request::by_usb;
use crate::error::ToolError;

/// Turns all channels off, whoever has the board and whatever it does; returns once a control tick has done it. A tool
/// that drives is refused from then on. `false` where the board has no such way, and was not stopped.
///
/// # Errors
/// Where it was told and did not do it.
pub async fn stop(found: &Found) -> Result<bool, ToolError> {
    let stopped = async {
        match &found.place {
            Place::Usb { serial } => by_usb(serial).await,
            Place::Socket { path } => by_fifo(path).await,
        }
    };
    match timeout(ANSWER_TIMEOUT, stopped).await {
        Ok(stopped) => Ok(stopped.is_ok()),
        Err(_) => Err(no_answer("turn its channels off", ANSWER_TIMEOUT)),
    }
}
