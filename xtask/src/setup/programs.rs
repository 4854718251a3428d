//! The shells whose completion is tried, from the system's packages where they are missing.

use anyhow::{Context, Result, bail};

use super::package;
use crate::cargo::answers;

/// Debian, Fedora and Arch call the packages so, too; bash runs the system's own scripts.
const SHELLS: [&str; 2] = ["zsh", "fish"];

/// Makes sure that they are there.
pub(crate) fn shells() -> Result<()> {
    for shell in SHELLS
        .into_iter()
        .filter(|shell| !answers(shell, "--version"))
    {
        eprintln!("The shell {shell} is missing; installing it from the system's packages.");
        let by_hand = format!("install the package `{shell}` yourself");
        if let Some(reason) = package::install(shell).with_context(|| by_hand.clone())? {
            bail!("{shell} is not installed:\n  {reason}\n{by_hand}");
        }
    }
    Ok(())
}
