//! What was learned from virtual mirrors with one effect hidden: which effect is taken for which, and how far a size may be
//! off because nature's form is not the candidate's.
//!
//! The table comes from mirrors of the calibrating families: `cargo xtask learn-confusions` makes it anew.

use identification::dataset::Dataset;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

/// A candidate whose score is this share of the best one's is a rival, whatever the table says: forms that differ by so much
/// are no evidence. Set by the wrong names that `cargo xtask bench diagnose` counts.
pub(crate) const RIVAL_SHARE: f64 = 0.92;
/// An effect's size, in the candidate's terms, is known no better than to this share (one standard deviation). Set by the
/// intervals that `cargo xtask bench diagnose` counts.
const FORM: f64 = 0.1;

/// Which channels a session has: what can be told from what depends on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Channels {
    /// Displacement and currents.
    Both,
    /// Displacement only.
    Displacement,
    /// Currents only.
    Currents,
}

impl Channels {
    /// Those of a session.
    pub fn of(data: &Dataset) -> Self {
        match (data.has_displacement(), data.has_current()) {
            (true, true) => Self::Both,
            (true, false) => Self::Displacement,
            _ => Self::Currents,
        }
    }
}

/// An effect that scored less than another one which was not there.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Taken {
    /// What was measured.
    pub channels: Channels,
    /// The effect that was hidden.
    pub hidden: String,
    /// The one that it was taken for.
    pub best: String,
    /// The least share of the best score that the hidden one had.
    pub share: f64,
}

/// How far the size of an effect is off.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SizeError {
    /// What was measured.
    pub channels: Channels,
    /// The effect.
    pub effect: String,
    /// Standard deviation of its size over the true one.
    pub share: f64,
}

/// The table.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Confusions {
    /// What was taken for what.
    pub taken: Vec<Taken>,
    /// How far sizes were off.
    pub form: Vec<SizeError>,
}

/// The table that ships.
pub fn confusions() -> &'static Confusions {
    static TABLE: LazyLock<Confusions> = LazyLock::new(|| {
        toml::from_str(include_str!("confusions.toml")).expect("the table that ships is tested")
    });
    &TABLE
}

impl Confusions {
    /// The share of the best score from which on a candidate is a rival of the best one.
    pub(crate) fn rival_share(&self, channels: Channels, candidate: &str, best: &str) -> f64 {
        let taken = self.taken.iter().filter(|taken| {
            taken.channels == channels && taken.hidden == candidate && taken.best == best
        });
        taken.map(|taken| taken.share).fold(RIVAL_SHARE, f64::min)
    }

    /// Whether one effect was taken for another.
    pub(crate) fn is_taken(&self, channels: Channels, hidden: &str, best: &str) -> bool {
        let mut taken = self.taken.iter();
        taken.any(|t| t.channels == channels && t.hidden == hidden && t.best == best)
    }

    /// The share of an effect's size that its form may be off by, one standard deviation.
    pub(crate) fn form(&self, channels: Channels, effect: &str) -> f64 {
        let mut forms = self.form.iter();
        let known = forms.find(|form| form.channels == channels && form.effect == effect);
        known.map_or(FORM, |form| form.share.max(FORM))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_model::effect::find;

    #[test]
    fn the_table_that_ships_is_of_effects_that_exist() {
        let table = confusions();
        assert!(!table.taken.is_empty());
        for taken in &table.taken {
            assert!(find(&taken.hidden).is_some() && find(&taken.best).is_some());
            assert!(taken.share > 0.0 && taken.share < 1.0, "{taken:?}");
        }
        for form in &table.form {
            assert!(find(&form.effect).is_some() && form.share > 0.0, "{form:?}");
        }
    }

    #[test]
    fn what_was_taken_for_another_is_its_rival_from_further_off() {
        let table = Confusions {
            taken: vec![Taken {
                channels: Channels::Both,
                hidden: "creep".into(),
                best: "hysteresis".into(),
                share: 0.7,
            }],
            form: vec![],
        };
        let share = |channels, candidate, best| table.rival_share(channels, candidate, best);
        assert_eq!(share(Channels::Both, "creep", "hysteresis"), 0.7);
        assert_eq!(share(Channels::Both, "hysteresis", "creep"), RIVAL_SHARE);
        assert_eq!(
            share(Channels::Displacement, "creep", "hysteresis"),
            RIVAL_SHARE
        );
        assert!(table.is_taken(Channels::Both, "creep", "hysteresis"));
        assert!(!table.is_taken(Channels::Both, "hysteresis", "creep"));
        assert!(!table.is_taken(Channels::Displacement, "creep", "hysteresis"));
    }

    #[test]
    fn a_size_is_known_as_well_as_the_table_says_and_no_better_than_to_a_tenth() {
        let form = |effect: &str, share| SizeError {
            channels: Channels::Both,
            effect: effect.into(),
            share,
        };
        let table = Confusions {
            taken: vec![],
            form: vec![form("creep", 0.25), form("hysteresis", 0.03)],
        };
        assert_eq!(table.form(Channels::Both, "creep"), 0.25);
        assert_eq!(table.form(Channels::Both, "hysteresis"), FORM);
        assert_eq!(table.form(Channels::Currents, "creep"), FORM);
    }
}
