//! What keeps the mirror whole, whatever the host does and whatever breaks.
//!
//! [`Protection::tick`] stands between what is wanted and the control core, once a control tick: it
//! watches what was sensed, trips to zero drive in the same tick in which it finds a fault, checks
//! the heaters before it lets anything drive them, and ramps all channels to zero when the lease of
//! the last command ends without renewal.
//!
//! A fault ([`Fault`]) trips the board and stays until somebody clears it. A limit
//! ([`control_core::Limit`]) only says why an output is not what was asked; the mirror stays under
//! control.
//!
//! Like the control core it knows no hardware, no executor and no clock but the count of its ticks.
#![no_std]

#[cfg(test)]
extern crate std;

mod board;
mod channel;
mod fault;
mod mean;
mod protection;
mod punctuality;
mod reading;
mod told;

pub use fault::Fault;
pub use protection::{ChannelState, Denied, Lease, Protection};
pub use punctuality::Punctuality;
pub use reading::Reading;
