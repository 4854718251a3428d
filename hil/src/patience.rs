//! How long to wait for an emulated board: as long as anybody would, but for the time in which the machine has no processor
//! for it.

use std::fs;
use std::time::{Duration, Instant};

/// Threads of processes are here, each with the time that it ran and that it waited for a processor
/// (Linux, `Documentation/scheduler/sched-stats.rst`: `/proc/<pid>/schedstat`, ns).
const PROCESSES: &str = "/proc";

/// Waits by a clock that stands while the processes that are waited for are kept from running.
pub(crate) struct Patience {
    processes: Vec<u32>,
    since: Instant,
    kept_before: Duration,
}

impl Patience {
    /// With these processes.
    pub(crate) fn with(processes: Vec<u32>) -> Self {
        Self {
            since: Instant::now(),
            kept_before: kept_waiting(&processes),
            processes,
        }
    }

    /// How long they have had.
    pub(crate) fn waited(&self) -> Duration {
        let kept = kept_waiting(&self.processes).saturating_sub(self.kept_before);
        self.since.elapsed().saturating_sub(kept)
    }
}

/// For how long so far: of each process the thread that waited longest, for the others may have nothing to do.
fn kept_waiting(processes: &[u32]) -> Duration {
    let of_process = |process: &u32| {
        let threads = fs::read_dir(format!("{PROCESSES}/{process}/task")).ok()?;
        let waited = |thread: fs::DirEntry| {
            let told = fs::read_to_string(thread.path().join("schedstat")).ok()?;
            told.split_whitespace().nth(1)?.parse::<u64>().ok()
        };
        threads.flatten().filter_map(waited).max()
    };
    let waited_ns = processes.iter().filter_map(of_process).sum();
    Duration::from_nanos(waited_ns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process;
    use std::thread;

    #[test]
    fn the_time_is_the_walls_where_there_is_a_processor_and_never_more() {
        let patience = Patience::with(vec![process::id()]);
        let start = Instant::now();
        while start.elapsed() < Duration::from_millis(20) {
            thread::yield_now();
        }
        assert!(patience.waited() <= patience.since.elapsed());
        assert_eq!(kept_waiting(&[u32::MAX]), Duration::ZERO, "no such process");
        let nobody = Patience::with(Vec::new());
        thread::sleep(Duration::from_millis(5));
        assert!(nobody.waited() >= Duration::from_millis(5));
    }
}
