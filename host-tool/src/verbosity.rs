//! How much the tool says on standard error while it works. Failures, warnings and questions are said in any case.

use std::fmt::Display;
use std::io::Write as _;
use std::sync::atomic::{AtomicU8, Ordering};

/// From the least to the most.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Verbosity {
    /// Neither progress nor notes: `--quiet`.
    Quiet,
    /// Progress and notes.
    Usual,
    /// What the board is asked, too, and how long it took, and which step a computation is at: `--verbose`.
    Verbose,
}

/// Of this process; a command line has one.
static OF_THIS_PROCESS: AtomicU8 = AtomicU8::new(Verbosity::Usual as u8);

impl Verbosity {
    /// From now on this much is said.
    pub(crate) fn use_it(self) {
        OF_THIS_PROCESS.store(self as u8, Ordering::Relaxed);
    }

    /// Whether as much as this is said.
    pub(crate) fn is_wanted(self) -> bool {
        OF_THIS_PROCESS.load(Ordering::Relaxed) >= self as u8
    }
}

/// Says something in any case. Where standard error is closed, as by a reader that has seen enough, nobody hears it.
pub(crate) fn say(words: impl Display) {
    let _ = writeln!(std::io::stderr(), "{words}");
}

/// Says something that is good to know.
pub(crate) fn note(words: impl Display) {
    if Verbosity::Usual.is_wanted() {
        say(words);
    }
}

/// Says what was done in detail.
pub(crate) fn detail(words: impl Display) {
    if Verbosity::Verbose.is_wanted() {
        say(words);
    }
}
