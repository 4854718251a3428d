//! A pseudo terminal with a program in it: what is typed, and what is seen.

use std::fs::File;
use std::io::{Read, Write};
use std::num::NonZero;
use std::os::fd::AsFd;
use std::path::Path;
use std::process::{Child, Command};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread;
use std::time::Duration;

use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
use rustix::termios::{LocalModes, Winsize, tcgetattr, tcsetwinsize};
use vt100::Parser;

use crate::Bench;

/// From one look at the screen to the next, so that looking leaves the processors to the board.
const LOOK: Duration = Duration::from_millis(20);

/// A terminal of 80 columns and 24 rows, and the program that was started in it. All of its functions panic where the system
/// has no pseudo terminals.
pub struct Terminal {
    keyboard: File,
    /// The tool's end, which keeps the terminal open after the tool.
    line: File,
    screen: Arc<Mutex<Parser>>,
    stands_still: Arc<AtomicBool>,
    /// The program.
    pub tool: Child,
}

impl Terminal {
    /// Starts the tool with these words.
    pub fn start(bench: &Bench, words: &[&str]) -> Self {
        Self::start_program(&bench.command(words))
    }

    /// Starts a program, in its environment and folder, as the leader of the terminal's session, as under a shell.
    pub fn start_program(program: &Command) -> Self {
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let keyboard = openpt(flags).expect("a pseudo terminal");
        unlockpt(&keyboard).expect("it is ours");
        let name = ptsname(&keyboard, Vec::new()).expect("it has a name");
        let name = name.into_string().expect("text");
        let keyboard = File::from(keyboard);
        let [columns, rows] = [80, 24].map(|size| NonZero::new(size).expect("not zero"));
        resize(&keyboard, columns, rows);
        let line = File::options()
            .read(true)
            .write(true)
            .open(name)
            .expect("it opens");
        let mut session = Command::new("setsid");
        session
            .arg("--ctty")
            .arg(program.get_program())
            .args(program.get_args())
            .envs(
                program
                    .get_envs()
                    .filter_map(|(name, value)| Some((name, value?))),
            )
            .current_dir(program.get_current_dir().unwrap_or(Path::new(".")))
            .stdin(line.try_clone().expect("a handle"))
            .stdout(line.try_clone().expect("a handle"))
            .stderr(line.try_clone().expect("a handle"));
        let tool = session.spawn().expect("`setsid` is there");
        let screen = Arc::new(Mutex::new(Parser::new(rows, columns, 0)));
        let stands_still = Arc::new(AtomicBool::new(false));
        let stops = stands_still.clone();
        let (mut shown, seen) = (keyboard.try_clone().expect("a handle"), screen.clone());
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            while !stops.load(Ordering::Relaxed) {
                let Ok(length @ 1..) = shown.read(&mut bytes) else {
                    return;
                };
                seen.lock()
                    .expect("nobody panics")
                    .process(&bytes[..length]);
            }
        });
        Self {
            keyboard,
            line,
            screen,
            stands_still,
            tool,
        }
    }

    /// Types these keys.
    pub fn types(&mut self, keys: &str) {
        self.keyboard
            .write_all(keys.as_bytes())
            .expect("it is read");
    }

    /// Gives the terminal another size.
    pub fn resize(&self, columns: NonZero<u16>, rows: NonZero<u16>) {
        self.screen().screen_mut().set_size(rows, columns);
        resize(&self.keyboard, columns, rows);
    }

    fn screen(&self) -> MutexGuard<'_, Parser> {
        self.screen.lock().expect("nobody panics")
    }

    /// What is seen.
    pub fn text(&self) -> String {
        self.screen().screen().contents()
    }

    /// From now on the terminal takes nothing more, as one whose connection hangs.
    pub fn stands_still(&self) {
        self.stands_still.store(true, Ordering::Relaxed);
    }

    /// Closes it, as its window is closed: nothing is seen or typed any more, and the program hears of it.
    pub fn close(&mut self) {
        // Whoever reads holds it open until the program shows something more.
        self.stands_still();
        self.keyboard = File::open("/dev/null").expect("it is there");
    }

    /// Waits until this is seen.
    pub fn wait_for(&self, bench: &Bench, text: &str) {
        bench.wait(&format!("`{text}` is not shown"), |_| {
            let is_shown = self.text().contains(text);
            if !is_shown {
                thread::sleep(LOOK);
            }
            is_shown
        });
    }

    /// Waits until the program reads keys and no lines: what is typed before, it may throw away.
    ///
    /// # Panics
    /// Where it never does.
    pub fn wait_for_keys(&self, bench: &Bench) {
        bench.wait("nobody reads keys", |_| !self.reads_lines());
    }

    /// Waits for the end of the tool; returns its exit code, and `None` where it was killed.
    pub fn wait(&mut self) -> Option<i32> {
        self.tool.wait().expect("it is ours").code()
    }

    /// Whether the terminal is as a shell leaves it to a program: lines are read with echo, the cursor is seen, and the
    /// screen is the one with the lines of before.
    pub fn is_restored(&self) -> bool {
        let parser = self.screen();
        let screen = parser.screen();
        self.reads_lines() && !screen.alternate_screen() && !screen.hide_cursor()
    }

    fn reads_lines(&self) -> bool {
        let modes = tcgetattr(self.line.as_fd())
            .expect("a terminal")
            .local_modes;
        modes.contains(LocalModes::ICANON | LocalModes::ECHO | LocalModes::ISIG)
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        if thread::panicking() {
            eprintln!("the terminal shows:\n{}", self.text());
        }
        let _ = self.tool.kill();
        let _ = self.tool.wait();
    }
}

fn resize(terminal: &File, columns: NonZero<u16>, rows: NonZero<u16>) {
    let size = Winsize {
        ws_col: columns.get(),
        ws_row: rows.get(),
        ws_xpixel: 0,
        ws_ypixel: 0,
    };
    tcsetwinsize(terminal, size).expect("a terminal");
}
