//! Something that moves on the screen while the tool computes, and what it is at.

use std::sync::Mutex;
use std::time::Duration;

use indicatif::ProgressBar;
use log::{LevelFilter, Log, Metadata, Record};

use crate::verbosity::{Verbosity, detail};

/// What moves at this moment.
static MOVING: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Parts of the program that tell where they are.
const TOLD_BY: [&str; 2] = ["diagnosis", "measurement"];

/// Shows what parts of the program tell of where they are.
struct Told;

impl Log for Told {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        let of = metadata.target().split("::").next();
        of.is_some_and(|of| TOLD_BY.contains(&of))
    }

    fn log(&self, record: &Record<'_>) {
        if !self.enabled(record.metadata()) {
            return;
        }
        let words = record.args().to_string();
        detail(&words);
        if let Some(moving) = MOVING.lock().ok().as_deref().and_then(Option::as_ref) {
            moving.set_message(words);
        }
    }

    fn flush(&self) {}
}

/// From now on what parts of the program tell of where they are is shown.
pub(crate) fn show_where_it_is() {
    // There is one tool in a process; a second one would show the same.
    if log::set_boxed_logger(Box::new(Told)).is_ok() {
        log::set_max_level(LevelFilter::Info);
    }
}

/// Runs `work` while something moves on the screen.
pub(crate) fn while_working<T>(what: &'static str, quiet: bool, work: impl FnOnce() -> T) -> T {
    let spinner = spinner(what, quiet);
    move_on(Some(spinner.clone()));
    let done = work();
    move_on(None);
    spinner.finish_and_clear();
    done
}

/// Nothing moves on the screen any more.
pub(crate) fn end() {
    if let Some(moving) = MOVING.lock().ok().and_then(|mut moving| moving.take()) {
        moving.finish_and_clear();
    }
}

fn move_on(moving: Option<ProgressBar>) {
    if let Ok(mut at) = MOVING.lock() {
        *at = moving;
    }
}

/// Something that moves on the screen.
pub(crate) fn spinner(what: &'static str, quiet: bool) -> ProgressBar {
    let spinner = match is_shown(quiet) {
        true => ProgressBar::new_spinner(),
        false => ProgressBar::hidden(),
    };
    spinner.set_message(what);
    spinner.enable_steady_tick(Duration::from_millis(100));
    spinner
}

/// A bar of this length; its parts count as the caller says.
pub(crate) fn bar(length: u64, quiet: bool) -> ProgressBar {
    match is_shown(quiet) {
        true => ProgressBar::new(length),
        false => ProgressBar::hidden(),
    }
}

/// Where the caller is not quiet, and neither is the person.
fn is_shown(quiet: bool) -> bool {
    !quiet && Verbosity::Usual.is_wanted()
}
