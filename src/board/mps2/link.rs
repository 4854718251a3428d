//! The host link: UART0, which QEMU connects to a socket, with frames delimited by COBS.

#![expect(unsafe_code, reason = "the UART's registers")]

use core::convert::Infallible;

use embassy_futures::yield_now;
use embassy_sync::blocking_mutex::raw::ThreadModeRawMutex;
use embedded_io_async::{ErrorType, Read, Write};
use mirror_protocol::MAX_FRAME_BYTES;
use postcard_rpc::server::impls::embedded_io_async_v0_6::{EioWireRx, EioWireTx, WireStorage};

/// Sends frames to the host.
pub type LinkTx = EioWireTx<ThreadModeRawMutex, Uart>;
/// Receives frames from the host.
pub type LinkRx = EioWireRx<Uart>;

/// COBS adds a byte in 254, and the delimiter.
const FRAMED_BYTES: usize = MAX_FRAME_BYTES + MAX_FRAME_BYTES / 254 + 2;

type Storage = WireStorage<Uart, Uart, ThreadModeRawMutex, FRAMED_BYTES, FRAMED_BYTES>;

/// Opens the link; `None` the second time.
pub fn open() -> Option<(LinkRx, LinkTx)> {
    static STORAGE: Storage = Storage::new();
    Uart::enable();
    STORAGE.init(Uart, Uart)
}

/// CMSDK APB UART (ARM DDI 0479, section 4.3).
pub struct Uart;

const UART0: usize = 0x4000_4000;
const DATA: usize = UART0;
const STATE: usize = UART0 + 0x04;
const CTRL: usize = UART0 + 0x08;
const BAUDDIV: usize = UART0 + 0x10;

const STATE_TX_FULL: u32 = 1 << 0;
const STATE_RX_FULL: u32 = 1 << 1;
const CTRL_TX_RX_ENABLE: u32 = 0b11;
/// The smallest divider that the UART accepts; QEMU does not pace bytes by it.
const FASTEST: u32 = 16;

impl Uart {
    fn enable() {
        write(BAUDDIV, FASTEST);
        write(CTRL, CTRL_TX_RX_ENABLE);
    }

    fn try_read(&mut self) -> Option<u8> {
        (read(STATE) & STATE_RX_FULL != 0).then(|| read(DATA) as u8)
    }

    fn try_write(&mut self, byte: u8) -> bool {
        let has_room = read(STATE) & STATE_TX_FULL == 0;
        if has_room {
            write(DATA, byte.into());
        }
        has_room
    }
}

impl ErrorType for Uart {
    type Error = Infallible;
}

impl Read for Uart {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let Some((first, rest)) = buffer.split_first_mut() else {
            return Ok(0);
        };
        loop {
            // The control loop runs in between, so this polls once a tick.
            yield_now().await;
            if let Some(byte) = self.try_read() {
                *first = byte;
                break;
            }
        }
        let more = rest
            .iter_mut()
            .map_while(|slot| self.try_read().map(|byte| *slot = byte));
        Ok(1 + more.count())
    }
}

impl Write for Uart {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        for byte in bytes {
            while !self.try_write(*byte) {
                yield_now().await;
            }
        }
        Ok(bytes.len())
    }
}

fn read(register: usize) -> u32 {
    // SAFETY: a register of UART0, aligned, owned by this module.
    unsafe { (register as *const u32).read_volatile() }
}

fn write(register: usize, value: u32) {
    // SAFETY: a register of UART0, aligned, owned by this module.
    unsafe { (register as *mut u32).write_volatile(value) }
}
