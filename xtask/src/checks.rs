//! Programs that must pass, run as many at a time as there are processors, and beside them what waits most of its time.

use std::collections::VecDeque;
use std::process::{Command, Output};
use std::sync::mpsc::channel;
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

/// A program that must pass.
pub(crate) struct Check {
    /// What it is called.
    pub(crate) name: String,
    /// How it is started.
    pub(crate) command: Command,
    /// What it must have done.
    pub(crate) verdict: fn(&Output) -> Result<()>,
    /// Whether it tells of tests that fail on purpose: whoever reads on would take them for failures of ours.
    pub(crate) fails_on_purpose: bool,
    /// Whether it waits most of its time, for a board's clock or a lease: a processor would stand still meanwhile.
    pub(crate) waits: bool,
}

impl Check {
    /// One that says by its exit code whether it has passed.
    pub(crate) fn new(name: String, command: Command) -> Self {
        Self {
            name,
            command,
            verdict: |output| {
                ensure!(output.status.success(), "{}", output.status);
                Ok(())
            },
            fails_on_purpose: false,
            waits: false,
        }
    }
}

/// A check that has run.
struct Ended {
    name: String,
    fails_on_purpose: bool,
    output: Output,
    verdict: Result<()>,
    took: Duration,
}

/// Runs the checks, each on one processor: an emulated board and its mirror take turns, and so do a tool and its board. Those that wait
/// go beside them, one after the other. They are begun in their order; what a program says is printed once it has ended. Returns
/// how long each took.
pub(crate) fn run(checks: Vec<Check>) -> Result<Vec<(String, Duration)>> {
    let (waiting, working): (VecDeque<Check>, VecDeque<Check>) =
        checks.into_iter().partition(|check| check.waits);
    let (waiting, working) = (Mutex::new(waiting), Mutex::new(working));
    let first = |queue: &Mutex<VecDeque<Check>>| {
        let mut queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
        queue.pop_front()
    };
    let (send, ended) = channel();
    let ended: Vec<Result<Ended>> = thread::scope(|scope| {
        // One lane a processor, and one on any of them for what waits.
        for processor in processors().into_iter().map(Some).chain([None]) {
            let (send, first, working, waiting) = (send.clone(), &first, &working, &waiting);
            scope.spawn(move || {
                if let Some(processor) = &processor {
                    // Programs inherit it. Where the system does not let it, the tests are slower and nothing else.
                    let _ = sched_setaffinity(None, processor);
                }
                let works = || processor.and_then(|_| first(working));
                while let Some(check) = works().or_else(|| first(waiting)) {
                    if send.send(one(check)).is_err() {
                        return;
                    }
                }
            });
        }
        drop(send);
        ended.into_iter().inspect(print).collect()
    });
    let ended = ended.into_iter().collect::<Result<Vec<_>>>()?;
    let failed: Vec<String> = ended
        .iter()
        .filter_map(|ended| {
            Some(format!(
                "{} ({:#})",
                ended.name,
                ended.verdict.as_ref().err()?
            ))
        })
        .collect();
    ensure!(failed.is_empty(), "failed: {}", failed.join(", "));
    Ok(ended
        .into_iter()
        .map(|ended| (ended.name, ended.took))
        .collect())
}

fn one(mut check: Check) -> Result<Ended> {
    let start = Instant::now();
    let output = check.command.output();
    let output = output.with_context(|| format!("{} does not run", check.name))?;
    Ok(Ended {
        verdict: (check.verdict)(&output),
        name: check.name,
        fails_on_purpose: check.fails_on_purpose,
        output,
        took: start.elapsed(),
    })
}

fn print(ended: &Result<Ended>) {
    if let Ok(Ended {
        name,
        fails_on_purpose,
        output,
        verdict,
        ..
    }) = ended
    {
        println!("\n> {name}");
        if *fails_on_purpose && verdict.is_ok() {
            println!("what fails on purpose does, and nothing else");
            return;
        }
        print!("{}", String::from_utf8_lossy(&output.stdout));
        eprint!("{}", String::from_utf8_lossy(&output.stderr));
    }
}

/// Each processor that this process may use, by itself.
fn processors() -> Vec<CpuSet> {
    let all = sched_getaffinity(None).unwrap_or_else(|_| only(0));
    let numbers = (0..CpuSet::MAX_CPU).filter(|number| all.is_set(*number));
    numbers.map(only).collect()
}

fn only(number: usize) -> CpuSet {
    let mut set = CpuSet::new();
    set.set(number);
    set
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(name: &str, script: &str) -> Check {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        Check::new(name.to_owned(), command)
    }

    #[test]
    fn all_are_run_and_those_that_fail_are_named() {
        let mut waits = shell("waits", "true");
        waits.waits = true;
        let checks = vec![shell("one", "true"), waits, shell("other", "true")];
        let passed = run(checks).expect("all pass");
        let mut names: Vec<String> = passed.into_iter().map(|(name, _)| name).collect();
        names.sort();
        assert_eq!(names, ["one", "other", "waits"]);
        let said = run(vec![shell("bad", "exit 3"), shell("good", "true")]);
        let said = said.expect_err("one fails").to_string();
        assert!(
            said.contains("bad (exit status: 3)") && !said.contains("good"),
            "{said}"
        );
        let nothing = Check::new("none".to_owned(), Command::new("/nowhere"));
        let said = run(vec![nothing]).expect_err("it is not there").to_string();
        assert!(said.contains("none does not run"), "{said}");
    }
}
