//! A board, wherever it is: found, opened, greeted, asked.

mod answer;
mod calibrations;
mod claim;
mod fault_log;
#[cfg(unix)]
mod fifo;
mod find;
pub mod framing;
mod link;
mod look;
#[cfg(not(unix))]
mod missing;
mod owner;
mod range;
mod reconnect;
#[cfg(unix)]
mod request;
mod samples;
#[cfg(unix)]
mod socket;
#[cfg(unix)]
mod stand_in;
mod stop;
mod stop_mark;
#[cfg(test)]
pub(crate) mod tests;
mod time;
mod view;

#[cfg(not(unix))]
use missing::{self as fifo, self as request, self as socket, self as stand_in};

pub(crate) use find::none_found;
pub use find::{Found, Place, choose, find};
pub use link::{Board, RENEWED_LEASE_MS};
pub use look::Seen;
pub use owner::{Owner, owner};
pub(crate) use range::{
    check_drives, check_piston, check_position, hardly_beyond, level_um, lowest_um,
};
pub(crate) use reconnect::Reconnecting;
pub use samples::Samples;
pub use stop::stop;
pub use stop_mark::announce_stop;
pub use view::View;
