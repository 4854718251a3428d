//! Where a diagnosis is, told through the `log` facade: by what has been done, and never by a clock.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Things that are done one by one, on several processors, are told so many times.
const TOLD: usize = 10;

/// Things to be done.
pub(crate) struct Count<'a> {
    what: &'a str,
    of: usize,
    done: AtomicUsize,
}

impl<'a> Count<'a> {
    /// So many of them.
    pub(crate) fn of(what: &'a str, of: usize) -> Self {
        Self {
            what,
            of,
            done: AtomicUsize::new(0),
        }
    }

    /// One more is done; hands on what came out.
    pub(crate) fn after<T>(&self, outcome: T) -> T {
        let done = 1 + self.done.fetch_add(1, Ordering::Relaxed);
        if done.is_multiple_of(self.of.div_ceil(TOLD)) || done == self.of {
            log::info!("{}: {done} of {}", self.what, self.of);
        }
        outcome
    }
}
