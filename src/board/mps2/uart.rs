//! The CMSDK APB UART (ARM DDI 0479, section 4.3), a byte at a time.

#![expect(unsafe_code, reason = "the UART's registers")]

/// The host link (ARM DAI 0386, memory map).
pub(super) const UART0: usize = 0x4000_4000;
/// The stop.
pub(super) const UART1: usize = 0x4000_5000;

const DATA: usize = 0x00;
const STATE: usize = 0x04;
const CTRL: usize = 0x08;
const BAUDDIV: usize = 0x10;

const STATE_TX_FULL: u32 = 1 << 0;
const STATE_RX_FULL: u32 = 1 << 1;
const CTRL_TX_RX_ENABLE: u32 = 0b11;
/// The smallest divider that the UART accepts; QEMU does not pace bytes by it.
const FASTEST: u32 = 16;

/// One of the UARTs.
pub(super) struct Uart(usize);

impl Uart {
    /// Enables the UART at `base`, to receive and to send.
    pub(super) fn enable(base: usize) -> Self {
        let uart = Self(base);
        uart.write(BAUDDIV, FASTEST);
        uart.write(CTRL, CTRL_TX_RX_ENABLE);
        uart
    }

    /// A byte that has come.
    pub(super) fn try_read(&mut self) -> Option<u8> {
        (self.read(STATE) & STATE_RX_FULL != 0).then(|| self.read(DATA) as u8)
    }

    /// Sends a byte; `false` where there is no room for it.
    pub(super) fn try_write(&mut self, byte: u8) -> bool {
        let has_room = self.read(STATE) & STATE_TX_FULL == 0;
        if has_room {
            self.write(DATA, byte.into());
        }
        has_room
    }

    fn read(&self, register: usize) -> u32 {
        // SAFETY: a register of a UART, aligned, owned by the modules of this board.
        unsafe { ((self.0 + register) as *const u32).read_volatile() }
    }

    fn write(&self, register: usize, value: u32) {
        // SAFETY: a register of a UART, aligned, owned by the modules of this board.
        unsafe { ((self.0 + register) as *mut u32).write_volatile(value) }
    }
}
