//! Physics that can be switched on, each with a strength: 0 is off, 1 a size that happens.
//!
//! One file a group. Where physics knows more than one functional form, the one here is not the textbook's usual
//! candidate, so that a diagnosis is tested on more than its own formula.
//!
//! A number with no other source beside it is a choice, not a measurement: it gives an effect of strength 1 a size that a
//! bench session shows and that happens. `tests/effects.rs` holds every one of these sizes, on mirrors of all families,
//! above what the instruments resolve (0.05 um, or 2 uA) and below what no session would miss (120 um).

mod catalogue;
pub(crate) mod electrostatic;
pub(crate) mod heat;
pub(crate) mod memory;
pub(crate) mod reading;
pub(crate) mod resistance;
pub(crate) mod structure;

pub use catalogue::{Effect, Effects, UnknownEffect};
