//! Something that moves on the screen while the tool computes.

use std::time::Duration;

use indicatif::ProgressBar;

use crate::verbosity::Verbosity;

/// Runs `work` while something moves on the screen.
pub(crate) fn while_working<T>(what: &'static str, quiet: bool, work: impl FnOnce() -> T) -> T {
    let spinner = spinner(what, quiet);
    let done = work();
    spinner.finish_and_clear();
    done
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
