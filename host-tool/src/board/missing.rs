//! A system without the sockets and FIFOs of emulated boards, on which a request to a device takes one of its interfaces, so that
//! nobody stops a board that another has, or looks at it.

use std::convert::Infallible;
use std::io;
use std::path::Path;

use postcard_rpc::host_client::{WireRx, WireTx};

use super::find::Found;
use super::view::View;

/// A link that nobody has.
pub(super) struct NoLink(Infallible);

/// There is none.
pub(super) async fn connect(_: &Path) -> io::Result<(NoLink, NoLink)> {
    Err(io::Error::other("emulated boards run on Linux"))
}

/// Nobody answers in a board's place: who has it is told, and no more.
#[derive(Debug)]
pub(super) enum StandIn {}

impl StandIn {
    /// There is none.
    pub(super) fn begin(_: &Found, _: &View) -> Option<Self> {
        None
    }
}

/// There is none.
pub(super) async fn by_fifo(_: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// There is no such way.
pub(super) async fn by_usb(_: &str) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

impl WireTx for NoLink {
    type Error = io::Error;

    async fn send(&mut self, _: Vec<u8>) -> io::Result<()> {
        match self.0 {}
    }
}

impl WireRx for NoLink {
    type Error = io::Error;

    async fn receive(&mut self) -> io::Result<Vec<u8>> {
        match self.0 {}
    }
}
