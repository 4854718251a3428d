//! The figures that the diagnosis is judged by.

use crate::arguments::Instruments;
use crate::case::Hidden;
use crate::outcome::Outcome;
use diagnosis::Verdict;
use std::fmt::Write as _;

/// Above this the error after adding the hidden effect is not that of a mirror with nothing hidden.
const ERROR_RATIO: f64 = 1.2;

/// Markdown, a row a figure, with what the project requires of it (`docs/requirements.md` says why). A figure that no session
/// was for has no row.
pub(crate) fn table(outcomes: &[Outcome]) -> String {
    let mut table = String::from("| figure | measured | required |\n|---|---|---|\n");
    let mut row = |figure: &str, of: Vec<bool>, required: &str| {
        let (yes, all) = (of.iter().filter(|yes| **yes).count(), of.len());
        if all > 0 {
            let percent = 100.0 * yes as f64 / all as f64;
            let _ = writeln!(
                table,
                "| {figure} | {percent:.0} % ({yes} of {all}) | {required} |"
            );
        }
    };
    use Instruments::{Sweep, SweepOfCurrents, With, WithOvenAndStage, Without};
    for (instruments, strength, said, required) in [
        (With, 1.0, "strength 1, with currents", "92 %"),
        (With, 3.0, "strength 3, with currents", "95 %"),
        (With, 0.3, "strength 0.3, with currents", "75 %"),
        (Without, 1.0, "strength 1, z only", "80 %"),
        (
            WithOvenAndStage,
            1.0,
            "strength 1, with currents, an oven and a reference step",
            "-",
        ),
        (Sweep, 1.0, "strength 1, a sweep only", "-"),
        (
            SweepOfCurrents,
            1.0,
            "strength 1, V and I of a sweep only",
            "-",
        ),
    ] {
        let most = instruments.set();
        let listed = || outcomes.listed(instruments, strength);
        row(
            &format!("{said}: true effect named, or in a set of at most {most}"),
            listed().map(|o| o.is_found(most)).collect(),
            required,
        );
        row(
            "- the limit: the session can show it",
            listed().map(Outcome::can_be_found).collect(),
            "-",
        );
        row(
            "- found, of what the session can show",
            listed()
                .filter(|o| o.can_be_found())
                .map(|o| o.is_found(most))
                .collect(),
            "-",
        );
    }
    for (instruments, said, required) in [
        (With, "with currents", "at most 1 %"),
        (Without, "z only", "at most 3 %"),
        (
            WithOvenAndStage,
            "with currents, an oven and a reference step",
            "at most 1 %",
        ),
        (Sweep, "a sweep only", "-"),
        (SweepOfCurrents, "V and I of a sweep only", "-"),
    ] {
        let hidden =
            |o: &&Outcome| o.case.hidden != Hidden::Nothing && o.case.instruments == instruments;
        row(
            &format!("a wrong effect named, anything hidden, {said}"),
            outcomes
                .iter()
                .filter(hidden)
                .map(Outcome::names_a_wrong_one)
                .collect(),
            required,
        );
    }
    let nothing = || outcomes.iter().filter(|o| o.case.hidden == Hidden::Nothing);
    row(
        "nothing hidden: an effect named",
        nothing()
            .map(|o| o.found.verdict == Verdict::Named)
            .collect(),
        "at most 5 %",
    );
    row(
        "nothing hidden: anything said to be missing",
        nothing()
            .map(|o| o.found.verdict != Verdict::None)
            .collect(),
        "-",
    );
    let unlisted = |o: &&Outcome| matches!(o.case.hidden, Hidden::One(effect, strength) if !effect.is_listed() && strength >= 1.0);
    row(
        "effect not in the list, strength 1 and more: verdict `unknown`",
        outcomes
            .iter()
            .filter(unlisted)
            .map(|o| o.found.verdict == Verdict::Unknown)
            .collect(),
        "90 %",
    );
    let sets = outcomes
        .iter()
        .filter(|o| o.found.verdict == Verdict::Ambiguous);
    row(
        "ambiguous sets that hold the truth",
        sets.map(Outcome::holds_a_truth).collect(),
        "95 %",
    );
    row(
        "true size inside the reported 95 % interval",
        outcomes
            .iter()
            .filter_map(|o| Some(o.size.as_ref()?.is_inside()))
            .collect(),
        "85 %",
    );
    row(
        "two effects hidden: both found in two rounds",
        outcomes.iter().filter_map(|o| o.both).collect(),
        "70 %",
    );
    row(
        "- both found, of those where the session can show either",
        outcomes
            .iter()
            .filter(|o| o.can_be_found())
            .filter_map(|o| o.both)
            .collect(),
        "-",
    );
    row(
        "true effect found and added: a second round names none",
        outcomes
            .iter()
            .filter_map(|o| Some(o.second.as_ref()?.is_empty()))
            .collect(),
        "-",
    );
    let mut ratios: Vec<f64> = outcomes.iter().filter_map(|o| o.error_ratio).collect();
    ratios.sort_by(f64::total_cmp);
    if let (Some(median), Some(worst)) = (ratios.get(ratios.len() / 2), ratios.last()) {
        let fine = ratios.iter().filter(|ratio| **ratio <= ERROR_RATIO).count();
        let _ = writeln!(
            table,
            "| error after adding the true effect, over that of the same mirror with nothing hidden | median {median:.2}, worst {worst:.2}, {fine} of {} at most {ERROR_RATIO} | at most {ERROR_RATIO} |",
            ratios.len()
        );
    }
    table
}

trait Chosen {
    /// Sessions with one listed effect of this strength.
    fn listed(&self, instruments: Instruments, strength: f64) -> impl Iterator<Item = &Outcome>;
}

impl Chosen for [Outcome] {
    fn listed(&self, instruments: Instruments, strength: f64) -> impl Iterator<Item = &Outcome> {
        self.iter().filter(move |o| {
            o.case.instruments == instruments
                && matches!(o.case.hidden, Hidden::One(effect, s) if effect.is_listed() && s == strength)
        })
    }
}
