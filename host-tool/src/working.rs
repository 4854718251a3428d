//! Something that moves on the screen while the tool computes.

use std::time::Duration;

use indicatif::ProgressBar;

/// Runs `work` while something moves on the screen.
pub(crate) fn while_working<T>(what: &'static str, quiet: bool, work: impl FnOnce() -> T) -> T {
    let spinner = spinner(what, quiet);
    let done = work();
    spinner.finish_and_clear();
    done
}

/// Something that moves on the screen.
pub(crate) fn spinner(what: &'static str, quiet: bool) -> ProgressBar {
    let spinner = if quiet {
        ProgressBar::hidden()
    } else {
        ProgressBar::new_spinner()
    };
    spinner.set_message(what);
    spinner.enable_steady_tick(Duration::from_millis(100));
    spinner
}
