//! What `host-tool off` leaves beside a board's lock, so that a tool that waits for the board then does not drive it
//! afterwards: the stop is newer than what that tool was asked for.

use std::io::{Read, Write};

use super::find::Found;
use super::owner::{FILE_BYTES, Owner, place};
use crate::error::ToolError;
use crate::system::private_file;

/// The last stop that a tool knows of when it is started.
#[derive(Debug)]
pub(super) struct StopMark(Option<Vec<u8>>);

/// Says that this process is about to stop the board. To be said before it is done: a tool that greets the board before
/// the stop is refused by the board, and one that greets it later finds the mark.
pub fn announce_stop(found: &Found) {
    // Where there is no place for it, there is none for a lock that a tool could wait for either.
    let Some(path) = place(found).map(|lock| lock.with_extension("stopped")) else {
        return;
    };
    let file = private_file().create(true).truncate(true).open(path);
    if let (Ok(mut file), Ok(text)) = (file, serde_json::to_vec(&Owner::this_process())) {
        let _ = file.write_all(&text);
    }
}

impl StopMark {
    /// The mark as it is now.
    pub(super) fn read(found: &Found) -> Self {
        let read = || {
            let path = place(found)?.with_extension("stopped");
            let file = private_file().write(false).open(path).ok()?;
            let mut bytes = Vec::new();
            file.take(FILE_BYTES).read_to_end(&mut bytes).ok()?;
            Some(bytes)
        };
        Self(read())
    }

    /// Makes sure that nobody has stopped the board since.
    ///
    /// # Errors
    /// Where somebody has.
    pub(super) fn check(&self, found: &Found) -> Result<(), ToolError> {
        if Self::read(found).0 == self.0 {
            return Ok(());
        }
        Err(ToolError::StoppedMeanwhile {
            board: found.name.clone(),
        })
    }
}
