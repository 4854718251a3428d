//! How well the diagnosis finds what is hidden in `data/hidden`, asked as a user asks.

use std::fs;
use std::time::Instant;

use anyhow::{Context, Result};

use crate::cargo::workspace;
use crate::tool;

/// The tool's list, as `effect list` prints it.
const LISTED: usize = 20;

/// What came of one session.
struct Outcome {
    hidden: Vec<String>,
    verdict: String,
    effects: Vec<String>,
}

impl Outcome {
    fn found(&self) -> bool {
        self.hidden.iter().any(|id| self.effects.contains(id))
    }

    fn named_wrong(&self) -> bool {
        self.verdict == "named" && !self.found()
    }
}

/// Diagnoses every session, and prints each verdict beside the truth, and the sums.
pub(crate) fn run() -> Result<()> {
    tool::build()?;
    let directory = workspace().join("data/hidden");
    let answers: toml::Table = fs::read_to_string(directory.join("answers.toml"))?.parse()?;
    let listed = listed_effects()?;
    let start = Instant::now();
    let mut outcomes = Vec::new();
    for (session, hidden) in &answers {
        let hidden: Vec<String> = hidden.clone().try_into()?;
        let outcome = diagnose(&directory.join(session).to_string_lossy(), hidden)?;
        println!(
            "{session}  {:<30} {:<10} {}",
            if outcome.hidden.is_empty() {
                "nothing".to_owned()
            } else {
                outcome.hidden.join(" ")
            },
            outcome.verdict,
            outcome.effects.join(" "),
        );
        outcomes.push(outcome);
    }
    let seconds = start.elapsed().as_secs_f64() / outcomes.len() as f64;
    print_sums(&outcomes, &listed, seconds);
    Ok(())
}

fn print_sums(outcomes: &[Outcome], listed: &[String], seconds: f64) {
    let is_listed =
        |outcome: &&Outcome| outcome.hidden.len() == 1 && listed.contains(&outcome.hidden[0]);
    let is_unlisted =
        |outcome: &&Outcome| outcome.hidden.len() == 1 && !listed.contains(&outcome.hidden[0]);
    let quiet = |outcome: &&Outcome| outcome.hidden.is_empty();
    let count = |of: &dyn Fn(&&Outcome) -> bool, what: &dyn Fn(&Outcome) -> bool| {
        let all: Vec<_> = outcomes.iter().filter(of).collect();
        format!(
            "{} of {}",
            all.iter().filter(|outcome| what(outcome)).count(),
            all.len()
        )
    };
    println!("\n| figure, strength 1, 20 nm, with currents | measured |\n|---|---|");
    let set_of_two = |outcome: &Outcome| outcome.found() && outcome.effects.len() <= 2;
    println!(
        "| true effect named, or in a set of at most two | {} |",
        count(&is_listed, &set_of_two)
    );
    println!(
        "| true effect in a set of any size | {} |",
        count(&is_listed, &Outcome::found)
    );
    println!(
        "| a wrong effect named | {} |",
        count(&|_| true, &Outcome::named_wrong)
    );
    let unknown = |outcome: &Outcome| outcome.verdict == "unknown";
    println!(
        "| effect not in the list, verdict `unknown` | {} |",
        count(&is_unlisted, &unknown)
    );
    let named = |outcome: &Outcome| outcome.verdict == "named";
    println!(
        "| nothing hidden, an effect named | {} |",
        count(&quiet, &named)
    );
    println!("| one diagnosis, whole process, mean | {seconds:.1} s |");
}

fn diagnose(session: &str, hidden: Vec<String>) -> Result<Outcome> {
    let report = tool::json(tool::command().args(["diagnose", "paper", session]))?;
    let effects = report["effects"]
        .as_array()
        .context("no effects in the report")?;
    Ok(Outcome {
        hidden,
        verdict: report["verdict"]
            .as_str()
            .context("no verdict in the report")?
            .to_owned(),
        effects: effects
            .iter()
            .filter_map(|id| Some(id.as_str()?.to_owned()))
            .collect(),
    })
}

fn listed_effects() -> Result<Vec<String>> {
    let report = tool::json(tool::command().args(["effect", "list"]))?;
    let effects = report["effects"].as_array().context("no list")?;
    let ids: Vec<String> = effects
        .iter()
        .filter_map(|effect| Some(effect["id"].as_str()?.to_owned()))
        .collect();
    anyhow::ensure!(ids.len() == LISTED, "the list holds {} effects", ids.len());
    Ok(ids)
}
