//! What an argument may be.

use std::ffi::OsStr;

use clap_complete::engine::{
    ArgValueCandidates, ArgValueCompleter, CompletionCandidate, PathCompleter, ValueCompleter,
};
use control_core::Limit;
use mirror_model::Preset;
use mirror_model::effect::built_in;
use protection::Fault;

use crate::board::find;
use crate::terms::terms;

/// Boards that are there.
pub(crate) fn boards() -> ArgValueCandidates {
    ArgValueCandidates::new(|| candidates(find().into_iter().map(|board| board.name)))
}

/// What can be explained.
pub(crate) fn explained() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let (faults, limits) = (Fault::ALL.map(Fault::name), Limit::ALL.map(Limit::name));
        let names = faults.into_iter().chain(limits).chain(terms());
        candidates(names.map(str::to_owned).chain(effect_ids()))
    })
}

/// Effects, and files of one's own.
pub(crate) fn effects() -> ArgValueCompleter {
    ArgValueCompleter::new(move |typed: &OsStr| named_or_file(effect_ids().collect(), typed))
}

fn effect_ids() -> impl Iterator<Item = String> {
    let effects = built_in().into_iter();
    effects.map(|effect| effect.info().id.to_string())
}

/// Presets, and model files.
pub(crate) fn models() -> ArgValueCompleter {
    let names = || Preset::ALL.map(|preset| preset.name().to_owned()).into();
    ArgValueCompleter::new(move |typed: &OsStr| named_or_file(names(), typed))
}

fn candidates<T: Into<String>>(names: impl Iterator<Item = T>) -> Vec<CompletionCandidate> {
    names
        .map(|name| CompletionCandidate::new(name.into()))
        .collect()
}

/// Those of `names` that begin as is `typed`, and TOML files.
fn named_or_file(names: Vec<String>, typed: &OsStr) -> Vec<CompletionCandidate> {
    let typed_text = typed.to_string_lossy();
    let meant = names
        .into_iter()
        .filter(|name| name.starts_with(&*typed_text));
    let mut candidates = candidates(meant);
    let is_toml = |path: &std::path::Path| path.extension().is_some_and(|ending| ending == "toml");
    candidates.extend(PathCompleter::file().filter(is_toml).complete(typed));
    candidates
}
