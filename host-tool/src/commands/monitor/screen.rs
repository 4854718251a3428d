//! The terminal of the live view, which is left as it was however the view ends.

use std::io::{self, IsTerminal};
use std::thread;

use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event};
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

use super::state::State;
use super::view;
use crate::error::ToolError;

/// The terminal, taken over until it is dropped; a panic gives it back before it says anything.
pub(super) struct Screen(DefaultTerminal);

/// Makes sure that there is a terminal to show a view on, and keys to hear.
///
/// # Errors
/// Where there is none.
pub(super) fn check() -> Result<(), ToolError> {
    match io::stdin().is_terminal() && io::stdout().is_terminal() {
        true => Ok(()),
        false => Err(ToolError::NoTerminal),
    }
}

impl Screen {
    pub(super) fn open() -> Result<Self, ToolError> {
        ratatui::try_init().map(Self).map_err(ToolError::Terminal)
    }

    pub(super) fn draw(&mut self, state: &State) -> Result<(), ToolError> {
        let drawn = self.0.draw(|frame| view::draw(state, frame));
        drawn.map(drop).map_err(ToolError::Terminal)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // A terminal that has gone cannot be given back.
        let _ = self.0.show_cursor();
        ratatui::restore();
    }
}

/// Keys and changes of size, read in a thread of its own, which ends with the tool.
pub(super) fn events() -> UnboundedReceiver<Event> {
    let (send, events) = unbounded_channel();
    thread::spawn(move || {
        while let Ok(event) = event::read() {
            if send.send(event).is_err() {
                return;
            }
        }
    });
    events
}
