//! Tests try what takes minutes where `MIRROR_FULL=1`, as `cargo xtask test --full` sets it, and else a share of it.

/// The variable that asks for it.
pub const VARIABLE: &str = "MIRROR_FULL";

/// Whether long runs are asked for.
pub fn are_asked_for() -> bool {
    std::env::var_os(VARIABLE).is_some_and(|value| value == "1")
}
