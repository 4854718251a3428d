//! Questions to the person at the keyboard, while the board goes on.

use std::io;
use std::thread;

use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

use crate::error::ToolError;
use crate::verbosity::say;

/// The standard input, line by line.
pub(crate) struct Keyboard(UnboundedReceiver<String>);

impl Keyboard {
    /// Reads in a thread of its own, which ends with the tool: what waits for a key cannot be called off.
    pub(crate) fn new() -> Self {
        let (send, lines) = unbounded_channel();
        thread::spawn(move || {
            for line in io::stdin().lines().map_while(Result::ok) {
                if send.send(line).is_err() {
                    return;
                }
            }
        });
        Self(lines)
    }

    /// Asks, and waits for the answer.
    pub(crate) async fn ask(&mut self, question: &str) -> Result<String, ToolError> {
        say(question);
        self.0.recv().await.ok_or(ToolError::InputEnded)
    }
}
