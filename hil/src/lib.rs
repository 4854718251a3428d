//! The bench that the acceptance checks run on: a board, and the tool in front of it.
//!
//! `MIRROR_BOARD` names a real board, or an emulated one that runs already; without it every check
//! gets an emulated board of its own. `cargo xtask hil` and `cargo xtask test` set it all up.

mod bench;
mod disturb;
mod raw;

pub use bench::{Bench, Said};
pub use disturb::{DISTURBANCES, Disturbance};
pub use raw::RawLink;
