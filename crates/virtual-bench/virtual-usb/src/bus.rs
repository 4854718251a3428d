//! What is on the wire, and in the controller's buffers.

use std::collections::VecDeque;
use std::future::poll_fn;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Poll;

use embassy_usb_driver::Event;

/// Largest packet of any endpoint at full speed.
pub const MAX_PACKET_BYTES: usize = 64;

/// A packet, at most [`MAX_PACKET_BYTES`].
pub(crate) type Packet = Vec<u8>;

/// The wire between device and host.
#[derive(Clone, Debug, Default)]
pub(crate) struct Wire(Arc<Mutex<Bus>>);

/// Its state.
#[derive(Debug, Default)]
pub(crate) struct Bus {
    /// What the device has not been told yet.
    pub(crate) events: VecDeque<Event>,
    pub(crate) address: u8,
    pub(crate) is_suspended: bool,
    pub(crate) control: Control,
    pub(crate) outs: [Endpoint; 8],
    pub(crate) ins: [Endpoint; 8],
}

/// The control endpoint.
#[derive(Debug, Default)]
pub(crate) struct Control {
    /// A setup packet that the device has not fetched.
    pub(crate) setup: Option<[u8; 8]>,
    /// Counts setup packets: a device that is still at an earlier one has lost its turn.
    pub(crate) transfer: u64,
    pub(crate) data_out: VecDeque<Packet>,
    pub(crate) data_in: VecDeque<Packet>,
    pub(crate) status: Option<Status>,
}

/// How the device ended a control transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Status {
    Accepted,
    Stalled,
}

/// A bulk endpoint: its buffer of one packet.
#[derive(Clone, Debug, Default)]
pub(crate) struct Endpoint {
    pub(crate) is_allocated: bool,
    pub(crate) is_enabled: bool,
    pub(crate) is_stalled: bool,
    pub(crate) packet: Option<Packet>,
}

impl Wire {
    pub(crate) fn lock(&self) -> MutexGuard<'_, Bus> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until `look` finds what it looks for.
    pub(crate) async fn until<T>(&self, mut look: impl FnMut(&mut Bus) -> Option<T>) -> T {
        poll_fn(|context| match look(&mut self.lock()) {
            Some(found) => Poll::Ready(found),
            None => {
                context.waker().wake_by_ref();
                Poll::Pending
            }
        })
        .await
    }
}

impl Bus {
    /// What a reset does to the controller.
    pub(crate) fn reset(&mut self) {
        self.address = 0;
        self.is_suspended = false;
        self.control = Control {
            transfer: self.control.transfer + 1,
            ..Control::default()
        };
        for endpoint in self.outs.iter_mut().chain(&mut self.ins) {
            endpoint.is_enabled = false;
            endpoint.is_stalled = false;
            endpoint.packet = None;
        }
    }
}
