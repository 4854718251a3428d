//! What the control loop and the link leave for each other.
//!
//! The two run independently, on some boards at different priorities. Each holds its own side of the
//! mailbox: the link's ([`LinkSide`]) puts orders there for the next tick, the control loop's
//! ([`ControlSide`]) takes them and leaves what the tick did.

mod control_side;
mod link_side;
mod slots;

use static_cell::ConstStaticCell;

pub use control_side::ControlSide;
pub use link_side::{Failure, LinkSide};
pub use slots::{Mailbox, Order, QUEUED_SAMPLES, Trip};

/// Both sides of the image's mailbox, once.
///
/// # Panics
/// The second time.
pub fn take() -> (LinkSide, ControlSide) {
    static MAILBOX: ConstStaticCell<Mailbox> = ConstStaticCell::new(Mailbox::new());
    MAILBOX.take().sides()
}

impl Mailbox {
    /// Its two sides. There is one control loop, so its side cannot be copied.
    pub fn sides(&'static mut self) -> (LinkSide, ControlSide) {
        (LinkSide(self), ControlSide(self))
    }
}
