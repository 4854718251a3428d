//! The host link: UART0, which QEMU connects to a socket, with frames delimited by COBS.

use core::convert::Infallible;

use embassy_futures::yield_now;
use embassy_sync::blocking_mutex::raw::ThreadModeRawMutex;
use embedded_io_async::{ErrorType, Read, Write};
use mirror_protocol::MAX_FRAME_BYTES;
use postcard_rpc::server::impls::embedded_io_async_v0_6::{EioWireRx, EioWireTx, WireStorage};

use super::uart::{UART0, Uart};

/// Sends frames to the host.
pub type LinkTx = EioWireTx<ThreadModeRawMutex, Link>;
/// Receives frames from the host.
pub type LinkRx = EioWireRx<Link>;

/// COBS adds a byte in 254, and the delimiter.
const FRAMED_BYTES: usize = MAX_FRAME_BYTES + MAX_FRAME_BYTES / 254 + 2;

type Storage = WireStorage<Link, Link, ThreadModeRawMutex, FRAMED_BYTES, FRAMED_BYTES>;

/// Opens the link; `None` the second time.
pub fn open() -> Option<(LinkRx, LinkTx)> {
    static STORAGE: Storage = Storage::new();
    let link = || Link(Uart::enable(UART0));
    STORAGE.init(link(), link())
}

/// The link's UART.
pub struct Link(Uart);

impl ErrorType for Link {
    type Error = Infallible;
}

impl Read for Link {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let Some((first, rest)) = buffer.split_first_mut() else {
            return Ok(0);
        };
        loop {
            // The control loop runs in between, so this polls once a tick.
            yield_now().await;
            if let Some(byte) = self.0.try_read() {
                *first = byte;
                break;
            }
        }
        let more = rest
            .iter_mut()
            .map_while(|slot| self.0.try_read().map(|byte| *slot = byte));
        Ok(1 + more.count())
    }
}

impl Write for Link {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        for byte in bytes {
            while !self.0.try_write(*byte) {
                yield_now().await;
            }
        }
        Ok(bytes.len())
    }
}
