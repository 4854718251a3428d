//! The USB full-speed device: packet memory, endpoint registers, events (RM0440, chapter 45).
//!
//! Isochronous and double-buffered endpoints, link power management and battery charging are not modelled.

use super::refused::{Access, Refused, misuse, only};
use super::time::Clock;

const CNTR: u32 = 0x40;
const ISTR: u32 = 0x44;
const FNR: u32 = 0x48;
const DADDR: u32 = 0x4c;
const BTABLE: u32 = 0x50;
const BCDR: u32 = 0x58;

/// CNTR.
const FRES: u32 = 1;
const PDWN: u32 = 1 << 1;
const LP_MODE: u32 = 1 << 2;
const FSUSP: u32 = 1 << 3;
/// ISTR, and the masks of CNTR at the same places.
const SOF: u32 = 1 << 9;
const RESET: u32 = 1 << 10;
const SUSP: u32 = 1 << 11;
const WKUP: u32 = 1 << 12;
const CTR: u32 = 1 << 15;
const MASKS: u32 = 0xff80;
const ESOF: u32 = 1 << 8;
const LATCHED: u32 = MASKS & !CTR;
/// DADDR: the function is enabled, and its address.
const EF: u32 = 1 << 7;
/// BCDR: the pull-up at D+.
const DPPU: u32 = 1 << 15;

/// EPnR.
const CTR_RX: u16 = 1 << 15;
const DTOG_RX: u16 = 1 << 14;
const STAT_RX: u16 = 0b11 << 12;
const SETUP: u16 = 1 << 11;
const EP_TYPE: u16 = 0b11 << 9;
const EP_KIND: u16 = 1 << 8;
const CTR_TX: u16 = 1 << 7;
const DTOG_TX: u16 = 1 << 6;
const STAT_TX: u16 = 0b11 << 4;
const EA: u16 = 0xf;
const PLAIN: u16 = EP_TYPE | EP_KIND | EA;
const TOGGLED: u16 = DTOG_RX | STAT_RX | DTOG_TX | STAT_TX;
const CONTROL: u16 = 0b01 << 9;
const ISOCHRONOUS: u16 = 0b10 << 9;

/// STAT: what an endpoint answers.
const STALL: u16 = 0b01;
const NAK: u16 = 0b10;
const VALID: u16 = 0b11;

/// Bytes of the packet memory.
const PMA_BYTES: usize = 1024;
/// From power-up of the transceiver to the release of its reset (DS12288, USB start-up time).
const STARTUP_S: f64 = 1e-6;

/// What the device answers to a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Taken, or sent.
    Ack,
    /// Not now.
    Nak,
    /// Refused.
    Stall,
    /// Nothing: there is no such endpoint, or no such device.
    Silence,
}

/// The registers and the packet memory.
#[derive(Clone, Debug)]
pub struct Usb {
    endpoints: [u16; 8],
    cntr: u32,
    istr: u32,
    frame: u32,
    address: u32,
    table: u32,
    bcdr: u32,
    powered_s: f64,
    memory: Vec<u8>,
}

impl Usb {
    pub(crate) fn new() -> Self {
        Self {
            endpoints: [0; 8],
            cntr: FRES | PDWN,
            istr: 0,
            frame: 0,
            address: 0,
            table: 0,
            bcdr: 0,
            powered_s: 0.0,
            memory: vec![0; PMA_BYTES],
        }
    }

    /// Whether an enabled event asks for an interrupt.
    pub(crate) fn interrupts(&self) -> bool {
        self.events() & self.cntr & MASKS != 0
    }

    /// ISTR: what was latched, and the endpoint that completed a transfer, the lowest first (section 45.6.2).
    fn events(&self) -> u32 {
        let complete = |endpoint: &u16| endpoint & (CTR_RX | CTR_TX) != 0;
        match self.endpoints.iter().position(complete) {
            Some(index) => {
                let is_out = self.endpoints[index] & CTR_RX != 0;
                self.istr | CTR | u32::from(is_out) << 4 | index as u32
            }
            None => self.istr,
        }
    }

    /// Whether the device shows itself on the bus.
    pub fn is_attached(&self) -> bool {
        self.bcdr & DPPU != 0 && self.cntr & PDWN == 0
    }

    pub(crate) fn read(&self, at: u32) -> Access<u32> {
        Ok(match at {
            0x00..=0x1c => self.endpoints[at as usize / 4].into(),
            CNTR => self.cntr,
            ISTR => self.events(),
            FNR => self.frame,
            DADDR => self.address,
            BTABLE => self.table,
            BCDR => self.bcdr,
            _ => return Err(Refused::NotModelled),
        })
    }

    /// Writes a register; `clocked` says whether the device has its clocks.
    pub(crate) fn write(&mut self, at: u32, value: u32, clock: &Clock, clocked: Access) -> Access {
        match at {
            0x00..=0x1c => self.write_endpoint(at as usize / 4, value as u16)?,
            CNTR => self.control(value, clock)?,
            // Written as 0 an event is cleared, and as 1 it stays.
            ISTR => self.istr &= value | !LATCHED,
            DADDR => self.address = value & 0xff,
            BTABLE => self.table = only(value, 0x3f8)?,
            BCDR => {
                clocked?;
                self.bcdr = only(value, DPPU)?;
            }
            _ => return Err(Refused::NotModelled),
        }
        Ok(())
    }

    fn control(&mut self, value: u32, clock: &Clock) -> Access {
        only(value, MASKS | FSUSP | LP_MODE | PDWN | FRES)?;
        if self.cntr & PDWN != 0 && value & PDWN == 0 {
            self.powered_s = clock.seconds();
        }
        let is_released = self.cntr & FRES != 0 && value & FRES == 0;
        if is_released && clock.seconds() < self.powered_s + STARTUP_S {
            return misuse(
                "USB leaves its reset before its transceiver has started (RM0440, section 45.5.2)",
            );
        }
        self.cntr = value;
        if value & FRES != 0 {
            self.clear();
        }
        Ok(())
    }

    /// Some bits are toggled by a 1, some cleared by a 0, some plain (section 45.6.1).
    fn write_endpoint(&mut self, index: usize, value: u16) -> Access {
        let before = self.endpoints[index];
        let kept = before & value & (CTR_RX | CTR_TX);
        let toggled = (before ^ value) & TOGGLED;
        let endpoint = kept | toggled | before & SETUP | value & PLAIN;
        if endpoint & EP_TYPE == ISOCHRONOUS || (endpoint & EP_TYPE == 0 && endpoint & EP_KIND != 0)
        {
            return Err(Refused::NotModelled);
        }
        self.endpoints[index] = endpoint;
        Ok(())
    }

    /// What a reset of the bus, or FRES, leaves (section 45.5.2): transfers that completed are still told.
    fn clear(&mut self) {
        self.endpoints = self.endpoints.map(|endpoint| endpoint & (CTR_RX | CTR_TX));
        self.address = 0;
    }

    pub(crate) fn read_memory(&self, at: usize, bytes: u32) -> Access<u32> {
        if at + bytes as usize > PMA_BYTES {
            return Err(Refused::NotModelled);
        }
        Ok((0..bytes as usize)
            .rev()
            .fold(0, |word, i| word << 8 | u32::from(self.memory[at + i])))
    }

    /// The packet memory takes half-words and words (section 45.4.2).
    pub(crate) fn write_memory(&mut self, at: usize, bytes: u32, value: u32) -> Access {
        if bytes == 1 || at + bytes as usize > PMA_BYTES {
            return Err(Refused::NotModelled);
        }
        let little = value.to_le_bytes();
        self.memory[at..at + bytes as usize].copy_from_slice(&little[..bytes as usize]);
        Ok(())
    }

    fn half(&self, at: usize) -> usize {
        let at = at % PMA_BYTES;
        usize::from(u16::from_le_bytes([self.memory[at], self.memory[at + 1]]))
    }

    /// Where the buffer table has an endpoint's entry `which`: address and count to send, address and count to receive.
    fn entry(&self, index: usize, which: usize) -> usize {
        self.table as usize + 8 * index + 2 * which
    }

    /// The endpoint that answers to `number`.
    fn endpoint(&self, address: u8, number: u8, is_in: bool) -> Option<usize> {
        let listens = self.cntr & (FRES | PDWN) == 0 && self.address & EF != 0;
        if !listens || self.address & 0x7f != u32::from(address) {
            return None;
        }
        let stat = if is_in { STAT_TX } else { STAT_RX };
        self.endpoints
            .iter()
            .position(|endpoint| endpoint & EA == u16::from(number) && endpoint & stat != 0)
    }

    /// Something happens on the bus: a suspended device notices it.
    fn wake(&mut self) {
        if self.cntr & FSUSP != 0 {
            self.istr |= WKUP;
        }
    }

    /// The host resets the bus.
    pub fn bus_reset(&mut self) {
        self.wake();
        self.clear();
        self.istr |= RESET;
    }

    /// A frame begins.
    pub fn start_of_frame(&mut self, number: u32) {
        self.wake();
        self.frame = number & 0x7ff;
        self.istr |= SOF;
    }

    /// Nothing happened on the bus for 3 ms.
    pub fn idle(&mut self) {
        self.istr |= SUSP | ESOF;
    }

    /// A SETUP packet: taken by a control endpoint, whatever it is about.
    pub fn setup(&mut self, address: u8, packet: [u8; 8]) -> Answer {
        let Some(index) = self.endpoint(address, 0, false) else {
            return Answer::Silence;
        };
        let endpoint = self.endpoints[index];
        if endpoint & EP_TYPE != CONTROL || endpoint & CTR_RX != 0 {
            return Answer::Silence;
        }
        if !self.store(index, &packet) {
            return Answer::Silence;
        }
        let kept = endpoint & !(STAT_RX | STAT_TX);
        self.endpoints[index] = kept | CTR_RX | SETUP | DTOG_RX | DTOG_TX | NAK << 12 | NAK << 4;
        Answer::Ack
    }

    /// A packet to the device, of data 0 or data 1.
    pub fn send(&mut self, address: u8, number: u8, packet: &[u8], toggle: bool) -> Answer {
        let Some(index) = self.endpoint(address, number, false) else {
            return Answer::Silence;
        };
        let endpoint = self.endpoints[index];
        match (endpoint & STAT_RX) >> 12 {
            VALID => {}
            NAK => return Answer::Nak,
            _ => return Answer::Stall,
        }
        if (endpoint & DTOG_RX != 0) != toggle {
            // It is a packet whose answer the host did not hear.
            return Answer::Ack;
        }
        if !self.store(index, packet) {
            return Answer::Stall;
        }
        let kept = endpoint & !(STAT_RX | SETUP);
        self.endpoints[index] = (kept | CTR_RX | NAK << 12) ^ DTOG_RX;
        Answer::Ack
    }

    /// Puts a packet into the endpoint's buffer, if it has room.
    fn store(&mut self, index: usize, packet: &[u8]) -> bool {
        let start = self.half(self.entry(index, 2));
        let count_at = self.entry(index, 3);
        let count = self.half(count_at);
        let blocks = count >> 10 & 0x1f;
        let room = match count >> 15 {
            0 => 2 * blocks,
            _ => 32 * (blocks + 1),
        };
        if packet.len() > room || start + packet.len() > PMA_BYTES {
            return false;
        }
        self.memory[start..start + packet.len()].copy_from_slice(packet);
        let count = (count & !0x3ff | packet.len()) as u16;
        self.memory[count_at..count_at + 2].copy_from_slice(&count.to_le_bytes());
        true
    }

    /// A packet from the device, and whether it is data 1; the host acknowledges it.
    ///
    /// # Errors
    /// The device's answer where there is no packet.
    pub fn fetch(&mut self, address: u8, number: u8) -> Result<(Vec<u8>, bool), Answer> {
        let Some(index) = self.endpoint(address, number, true) else {
            return Err(Answer::Silence);
        };
        let endpoint = self.endpoints[index];
        match (endpoint & STAT_TX) >> 4 {
            VALID => {}
            STALL => return Err(Answer::Stall),
            _ => return Err(Answer::Nak),
        }
        let start = self.half(self.entry(index, 0));
        let count = self.half(self.entry(index, 1)) & 0x3ff;
        let Some(packet) = self.memory.get(start..start + count) else {
            return Err(Answer::Silence);
        };
        let packet = packet.to_vec();
        let toggle = endpoint & DTOG_TX != 0;
        self.endpoints[index] = (endpoint & !STAT_TX | CTR_TX | NAK << 4) ^ DTOG_TX;
        Ok((packet, toggle))
    }
}

#[cfg(test)]
mod tests;
