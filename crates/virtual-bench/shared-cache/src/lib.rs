//! Null ensembles that several programs of tests need are drawn once where `MIRROR_TEST_CACHE` names a folder, as `cargo xtask
//! test` does, which empties it first. By themselves tests draw their own: what a run before left there may be of another
//! program.
//!
//! Tests of the cache, and what measures times with cold caches, name a folder of their own.

use std::path::PathBuf;

/// The variable that names the folder.
pub const VARIABLE: &str = "MIRROR_TEST_CACHE";

/// The folder in which the tool finds them, as its `XDG_CACHE_HOME`.
pub fn of_the_tool() -> Option<PathBuf> {
    std::env::var_os(VARIABLE).map(PathBuf::from)
}

/// The folder in which they lie: that of the tool, below its own name.
pub fn null_ensembles() -> Option<PathBuf> {
    of_the_tool().map(|folder| folder.join("mirror-diagnosis"))
}
