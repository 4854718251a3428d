//! The terminal of the live view, which is left as it was however the view ends.

use std::io::{self, IsTerminal};
use std::mem::ManuallyDrop;
use std::thread;

use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event};
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

use super::state::State;
use super::view;
use crate::error::ToolError;

/// The terminal, taken over until it is dropped; a panic gives it back before it says anything.
///
/// ratatui's own drop prints where it fails, which panics where standard error went with the terminal.
pub(super) struct Screen(ManuallyDrop<DefaultTerminal>);

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
        let terminal = ratatui::try_init().map_err(ToolError::Terminal)?;
        Ok(Self(ManuallyDrop::new(terminal)))
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
        let _ = ratatui::try_restore();
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

#[cfg(all(test, unix))]
mod tests {
    use std::fs::File;
    use std::io::Read;
    use std::process::{Command, Stdio};

    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use rustix::termios::tcgetattr;

    use super::*;

    /// How a terminal is told to show what it showed before (xterm's control sequences, 1049).
    const OTHER_SCREEN: &str = "\x1b[?1049h";
    const OWN_SCREEN: &str = "\x1b[?1049l";
    const SAID: &str = "a defect, on purpose";

    /// Has the test below, run once more in a pseudo terminal, panic there.
    const PANICS: &str = "MIRROR_TEST_PANICS";

    #[test]
    fn a_panic_gives_the_terminal_back_before_it_says_anything() {
        if std::env::var_os(PANICS).is_some() {
            let _screen = Screen::open().expect("a terminal");
            panic!("{SAID}");
        }
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo terminal");
        grantpt(&master).expect("it is ours");
        unlockpt(&master).expect("it is ours");
        let name = ptsname(&master, Vec::new()).expect("it has a name");
        let name = name.into_string().expect("text");
        let open = || File::options().read(true).write(true).open(&name);
        let terminal = open().expect("it opens");
        let before = tcgetattr(&terminal).expect("a terminal");
        let end = || Stdio::from(terminal.try_clone().expect("one more"));
        let mut tool = Command::new(std::env::current_exe().expect("this program"))
            .args(["--exact", "--nocapture"])
            .arg("commands::monitor::screen::tests::a_panic_gives_the_terminal_back_before_it_says_anything")
            .env(PANICS, "1")
            .env("RUST_BACKTRACE", "0")
            .env("TERM", "xterm")
            .stdin(end())
            .stdout(end())
            .stderr(end())
            .spawn()
            .expect("this program runs");
        assert!(
            !tool.wait().expect("it ends").success(),
            "it has not panicked"
        );
        let after = tcgetattr(&terminal).expect("a terminal");
        assert_eq!(
            (before.local_modes, before.input_modes, before.output_modes),
            (after.local_modes, after.input_modes, after.output_modes)
        );
        // Of the terminal's ends only this one is left: what was written is read, and then there is an error.
        drop(terminal);
        let (mut shown, mut bytes) = (String::new(), [0; 4096]);
        let mut master = File::from(master);
        while let Ok(length @ 1..) = master.read(&mut bytes) {
            shown += &String::from_utf8_lossy(&bytes[..length]);
        }
        let place = |what: &str| {
            shown
                .find(what)
                .unwrap_or_else(|| panic!("no {what:?} in {shown:?}"))
        };
        assert!(place(OTHER_SCREEN) < place(OWN_SCREEN), "{shown:?}");
        assert!(place(OWN_SCREEN) < place(SAID), "{shown:?}");
    }
}
