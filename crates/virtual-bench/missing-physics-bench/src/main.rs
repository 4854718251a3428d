//! Hides every effect of the virtual mirror in mirrors of families that no threshold was calibrated on, diagnoses them, and
//! prints what came of it in the figures that the diagnosis is judged by. A line a session comes first, as they end.
//!
//! `cargo xtask bench diagnose -- --help`

mod arguments;
mod case;
mod design;
mod export;
mod learn;
mod other_mirror;
mod outcome;
mod table;
#[cfg(test)]
mod tests;
mod whereabouts;

use arguments::Arguments;
use clap::Parser;
use diagnosis::NullEnsemble;
use outcome::Outcome;
use rayon::prelude::*;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments = Arguments::parse();
    if let Some(folder) = &arguments.export {
        return export::export(
            folder,
            arguments.first_seed,
            arguments.seeds,
            &arguments.cache,
        );
    }
    if arguments.whereabouts {
        return whereabouts::run(&arguments);
    }
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
