//! What is hidden, in which mirror, and what is measured of it.

use crate::arguments::{Arguments, Instruments};
use crate::design::Design;
use diagnosis::CALIBRATING;
use experiments::Experiment;
use identification::Dataset;
use measurement::Session;
use mirror_model::{Model, Preset};
use std::fmt;
use virtual_mirror::{ConfigError, Effect, Family, MirrorConfig};
use virtual_sessions::measure;

/// No discrepancy and no threshold was calibrated on these.
pub(crate) const UNSEEN: [Family; 2] = [Family::F, Family::G];
/// Far enough for no two mirrors with nothing hidden to have the same seed.
const APART: u64 = 500;

/// What is hidden.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Hidden {
    Nothing,
    One(Effect, f64),
    /// Both at strength 1.
    Two(Effect, Effect),
}

/// One session.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Case {
    pub(crate) hidden: Hidden,
    pub(crate) family: Family,
    pub(crate) seed: u64,
    /// The seed of the design that the mirror is made to, if it is to any; the diagnosis is told it.
    pub(crate) design: Option<u64>,
    pub(crate) noise_nm: f64,
    pub(crate) instruments: Instruments,
}

/// The sessions asked for.
pub(crate) fn all(arguments: &Arguments) -> Vec<Case> {
    let families: &[Family] = if arguments.learn.is_some() {
        &CALIBRATING
    } else {
        &UNSEEN
    };
    let mut cases = Vec::new();
    for seed in (0..arguments.seeds).map(|seed| arguments.first_seed + seed) {
        let design = seed;
        for &noise_nm in &arguments.noises {
            for instruments in Instruments::tried(arguments.instruments) {
                let mut push = |hidden, turn: usize, seed| {
                    cases.push(Case {
                        hidden,
                        family: families[(turn + seed as usize) % families.len()],
                        seed,
                        design: arguments.described.then_some(design),
                        noise_nm,
                        instruments,
                    })
                };
                for turn in 0..arguments.nothing * families.len() {
                    push(Hidden::Nothing, turn, seed + APART * (1 + turn as u64));
                }
                for &strength in &arguments.strengths {
                    for (turn, &effect) in Effect::ALL.iter().enumerate() {
                        push(Hidden::One(effect, strength), turn, seed);
                    }
                }
                if instruments == Instruments::With {
                    for (turn, (one, other)) in pairs(seed).into_iter().enumerate() {
                        push(Hidden::Two(one, other), turn, seed);
                    }
                }
            }
        }
    }
    cases.retain(|case| {
        let is_learned = matches!(case.hidden, Hidden::One(effect, _) if effect.is_listed());
        let only = arguments.only.as_ref();
        (arguments.learn.is_none() || is_learned)
            && only.is_none_or(|only| case.hidden.is_called(only))
    });
    cases
}

/// Every listed effect once, with a partner from the other half of the list; other partners for another seed.
pub(crate) fn pairs(seed: u64) -> Vec<(Effect, Effect)> {
    let listed: Vec<_> = Effect::ALL
        .iter()
        .copied()
        .filter(|effect| effect.is_listed())
        .collect();
    let (heat, motion) = listed.split_at(listed.len() / 2);
    heat.iter()
        .enumerate()
        .map(|(index, &one)| (one, motion[(index + seed as usize) % motion.len()]))
        .collect()
}

impl Hidden {
    /// What is hidden, one by one.
    pub(crate) fn effects(self) -> Vec<Effect> {
        match self {
            Self::Nothing => vec![],
            Self::One(effect, _) => vec![effect],
            Self::Two(one, other) => vec![one, other],
        }
    }

    fn is_called(self, name: &str) -> bool {
        match self {
            Self::Nothing => name == "nothing",
            Self::One(effect, _) => name == effect.id(),
            Self::Two(..) => name == "two",
        }
    }
}

impl Case {
    /// Whether another case has the same drives, noise and description, and so the same null ensemble.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let kind = |case: &Self| {
            let design = case.design.map(|seed| (case.family, seed));
            (case.instruments, case.noise_nm, design)
        };
        kind(self) == kind(other)
    }

    fn design(&self) -> Option<Design> {
        Some(Design::of(self.family, self.design?))
    }

    /// The model that is diagnosed: the paper's, with what is known of the mirror.
    pub(crate) fn model(&self) -> Model {
        Model {
            device: self
                .design()
                .map(|design| design.told())
                .unwrap_or_default(),
            ..Model::from(Preset::Paper)
        }
    }

    /// The mirror, with what is hidden in it.
    pub(crate) fn config(&self) -> MirrorConfig {
        let mut config = self.lacking_nothing();
        match self.hidden {
            Hidden::Nothing => {}
            Hidden::One(effect, strength) => config.effects.set(effect, strength),
            Hidden::Two(one, other) => {
                config.effects.set(one, 1.0);
                config.effects.set(other, 1.0);
            }
        }
        config
    }

    /// The same mirror with this hidden alone, at strength 1.
    pub(crate) fn hiding(&self, effect: Effect) -> Self {
        Self {
            hidden: Hidden::One(effect, 1.0),
            ..*self
        }
    }

    /// The same mirror with nothing hidden.
    pub(crate) fn lacking_nothing(&self) -> MirrorConfig {
        let mut config = match self.design() {
            Some(design) => design.made(self.seed),
            None => MirrorConfig::draw(self.family, self.seed),
        };
        config.sensor.position_noise_nm = self.noise_nm;
        config
    }

    /// What is measured of a mirror, as a fit takes it.
    pub(crate) fn session(&self, config: &MirrorConfig) -> Result<Dataset, ConfigError> {
        Ok(Dataset::new(&self.measured(config)?))
    }

    /// What is measured of a mirror.
    pub(crate) fn measured(&self, config: &MirrorConfig) -> Result<Session, ConfigError> {
        let instruments = match self.instruments {
            Instruments::Without => virtual_sessions::Instruments::Position,
            Instruments::SweepOfCurrents => virtual_sessions::Instruments::Currents,
            _ => virtual_sessions::Instruments::PositionAndCurrents,
        };
        let drives = match self.instruments {
            Instruments::WithOvenAndStage => experiments::with_oven_and_reference(3.5),
            Instruments::Sweep | Instruments::SweepOfCurrents => {
                vec![Experiment::sweep(3.5, 35, 1.0, 1)]
            }
            _ => experiments::session(3.5),
        };
        measure(config, &drives, instruments)
    }
}

impl fmt::Display for Hidden {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nothing => f.write_str("nothing"),
            Self::One(effect, strength) => write!(f, "{effect} {strength}"),
            Self::Two(one, other) => write!(f, "{one} and {other}"),
        }
    }
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hidden = self.hidden.to_string();
        let Self {
            family,
            seed,
            noise_nm,
            ..
        } = self;
        let instruments = match self.instruments {
            Instruments::With => "",
            Instruments::Without => ", z only",
            Instruments::WithOvenAndStage => ", oven and stage",
            Instruments::Sweep => ", a sweep only",
            Instruments::SweepOfCurrents => ", V and I of a sweep only",
        };
        write!(
            f,
            "{hidden:<32} {family:?} {seed} {noise_nm:>2} nm{instruments}"
        )
    }
}
