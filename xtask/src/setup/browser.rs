//! The browser that pages are tried in: the one that is named, one that is there, or the system's Chromium.

use std::env;
use std::ffi::OsString;

use anyhow::{Context, Result, bail};

use super::package;
use crate::cargo::answers;

/// Names a browser, for this and for the tests.
pub(crate) const BROWSER: &str = "MIRROR_BROWSER";
/// What Chromium is called, by those who package it, and its package.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];
const BY_HAND: &str = "install Chromium yourself (Debian, Fedora and Arch: the package `chromium`), or name one by MIRROR_BROWSER";

/// A Chromium, installed where none is there.
pub(crate) fn browser() -> Result<OsString> {
    if let Some(browser) = env::var_os(BROWSER).or_else(present) {
        return Ok(browser);
    }
    eprintln!("A browser (Chromium) is missing; installing it from the system's packages.");
    if let Some(reason) = package::install(NAMES[0]).context(BY_HAND)? {
        bail!("Chromium is not installed:\n  {reason}\n{BY_HAND}");
    }
    present().with_context(|| format!("Chromium is still not there; {BY_HAND}"))
}

fn present() -> Option<OsString> {
    let found = NAMES.iter().find(|name| answers(name, "--version"));
    found.map(OsString::from)
}
