//! Programs that are called as their packages are, by Debian, Fedora and Arch: from the system's packages where they are missing.

use anyhow::{Context, Result, bail};

use super::package;
use crate::cargo::answers;

/// The shells whose completion is tried; bash runs the system's own scripts.
pub(crate) const SHELLS: [&str; 2] = ["zsh", "fish"];

/// Makes sure that they are there.
pub(crate) fn programs(names: &[&str]) -> Result<()> {
    for name in names.iter().filter(|name| !answers(name, "--version")) {
        eprintln!("{name} is missing; installing it from the system's packages.");
        let by_hand = format!("install the package `{name}` yourself");
        if let Some(reason) = package::install(name).with_context(|| by_hand.clone())? {
            bail!("{name} is not installed:\n  {reason}\n{by_hand}");
        }
    }
    Ok(())
}
