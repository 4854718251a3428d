//! A board, wherever it is: found, opened, greeted, asked.

mod answer;
mod calibrations;
mod claim;
mod fault_log;
mod find;
pub mod framing;
mod link;
mod owner;
mod samples;
mod socket;
mod stop;
mod stop_mark;
mod time;

pub(crate) use find::none_found;
pub use find::{Found, Place, choose, find};
pub use link::{Board, RENEWED_LEASE, Seen};
pub use owner::{Owner, owner};
pub use samples::Samples;
pub use stop::stop;
pub use stop_mark::announce_stop;
