//! `cargo xtask fuzz`.

use std::thread;

use anyhow::{Result, ensure};
use clap::Parser;
use fuzz::Target;

/// Cases that a thread takes at a time.
const BATCH: u64 = 10_000;

/// Fuzzes everything that reads input from outside.
#[derive(Parser)]
struct Arguments {
    /// Cases in all, spread evenly.
    #[arg(long, default_value_t = 600_000)]
    cases: u64,
    /// The first case's number; other numbers are other cases.
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// Only this.
    #[arg(long, value_enum)]
    target: Option<Target>,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let targets = match arguments.target {
        Some(target) => vec![target],
        None => Target::ALL.to_vec(),
    };
    let share = arguments.cases.div_ceil(targets.len() as u64);
    let (mut cases, mut crashes) = (0, 0);
    for target in targets {
        let crashed = in_threads(target, arguments.first, share);
        println!(
            "{target:?}: {share} cases, {} crashes {crashed:?}",
            crashed.len()
        );
        cases += share;
        crashes += crashed.len();
    }
    println!("{cases} cases, {crashes} crashes");
    ensure!(
        crashes == 0,
        "a crash's number is its case: `--target T --first N --cases 1`"
    );
    Ok(())
}

/// Runs the cases on all processors.
fn in_threads(target: Target, first: u64, count: u64) -> Vec<u64> {
    let workers = thread::available_parallelism().map_or(1, |count| count.get() as u64);
    let work = |worker: u64| {
        let mut crashed = Vec::new();
        for start in (worker * BATCH..count).step_by((workers * BATCH) as usize) {
            crashed.extend(target.run(first + start, BATCH.min(count - start)));
        }
        crashed
    };
    thread::scope(|scope| {
        let threads: Vec<_> = (0..workers)
            .map(|worker| scope.spawn(move || work(worker)))
            .collect();
        threads
            .into_iter()
            .flat_map(|thread| thread.join().expect("panics are caught"))
            .collect()
    })
}
