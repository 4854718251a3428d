//! How a start came about.

use mirror_protocol::{ResetCause, Sentence};
use protection::Fault;

use crate::resets::Resets;
use crate::retained::Keep;

/// Why the firmware stopped before this start.
pub struct LastStop {
    /// Which kind of stop.
    pub fault: Fault,
    /// Where, or what it said.
    pub text: Sentence,
}

/// How a start came about.
pub struct Origin {
    /// What reset the processor.
    pub cause: ResetCause,
    /// Why the firmware had stopped, if it had.
    pub last_stop: Option<LastStop>,
    /// The starts before it.
    pub resets: &'static Resets,
    /// Keeps the controller's states across a reset.
    pub retained: &'static Keep,
}
