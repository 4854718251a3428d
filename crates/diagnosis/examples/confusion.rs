//! Hides every effect of the virtual mirror in mirrors of families that no threshold was calibrated on, diagnoses them,
//! and counts. `cargo run --release -p diagnosis --example confusion -- [seeds] [strength] [with|without] [cache folder]`

use diagnosis::{Plan, Verdict, diagnose};
use measurement::{Keys, MeasurementFile, Row, Session};
use mirror_model::{Model, Preset};
use std::path::Path;
use virtual_mirror::{Effect, Family, MirrorConfig, Plan as Drives, Session as Virtual};

const TESTING: [Family; 2] = [Family::D, Family::E];

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
    let most = if currents { 2 } else { 3 };
    let (mut right, mut wrong, mut tried, mut quiet, mut unlisted) = (0, 0, 0, 0, (0, 0));
    let hidden: Vec<Option<Effect>> = std::iter::once(None)
        .chain(Effect::ALL.iter().copied().map(Some))
        .collect();
    for effect in hidden {
        for seed in 0..seeds {
            for family in TESTING {
                let mut config = MirrorConfig::draw(family, 1000 + seed);
                if let Some(effect) = effect {
                    config.effects.set(effect, strength);
                }
                let plan = Plan::new(&record(&config, currents));
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

fn record(config: &MirrorConfig, currents: bool) -> Session {
    let session =
        Virtual::record(config, &Drives::standard(3.5)).expect("the family's mirrors are possible");
    let files = session.recordings.into_iter().map(|recording| {
        let experiment = &recording.experiment;
        let mut keys = Keys::default();
        keys.set("experiment", &experiment.name);
        keys.set("noise_z_nm", &session.noise_z_nm.to_string());
        if experiment.prehold_s > 0.0 {
            keys.set("prehold_V", &experiment.prehold_v.to_string());
            keys.set("prehold_s", &experiment.prehold_s.to_string());
        }
        if let Some(drive) = &experiment.drive {
            keys.set("drive", drive);
        }
        let rows = recording.rows.iter().map(|row| Row {
            t_s: row.t_s,
            t_global_s: Some(row.t_global_s),
            voltage_v: row.drive_v,
            current_a: row
                .reading
                .current_a
                .map(|current| currents.then_some(current)),
            z_um: Some(row.reading.z_um),
            ..Row::default()
        });
        (
            experiment.name.clone(),
            MeasurementFile {
                keys,
                notes: Vec::new(),
                rows: rows.collect(),
            },
        )
    });
    Session {
        files: files.collect(),
    }
}
