//! Hides every effect of the virtual mirror in mirrors of families that no threshold was calibrated on, diagnoses them,
//! and counts. `cargo run --release -p diagnosis --example confusion -- [seeds] [strength] [with|without] [cache folder]`

use diagnosis::{Plan, Verdict, diagnose};
use mirror_model::{Model, Preset};
use std::path::Path;
use virtual_mirror::{Effect, Family, MirrorConfig, Plan as Drives};
use virtual_sessions::{Instruments, measure};

const TESTING: [Family; 2] = [Family::F, Family::G];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |index: usize, usual: &'static str| {
        arguments
            .get(index)
            .map_or(usual, String::as_str)
            .to_owned()
    };
    let seeds: u64 = argument(0, "1").parse().expect("a number of seeds");
    let strength: f64 = argument(1, "1").parse().expect("a strength");
    let currents = argument(2, "with") == "with";
    let cache = argument(3, "target/diagnosis-cache");
    let (most, instruments) = if currents {
        (2, Instruments::PositionAndCurrents)
    } else {
        (3, Instruments::Position)
    };
    let (mut right, mut wrong, mut tried, mut quiet, mut unlisted) = (0, 0, 0, 0, (0, 0));
    let hidden: Vec<Option<Effect>> = std::iter::once(None)
        .chain(Effect::ALL.iter().copied().map(Some))
        .collect();
    let only = argument(4, "");
    for effect in hidden {
        if !only.is_empty() && effect.map_or("nothing", Effect::id) != only {
            continue;
        }
        for seed in 0..seeds {
            for family in TESTING {
                let mut config = MirrorConfig::draw(family, 1000 + seed);
                if let Some(effect) = effect {
                    config.effects.set(effect, strength);
                }
                let session = measure(&config, &Drives::standard(3.5), instruments);
                let plan = Plan::new(&session.expect("the family's mirrors are possible"));
                let found = match diagnose(
                    &Model::from(Preset::Paper),
                    &plan,
                    &[],
                    Some(Path::new(&cache)),
                ) {
                    Ok(found) => found,
                    Err(error) => {
                        println!("{effect:?} {family:?} {seed}: {error}");
                        continue;
                    }
                };
                let best = &found.ranking[0];
                println!(
                    "{:<22} {family:?} {seed}: {:?} {} (misfit {:.2}, best {} {:.0}/{:.0})",
                    effect.map_or("nothing", Effect::id),
                    found.verdict,
                    found.effects.join(" "),
                    found.misfit,
                    best.effect,
                    best.score,
                    best.threshold
                );
                if !only.is_empty() {
                    for r in found.ranking.iter().take(4) {
                        println!(
                            "   {} {:.0} {} {:?}",
                            r.effect, r.score, r.plausible, r.parameters
                        );
                    }
                }
                match effect {
                    None => quiet += usize::from(!found.effects.is_empty()),
                    Some(effect) if effect.is_listed() => {
                        let holds = found.effects.iter().any(|id| id == effect.id());
                        tried += 1;
                        right += usize::from(holds && found.effects.len() <= most);
                        wrong += usize::from(!holds && found.verdict == Verdict::Named);
                    }
                    Some(_) => {
                        unlisted.0 += usize::from(found.verdict == Verdict::Unknown);
                        unlisted.1 += 1;
                        wrong += usize::from(found.verdict == Verdict::Named);
                    }
                }
            }
        }
    }
    println!("true effect named, or in a set of at most {most}: {right} of {tried}");
    println!("a wrong effect named: {wrong} of {}", tried + unlisted.1);
    println!(
        "nothing hidden, an effect named or suspected: {quiet} of {}",
        seeds as usize * TESTING.len()
    );
    println!(
        "effect not in the list, verdict unknown: {} of {}",
        unlisted.0, unlisted.1
    );
}
