//! What the options are about, in every command's help.

/// What is driven, when, and for how long.
pub(crate) const SIGNAL: &str = "Signal";
/// What is read instead of measuring, or besides.
pub(crate) const INPUT: &str = "Input";
/// What is written, and where.
pub(crate) const OUTPUT: &str = "Output";
/// Which board, and what measures beside it.
pub(crate) const BOARD: &str = "Board";
