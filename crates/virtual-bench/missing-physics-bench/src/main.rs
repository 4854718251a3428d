//! Hides every effect of the virtual mirror in mirrors of families that no threshold was calibrated on, diagnoses them, and
//! prints what came of it in the figures that the diagnosis is judged by. A line a session comes first, as they end.
//!
//! `cargo xtask bench diagnose -- --help`

mod case;
mod design;
mod learn;
mod outcome;
mod table;
#[cfg(test)]
mod tests;

use clap::Parser;
use diagnosis::NullEnsemble;
use outcome::Outcome;
use rayon::prelude::*;
use std::path::PathBuf;
use std::time::Instant;

/// What is tried.
#[derive(Parser)]
struct Arguments {
    /// Mirrors a kind of session: one seed is 324 sessions, some twenty minutes on two idle cores.
    #[arg(long, default_value_t = 1)]
    seeds: u64,
    /// The first seed: figures to be believed come from seeds that nobody developed on.
    #[arg(long, default_value_t = 1000)]
    first_seed: u64,
    /// Hide this only: an effect, `nothing`, or `two`. Each best explanation is printed with its rivals.
    #[arg(long)]
    only: Option<String>,
    /// Strengths of a single hidden effect.
    #[arg(long, value_delimiter = ',', default_value = "0.3,1,3")]
    strengths: Vec<f64>,
    /// White noise of the displacement (nm).
    #[arg(long, value_delimiter = ',', default_value = "10,50")]
    noises: Vec<f64>,
    /// Mirrors of each family with nothing hidden, a seed and a kind of session.
    #[arg(long, default_value_t = 2)]
    nothing: usize,
    /// Mirrors are made to a design of their family, and the diagnosis is told the design with its tolerances.
    #[arg(long)]
    described: bool,
    /// Only sessions with these instruments.
    #[arg(long, value_enum)]
    instruments: Option<case::Instruments>,
    /// Hides effects in mirrors of the families that thresholds are calibrated on instead, and writes what is taken for what
    /// and how far sizes are off to this file: the table that the diagnosis ships with.
    #[arg(long)]
    learn: Option<PathBuf>,
    /// Where null ensembles are kept.
    #[arg(long, default_value = "target/diagnosis-cache")]
    cache: PathBuf,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments = Arguments::parse();
    let cases = case::all(&arguments);
    // Before many sessions at once would each miss their ensemble.
    let mut kinds: Vec<&case::Case> = Vec::new();
    for case in &cases {
        if kinds.iter().all(|kind| !kind.is_like(case)) {
            let session = case.session(&case.config())?;
            NullEnsemble::new(&session, &case.model().device, Some(&arguments.cache))?;
            kinds.push(case);
        }
    }
    let start = Instant::now();
    let outcomes: Vec<Outcome> = cases
        .par_iter()
        .filter_map(|case| {
            match outcome::diagnosed(case, arguments.learn.is_some(), &arguments.cache) {
                Ok(outcome) => {
                    println!("{outcome}");
                    if arguments.only.is_some() || arguments.learn.is_some() {
                        print!("{}", outcome.rivals());
                    }
                    Some(outcome)
                }
                Err(error) => {
                    println!("{case}: {error}");
                    None
                }
            }
        })
        .collect();
    println!(
        "\n{} sessions of {} in {:.0} s\n",
        outcomes.len(),
        cases.len(),
        start.elapsed().as_secs_f64()
    );
    match &arguments.learn {
        Some(file) => std::fs::write(file, learn::table(&outcomes)?)?,
        None => print!("{}", table::table(&outcomes)),
    }
    Ok(())
}
