//! Where a diagnosis looks for what is hidden, held against where it is; and, from mirrors of the calibrating families, how sure
//! it may be of that.

use crate::arguments::{Arguments, Instruments};
use crate::case::{Case, Hidden, UNSEEN};
use crate::other_mirror::{Law, OtherMirror};
use diagnosis::confusions::Channels;
use diagnosis::{CALIBRATING, Diagnosis, NullEnsemble, Sharpness, Verdict, diagnose, shares};
use identification::Dataset;
use mirror_model::effect::{Stage, find};
use mirror_model::{Model, Preset};
use rayon::prelude::*;
use std::error::Error;
use std::fmt;
use std::time::Instant;
use virtual_mirror::Effect;

/// Sharpnesses that are tried, in hundredths.
const SHARPNESSES: std::ops::RangeInclusive<u32> = 1..=200;
/// Bins of the reliability diagram.
const BINS: usize = 5;

/// A mirror in which something is hidden, or nothing.
#[derive(Clone, Copy)]
enum Mirror {
    Virtual(Case),
    Other(OtherMirror),
}

impl fmt::Display for Mirror {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Virtual(case) => case.fmt(f),
            Self::Other(mirror) => mirror.fmt(f),
        }
    }
}

impl Mirror {
    /// The stage of what is hidden.
    fn stage(&self) -> Option<Stage> {
        match self {
            Self::Other(mirror) => mirror.law.map(|(law, _)| law.stage()),
            Self::Virtual(case) => match case.hidden {
                Hidden::One(effect, _) => Some(stage(effect)),
                _ => None,
            },
        }
    }

    fn is_listed(&self) -> bool {
        match self {
            Self::Virtual(case) => {
                matches!(case.hidden, Hidden::One(effect, _) if effect.is_listed())
            }
            Self::Other(mirror) => mirror.law.is_some_and(|(law, _)| law.is_a().is_some()),
        }
    }

    fn session(&self) -> Result<Dataset, Box<dyn Error>> {
        Ok(match self {
            Self::Virtual(case) => case.session(&case.config())?,
            Self::Other(mirror) => mirror.session(&experiments::session(3.5))?,
        })
    }
}

/// The stage of an effect of the virtual mirror.
fn stage(effect: Effect) -> Stage {
    match effect {
        Effect::HeaterAging | Effect::LooseContact => Stage::Resistance,
        Effect::Stiction => Stage::Memory,
        Effect::SensorAbbe => Stage::Sensor,
        listed => find(listed.is_a()).expect("a listed effect").info().stage,
    }
}

/// What came of one mirror.
struct Place {
    mirror: Mirror,
    channels: Channels,
    found: Diagnosis,
    seconds: f64,
}

impl Place {
    /// The most likely stage and its confidence, where any is told.
    fn best(&self) -> Option<(Stage, f64)> {
        let best = self.found.whereabouts.as_ref()?.stages.first()?;
        Some((best.stage, best.confidence))
    }

    /// Whether the most likely stage is the true one, where both are known.
    fn is_right(&self) -> Option<bool> {
        Some(self.best()?.0 == self.mirror.stage()?)
    }

    /// The confidence of the true stage if stages counted so much.
    fn likelihood(&self, sharpness: f64) -> Option<f64> {
        let stages = &self.found.whereabouts.as_ref()?.stages;
        let truth = self.mirror.stage()?;
        let scores: Vec<f64> = stages.iter().map(|stage| stage.score).collect();
        let place = stages.iter().position(|stage| stage.stage == truth)?;
        Some(shares(&scores, sharpness)[place])
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { mirror, found, .. } = self;
        let truth = mirror.stage().map_or("-".into(), |s| s.to_string());
        let verdict = format!("{:?} {}", found.verdict, found.effects.join(" "));
        write!(f, "{mirror}: in {truth}; {verdict} ({:.1} s)", self.seconds)?;
        let Some(whereabouts) = &found.whereabouts else {
            return Ok(());
        };
        if let Some(best) = found.ranking.first() {
            write!(f, "\n    {best}\n    ")?;
        }
        for stage in whereabouts.stages.iter().take(5) {
            write!(f, ", {stage} ({:.0})", stage.score)?;
        }
        for place in whereabouts.places.iter().take(3) {
            let (score, threshold) = (place.score, place.threshold);
            write!(f, "\n    {} {score:.0}/{threshold:.0}", place.place)?;
        }
        if let Some(proposal) = &found.proposal {
            let (error, held_out) = (proposal.error_rms, proposal.held_out_rms);
            write!(
                f,
                "\n    proposed: {}, error {:.3} to {:.3}, held out {:.3} to {:.3}",
                proposal.sentence, error.before, error.after, held_out.before, held_out.after
            )?;
        }
        Ok(())
    }
}

/// The sessions asked for: effects of the virtual mirror, listed or not, and laws of the other one.
fn mirrors(arguments: &Arguments) -> Vec<Mirror> {
    let learns = arguments.learn.is_some();
    let families: &[_] = if learns { &CALIBRATING } else { &UNSEEN };
    let mut mirrors = Vec::new();
    for seed in (0..arguments.seeds).map(|seed| arguments.first_seed + seed) {
        for &noise_nm in &arguments.noises {
            for instruments in Instruments::tried(arguments.instruments) {
                let mut push = |hidden, turn: usize| {
                    mirrors.push(Mirror::Virtual(Case {
                        hidden,
                        family: families[(turn + seed as usize) % families.len()],
                        seed: seed + 500 * turn as u64,
                        design: None,
                        noise_nm,
                        instruments,
                    }));
                };
                for turn in 0..arguments.nothing * families.len() {
                    push(Hidden::Nothing, turn);
                }
                for &strength in &arguments.strengths {
                    for (turn, &effect) in Effect::ALL.iter().enumerate() {
                        push(Hidden::One(effect, strength), turn);
                    }
                }
            }
        }
        if !learns {
            for &strength in &arguments.strengths {
                let laws = Law::ALL.iter().map(|&law| Some((law, strength)));
                mirrors.extend(laws.map(|law| Mirror::Other(OtherMirror { law, seed })));
            }
            mirrors.extend((0..arguments.nothing as u64).map(|turn| {
                let seed = seed + 500 * turn;
                Mirror::Other(OtherMirror { law: None, seed })
            }));
        }
    }
    if let Some(only) = &arguments.only {
        mirrors.retain(|mirror| {
            let name = mirror.to_string();
            match only.as_str() {
                "unlisted" => !mirror.is_listed() && mirror.stage().is_some(),
                only => name.starts_with(only),
            }
        });
    }
    mirrors
}

/// Diagnoses them all, and prints how often the stage is right, or learns from them how sure it may be.
pub(crate) fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let model = Model::from(Preset::Paper);
    let mirrors = mirrors(arguments);
    let found: Vec<Place> = mirrors
        .par_iter()
        .filter_map(|mirror| {
            let diagnosed = || -> Result<Place, Box<dyn Error>> {
                let session = mirror.session()?;
                let ensemble = NullEnsemble::new(&session, &model.device, Some(&arguments.cache));
                drop(ensemble?);
                let start = Instant::now();
                let found = diagnose(&model, &session, &[], Some(&arguments.cache))?;
                Ok(Place {
                    mirror: *mirror,
                    channels: Channels::of(&session),
                    found,
                    seconds: start.elapsed().as_secs_f64(),
                })
            };
            match diagnosed() {
                Ok(place) => {
                    println!("{place}");
                    Some(place)
                }
                Err(error) => {
                    println!("{mirror}: {error}");
                    None
                }
            }
        })
        .collect();
    match &arguments.learn {
        Some(file) => std::fs::write(file, table(&found)?)?,
        None => print!("{}", figures(&found)),
    }
    Ok(())
}

/// The sharpness under which the true stages are most likely, by channels.
fn table(found: &[Place]) -> Result<String, toml::ser::Error> {
    let learned = |channels| {
        let of = |sharpness: f64| -> f64 {
            let told = found.iter().filter(|place| place.channels == channels);
            told.filter_map(|place| Some(place.likelihood(sharpness)?.ln()))
                .sum()
        };
        let tried = SHARPNESSES.map(|hundredth| 0.01 * f64::from(hundredth));
        let best = tried.max_by(|a, b| of(*a).total_cmp(&of(*b)));
        (100.0 * best.unwrap_or(1.0)).round() / 100.0
    };
    let both = learned(Channels::Both);
    let table = Sharpness {
        both,
        displacement: learned(Channels::Displacement),
        // Currents alone show no stage beyond the heat: nothing to learn from.
        currents: both,
    };
    let head = "# Made by `cargo xtask bench diagnose -- --whereabouts --learn FILE`, from mirrors of the calibrating families with one effect hidden.\n\n";
    Ok(head.to_owned() + &toml::to_string(&table)?)
}

fn figures(found: &[Place]) -> String {
    let mut text = String::from(
        "\n| sessions | stage told | right | truth within the stages that hold 90 % |\n|---|---|---|---|\n",
    );
    let mut row = |name: &str, of: &dyn Fn(&Place) -> bool| {
        let these: Vec<&Place> = found.iter().filter(|place| of(place)).collect();
        let told: Vec<bool> = these.iter().filter_map(|place| place.is_right()).collect();
        let right = told.iter().filter(|right| **right).count();
        let held = these.iter().filter(|place| holds_truth(place)).count();
        let (all, told) = (these.len(), told.len());
        text += &format!("| {name} | {told} of {all} | {right} of {told} | {held} of {told} |\n");
    };
    let is_other = |place: &Place| matches!(place.mirror, Mirror::Other(_));
    let hides = |place: &Place| place.mirror.stage().is_some();
    let is_unknown = |place: &Place| place.found.verdict == Verdict::Unknown;
    row("virtual mirrors, listed effects", &|p| {
        !is_other(p) && p.mirror.is_listed()
    });
    row("virtual mirrors, effects not in the list", &|p| {
        hides(p) && !is_other(p) && !p.mirror.is_listed()
    });
    row("another author's mirror", &|p| hides(p) && is_other(p));
    row("not in the list, verdict `unknown`", &|p| {
        hides(p) && !p.mirror.is_listed() && is_unknown(p)
    });
    let nothing: Vec<&Place> = found.iter().filter(|place| !hides(place)).collect();
    let placed = nothing.iter().filter(|p| p.found.whereabouts.is_some());
    text += &format!(
        "\nnothing hidden: a place told in {} of {}\n\n| confidence | sessions | mean confidence | right |\n|---|---|---|---|\n",
        placed.count(),
        nothing.len()
    );
    for bin in 0..BINS {
        let of_bin = found.iter().filter_map(|place| {
            let (_, confidence) = place.best()?;
            let own = ((confidence * BINS as f64) as usize).min(BINS - 1);
            (own == bin).then_some((confidence, place.is_right()?))
        });
        let of_bin: Vec<(f64, bool)> = of_bin.collect();
        if of_bin.is_empty() {
            continue;
        }
        let count = of_bin.len() as f64;
        let mean = of_bin.iter().map(|(confidence, _)| confidence).sum::<f64>() / count;
        let right = of_bin.iter().filter(|(_, right)| *right).count() as f64 / count;
        let [low, high] = [bin, bin + 1].map(|edge| 100 * edge / BINS);
        text += &format!(
            "| {low} to {high} % | {count} | {:.0} % | {:.0} % |\n",
            100.0 * mean,
            100.0 * right
        );
    }
    text
}

/// Whether the true stage is among the most likely ones that hold 90 % of the confidence.
fn holds_truth(place: &Place) -> bool {
    let (Some(whereabouts), Some(truth)) = (&place.found.whereabouts, place.mirror.stage()) else {
        return false;
    };
    let mut likely = whereabouts.likely().into_iter();
    likely.any(|stage| stage.stage == truth)
}
