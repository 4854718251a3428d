//! The effects that can be switched on.

use mirror_model::effect::{Effect, Info, built_in, forms};
use serde::Serialize;
use std::sync::Arc;

/// An effect in one of its forms.
#[derive(Clone, Serialize)]
pub struct Entry {
    /// Which one.
    #[serde(skip)]
    pub effect: Arc<dyn Effect>,
    /// Its form; empty where there is one.
    pub form: String,
    /// What it is, with its parameters.
    #[serde(flatten)]
    pub info: Info,
}

/// The built-in effects in the order of the chain, each in all of its forms, and `own` behind them.
pub fn catalogue(own: &[Arc<dyn Effect>]) -> Vec<Entry> {
    let all = built_in().into_iter().chain(own.iter().cloned());
    all.flat_map(|effect| forms(&effect))
        .map(|effect| Entry {
            form: effect.form().to_owned(),
            info: effect.info().clone(),
            effect,
        })
        .collect()
}
