//! A board, wherever it is: found, opened, greeted, asked.

mod calibrations;
mod find;
pub mod framing;
mod link;
mod samples;
mod socket;

pub(crate) use find::none_found;
pub use find::{Found, Place, choose, find};
pub use link::{Board, RENEWED_LEASE};
pub use samples::Samples;
