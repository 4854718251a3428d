//! How much of the board's time a calibration takes.

use crate::quantity::Span;

/// How much is moved to refine a calibration, and to try it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// Positions that the mirror jumps to while it is refined.
    pub(super) jumps: usize,
    /// Time at 0 V before these.
    pub(super) jumps_after_s: f64,
    /// Positions at rest that are tried, and how long each is held before it is read.
    pub(super) rests: usize,
    pub(super) rest: Span,
    /// How long the step that is tried is held; what is still missing then is creep.
    pub(super) hold: Span,
    /// Before each part of a trial the mirror cools so long.
    pub(super) cooling_s: f64,
}

impl Effort {
    pub(super) const USUAL: Self = Self {
        jumps: usize::MAX,
        jumps_after_s: 30.0,
        rests: 17,
        rest: Span { s: 2.0 },
        hold: Span { s: 3.0 },
        cooling_s: 5.0,
    };
    pub(super) const QUICK: Self = Self {
        jumps: 31,
        jumps_after_s: 15.0,
        rests: 8,
        rest: Span { s: 1.0 },
        hold: Span { s: 1.0 },
        cooling_s: 1.0,
    };
}
