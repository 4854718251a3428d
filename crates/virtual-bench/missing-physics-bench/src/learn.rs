//! The table of confusions, learned from virtual mirrors with one effect hidden.

use crate::arguments::Instruments;
use crate::case::Hidden;
use crate::outcome::Outcome;
use diagnosis::Ranked;
use diagnosis::confusions::{Channels, Confusions, SizeError, Taken, confusions};
use std::collections::BTreeMap;

/// A hidden effect with less of the best score than this was not seen, rather than taken for another.
const MISTAKEN: f64 = 0.5;
/// The sizes of so many sessions say how far those of an effect are off, if its score is so many thresholds.
const SIZES: usize = 4;
const CLEARLY: f64 = 4.0;

/// The table as TOML. How far sizes are off of which these sessions tell too little stays as it was.
///
/// # Errors
/// If TOML has no word for it.
pub(crate) fn table(outcomes: &[Outcome]) -> Result<String, toml::ser::Error> {
    let table = Confusions {
        taken: taken(outcomes),
        form: with_known(forms(outcomes), &confusions().form),
    };
    let head =
        "# Made by `cargo xtask learn-confusions`, from mirrors of the calibrating families.\n\n";
    Ok(head.to_owned() + &toml::to_string(&table)?)
}

/// What was hidden and scored less than another that could be believed, and the least share of that one's score.
fn taken(outcomes: &[Outcome]) -> Vec<Taken> {
    let mut shares: BTreeMap<(Channels, String, String), f64> = BTreeMap::new();
    for outcome in outcomes {
        let Some(hidden) = hidden(outcome) else {
            continue;
        };
        let believed: Vec<&Ranked> = outcome
            .found
            .ranking
            .iter()
            .filter(|r| r.plausible && r.score > r.threshold)
            .collect();
        let truth = believed.iter().find(|r| r.effect == hidden);
        let (Some(best), Some(truth)) = (believed.first(), truth) else {
            continue;
        };
        let share = truth.score / best.score;
        if best.effect != hidden && share > MISTAKEN {
            let key = (channels(outcome), hidden, best.effect.clone());
            let least = shares.entry(key).or_insert(1.0);
            *least = least.min(share);
        }
    }
    let named = |((channels, hidden, best), share): (_, f64)| Taken {
        channels,
        hidden,
        best,
        share: rounded(share, f64::floor),
    };
    shares.into_iter().map(named).collect()
}

/// How far sizes were off beyond what their readings explain.
fn forms(outcomes: &[Outcome]) -> Vec<SizeError> {
    let mut off: BTreeMap<(Channels, String), Vec<f64>> = BTreeMap::new();
    for outcome in outcomes {
        if let (Some(hidden), Some(size)) = (hidden(outcome), &outcome.size)
            && outcome.is_clear(&hidden, CLEARLY)
        {
            let of_this = off.entry((channels(outcome), hidden)).or_default();
            of_this.push(size.off());
        }
    }
    let named = |((channels, effect), off): (_, Vec<f64>)| SizeError {
        channels,
        effect,
        share: rounded(
            (off.iter().map(|off| off * off).sum::<f64>() / off.len() as f64).sqrt(),
            f64::ceil,
        ),
    };
    off.into_iter()
        .filter(|(_, off)| off.len() >= SIZES)
        .map(named)
        .collect()
}

/// Those that were learned, and of the known ones the others.
fn with_known(learned: Vec<SizeError>, known: &[SizeError]) -> Vec<SizeError> {
    let key = |form: &SizeError| (form.channels, form.effect.clone());
    let known = known.iter().map(|form| (key(form), form.clone()));
    let mut all: BTreeMap<_, _> = known.collect();
    all.extend(learned.into_iter().map(|form| (key(&form), form)));
    all.into_values().collect()
}

fn hidden(outcome: &Outcome) -> Option<String> {
    match outcome.case.hidden {
        Hidden::One(effect, _) => Some(effect.is_a().to_owned()),
        _ => None,
    }
}

fn channels(outcome: &Outcome) -> Channels {
    match outcome.case.instruments {
        Instruments::With | Instruments::WithOvenAndStage | Instruments::Sweep => Channels::Both,
        Instruments::SweepOfCurrents => Channels::Currents,
        Instruments::Without => Channels::Displacement,
    }
}

/// To whole percents.
fn rounded(share: f64, to: impl Fn(f64) -> f64) -> f64 {
    to(100.0 * share) / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_learned_anew_replaces_what_was_known_and_nothing_else() {
        let form = |effect: &str, share| SizeError {
            channels: Channels::Both,
            effect: effect.to_owned(),
            share,
        };
        let known = [form("creep", 0.05), form("gap-heat-loss", 0.87)];
        let all = with_known(vec![form("softening", 0.1), form("creep", 0.06)], &known);
        let shares: Vec<_> = all.iter().map(|f| (f.effect.as_str(), f.share)).collect();
        assert_eq!(
            shares,
            [("creep", 0.06), ("gap-heat-loss", 0.87), ("softening", 0.1)]
        );
    }
}
