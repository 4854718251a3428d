//! Sessions as a data set that other methods can be tried on: measurement files, a manifest, and the answers apart.

use crate::arguments::Instruments;
use crate::case::{Case, Hidden, UNSEEN, pairs};
use crate::outcome::can_show;
use diagnosis::CALIBRATING;
use mirror_model::effect::{Stage, built_in, find};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use virtual_mirror::{Effect, Family};

/// White noise of every displacement (nm): the sensor's of the paper, 10 nm, and as much of a bench's own.
const NOISE_NM: f64 = 20.0;
/// Mirrors with nothing hidden in the train split. The largest score of 20 is what one of 20 further ones exceeds: a false alarm
/// in 1 of 21, without a distribution being supposed.
const TRAIN_NOTHING: usize = 20;
const TRAIN_HIDDEN: usize = 10;
/// Mirrors with nothing hidden, and with two effects, of a seed in the test split.
const TEST_NOTHING: usize = 12;
const TEST_PAIRS: usize = 4;
/// The seeds of the two splits lie so far apart, and those of mirrors with nothing hidden from the others.
const APART: u64 = 100_000;
const NOTHING_APART: u64 = 500;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Split {
    Train,
    Test,
}

impl Split {
    fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Test => "test",
        }
    }
}

/// A session with the name that says nothing of it.
pub(crate) struct Exported {
    pub(crate) id: String,
    pub(crate) split: Split,
    pub(crate) case: Case,
}

/// Writes the data set of these seeds to a folder. Null ensembles are kept in `cache`.
///
/// # Errors
/// Where a file cannot be written, or a mirror is impossible.
pub(crate) fn export(
    folder: &Path,
    first_seed: u64,
    seeds: u64,
    cache: &Path,
) -> Result<(), Box<dyn Error>> {
    let exported = sessions(first_seed, seeds);
    write(folder, &exported)?;
    let shown: Vec<Option<bool>> = exported
        .par_iter()
        .map(|e| match (e.split, e.case.hidden) {
            (Split::Train, _) | (_, Hidden::Nothing) => Ok(None),
            (_, Hidden::One(effect, _)) if !effect.is_listed() => Ok(None),
            _ => can_show(&e.case, cache)
                .map(Some)
                .map_err(|error| error.to_string()),
        })
        .collect::<Result<_, String>>()?;
    write_answers(folder, &exported, &shown)
}

/// The sessions of both splits, each split in an order that tells nothing.
pub(crate) fn sessions(first_seed: u64, seeds: u64) -> Vec<Exported> {
    let mut rng = ChaCha8Rng::seed_from_u64(first_seed);
    let mut train = train(first_seed + APART);
    let mut test: Vec<Case> = (first_seed..first_seed + seeds).flat_map(test).collect();
    train.shuffle(&mut rng);
    test.shuffle(&mut rng);
    let named = |split: Split, cases: Vec<Case>| {
        cases.into_iter().enumerate().map(move |(index, case)| {
            let id = format!("{}-{:03}", split.name(), index + 1);
            Exported { id, split, case }
        })
    };
    named(Split::Train, train)
        .chain(named(Split::Test, test))
        .collect()
}

fn case(hidden: Hidden, family: Family, seed: u64) -> Case {
    Case {
        hidden,
        family,
        seed,
        design: None,
        noise_nm: NOISE_NM,
        instruments: Instruments::With,
    }
}

/// Mirrors of the calibrating families, with nothing hidden and with listed effects from all along the chain.
fn train(seed: u64) -> Vec<Case> {
    let family = |turn: usize| CALIBRATING[turn % CALIBRATING.len()];
    let nothing = (0..TRAIN_NOTHING).map(|turn| {
        let seed = seed + NOTHING_APART * (1 + turn as u64);
        case(Hidden::Nothing, family(turn), seed)
    });
    let listed: Vec<Effect> = listed().collect();
    let hidden = (0..TRAIN_HIDDEN).map(|turn| {
        let effect = listed[turn * listed.len() / TRAIN_HIDDEN];
        case(Hidden::One(effect, 1.0), family(turn), seed)
    });
    nothing.chain(hidden).collect()
}

/// Mirrors of the families left out: every effect at its usual strength, pairs, and nothing.
fn test(seed: u64) -> Vec<Case> {
    let family = |turn: usize| UNSEEN[(turn + seed as usize) % UNSEEN.len()];
    let nothing = (0..TEST_NOTHING).map(|turn| {
        let seed = seed + NOTHING_APART * (1 + turn as u64);
        case(Hidden::Nothing, family(turn), seed)
    });
    let single = Effect::ALL
        .iter()
        .enumerate()
        .map(|(turn, &effect)| case(Hidden::One(effect, 1.0), family(turn), seed));
    let pairs = pairs(seed);
    let every = pairs.len() / TEST_PAIRS;
    let both = pairs.into_iter().step_by(every).take(TEST_PAIRS);
    let both = both
        .enumerate()
        .map(|(turn, (one, other))| case(Hidden::Two(one, other), family(turn), seed));
    nothing.chain(single).chain(both).collect()
}

fn listed() -> impl Iterator<Item = Effect> {
    let all = Effect::ALL.iter().copied();
    all.filter(|effect| effect.is_listed())
}

/// All but the answers.
pub(crate) fn write(folder: &Path, exported: &[Exported]) -> Result<(), Box<dyn Error>> {
    let mut manifest = "id,split,noise_z_nm,channels,family\n".to_owned();
    for Exported { id, split, case } in exported {
        let place = folder.join("sessions").join(id);
        fs::create_dir_all(&place)?;
        for (name, file) in case.measured(&case.config())?.files {
            fs::write(place.join(name), file.to_string())?;
        }
        let family = match split {
            Split::Train => format!("{:?}", case.family),
            Split::Test => String::new(),
        };
        let split = split.name();
        writeln!(
            manifest,
            "{id},{split},{},z I1 I2 I3 I4,{family}",
            case.noise_nm
        )?;
    }
    let mut effects = "id,stage,title\n".to_owned();
    for effect in built_in() {
        let info = effect.info();
        writeln!(effects, "{},{},\"{}\"", info.id, info.stage, info.title)?;
    }
    fs::write(folder.join("manifest.csv"), manifest)?;
    fs::write(folder.join("effects.csv"), effects)?;
    fs::write(folder.join("README.md"), include_str!("data-set.md"))?;
    Ok(())
}

/// What is hidden in each split's sessions, and whether the session can show it.
pub(crate) fn write_answers(
    folder: &Path,
    exported: &[Exported],
    shown: &[Option<bool>],
) -> Result<(), Box<dyn Error>> {
    for split in [Split::Train, Split::Test] {
        let mut answers = "id,hidden,effects,strengths,stages,shown\n".to_owned();
        let rows = exported.iter().zip(shown);
        for (Exported { id, case, .. }, shown) in rows.filter(|(e, _)| e.split == split) {
            let hidden = case.hidden.effects();
            let joined = |word: fn(Effect) -> String| {
                let words = hidden.iter().map(|&effect| word(effect));
                words
                    .filter(|w| !w.is_empty())
                    .collect::<Vec<_>>()
                    .join(" ")
            };
            let shown = shown.map_or("", |is| if is { "yes" } else { "no" });
            writeln!(
                answers,
                "{id},{},{},{},{},{shown}",
                joined(|effect| effect.id().into()),
                joined(|effect| if effect.is_listed() {
                    effect.is_a().into()
                } else {
                    String::new()
                }),
                joined(|_| "1".into()),
                joined(|effect| stage(effect).to_string()),
            )?;
        }
        fs::write(
            folder.join(format!("answers-{}.csv", split.name())),
            answers,
        )?;
    }
    Ok(())
}

/// The stage of the chain that an effect belongs to; of those without a candidate, by what they change.
fn stage(effect: Effect) -> Stage {
    match effect {
        Effect::HeaterAging => Stage::Resistance,
        Effect::Stiction => Stage::Memory,
        Effect::SensorAbbe => Stage::Sensor,
        Effect::LooseContact => Stage::Drive,
        listed => find(listed.is_a()).expect("a candidate").info().stage,
    }
}
