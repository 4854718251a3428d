//! A USB host: it finds the device, reads its descriptors, configures it, and then carries packets (USB 2.0, sections 7.1.7
//! and 9.1.2).

mod enumeration;
mod raw;
mod transfer;

use std::collections::VecDeque;

use crate::chip::usb::{Answer, Usb};
use crate::chip::{Clock, NEVER};
use enumeration::{Enumeration, Next};
use transfer::{Progress, Transfer};

pub use enumeration::Device;
pub use raw::Raw;
pub use transfer::Request;

/// Bits a second at full speed.
const BIT_HZ: f64 = 12e6;
/// Bits of a transaction around its data: token, data packet's frame and handshake with the pauses between.
const TRANSACTION_BITS: f64 = 130.0;
const FRAME_S: f64 = 1e-3;
/// What is not ready is asked again so much later: some fifty times a frame. Host controllers do so as often as the bus has
/// room; ten times were too few for a sample of every tick, of which the second packet is not ready when the first has gone.
const RETRY_S: f64 = 10e-6;
/// Debounce after attaching, reset, and recovery from it (USB 2.0, section 7.1.7.3 and 7.1.7.5).
const DEBOUNCE_S: f64 = 100e-3;
const RESET_S: f64 = 10e-3;
const RECOVERY_S: f64 = 10e-3;
/// A device is suspended after so long without traffic (USB 2.0, section 7.1.7.6).
const IDLE_S: f64 = 3e-3;
/// Largest packet of a bulk endpoint.
const BULK_BYTES: usize = 64;

#[derive(Clone, Copy, Debug, PartialEq)]
enum BusState {
    /// Nothing is plugged in, or the cable is out.
    Empty,
    /// A device showed itself, and is waited for to be steady.
    Debounce,
    /// Reset, until then.
    Reset,
    /// Frames of 1 ms.
    Running,
    /// No traffic, on purpose.
    Suspended,
}

/// The host, with its end of the cable.
#[derive(Clone, Debug)]
pub struct UsbHost {
    is_plugged: bool,
    bus: BusState,
    /// When the present state of the bus, or the present transaction, ends (s).
    until_s: f64,
    /// When a bus without traffic counts as suspended.
    idle_s: f64,
    frame: u32,
    next_frame_s: f64,
    address: u8,
    enumeration: Enumeration,
    transfer: Option<Transfer>,
    requests: VecDeque<Request>,
    raw: VecDeque<Raw>,
    answers: VecDeque<(Request, Option<Vec<u8>>)>,
    to_device: VecDeque<Vec<u8>>,
    from_device: VecDeque<Vec<u8>>,
    frame_so_far: Vec<u8>,
    /// Frames from the device since it was plugged in.
    frames: u64,
    /// Data 0 or data 1 next: to the device, and from it.
    toggles: [bool; 2],
    wants_in: bool,
    listens: bool,
    failure: Option<String>,
}

impl Default for UsbHost {
    fn default() -> Self {
        Self {
            is_plugged: true,
            bus: BusState::Empty,
            until_s: 0.0,
            idle_s: f64::INFINITY,
            frame: 0,
            next_frame_s: 0.0,
            address: 0,
            enumeration: Enumeration::default(),
            transfer: None,
            requests: VecDeque::new(),
            raw: VecDeque::new(),
            answers: VecDeque::new(),
            to_device: VecDeque::new(),
            from_device: VecDeque::new(),
            frame_so_far: Vec::new(),
            frames: 0,
            toggles: [false; 2],
            wants_in: false,
            listens: false,
            failure: None,
        }
    }
}

/// How long a transaction with so many bytes of data takes the bus.
fn bus_s(bytes: usize) -> f64 {
    (TRANSACTION_BITS + 8.0 * bytes as f64) / BIT_HZ
}

impl UsbHost {
    /// Queues a transaction, before all that a good host has to do.
    pub fn transact_raw(&mut self, raw: Raw) {
        self.raw.push_back(raw);
    }

    /// Whether all of them have taken place.
    pub fn has_transacted(&self) -> bool {
        self.raw.is_empty()
    }

    /// The next packets of both bulk endpoints are data 0, as after a halt that was cleared.
    pub fn begin_with_data_0(&mut self) {
        self.toggles = [false; 2];
    }

    /// The device's address.
    pub fn address(&self) -> u8 {
        self.address
    }

    /// What the device says of itself, once it is configured.
    pub fn device(&self) -> Option<&Device> {
        self.enumeration.device()
    }

    /// What was wrong with the device.
    pub fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// Pulls the cable out, in the midst of whatever is under way.
    pub fn unplug(&mut self) {
        *self = Self {
            is_plugged: false,
            ..Self::default()
        };
    }

    /// Puts it in.
    pub fn plug(&mut self) {
        self.is_plugged = true;
    }

    /// Resets the bus and gets to know the device anew, in the midst of whatever is under way.
    pub fn start_over(&mut self, clock: &Clock) {
        let now_s = clock.seconds();
        *self = Self {
            bus: BusState::Debounce,
            until_s: now_s,
            idle_s: f64::INFINITY,
            is_plugged: self.is_plugged,
            listens: self.listens,
            ..Self::default()
        };
    }

    /// Stops all traffic, as a computer that sleeps.
    pub fn suspend(&mut self, clock: &Clock) {
        if self.bus == BusState::Running {
            self.bus = BusState::Suspended;
            self.idle_s = clock.seconds() + IDLE_S;
        }
    }

    /// Takes it up again.
    pub fn resume(&mut self, clock: &Clock) {
        if self.bus == BusState::Suspended {
            self.run(clock.seconds());
        }
    }

    /// Sends a frame to the device: packets of 64 bytes, ended by a shorter one.
    pub fn send(&mut self, frame: &[u8]) {
        self.to_device
            .extend(frame.chunks(BULK_BYTES).map(<[u8]>::to_vec));
        if frame.len().is_multiple_of(BULK_BYTES) {
            self.to_device.push_back(Vec::new());
        }
    }

    /// A frame from the device.
    pub fn receive(&mut self) -> Option<Vec<u8>> {
        self.from_device.pop_front()
    }

    /// Frames from the device since it was plugged in.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Whether a frame from the device waits.
    pub fn has_received(&self) -> bool {
        !self.from_device.is_empty()
    }

    /// Whether the device is asked for frames at all: a program on the host waits for them.
    pub fn listen(&mut self, listens: bool) {
        self.listens = listens;
    }

    /// Begins a request on endpoint 0.
    pub fn request(&mut self, request: Request) {
        self.requests.push_back(request);
    }

    /// A request that ended: what was read, or none where it was refused.
    pub fn answer(&mut self) -> Option<(Request, Option<Vec<u8>>)> {
        self.answers.pop_front()
    }

    /// The cycle in which the host does something next.
    pub(crate) fn next_event(&self, usb: &Usb, clock: &Clock) -> u64 {
        let at_s = match self.bus {
            BusState::Empty if self.is_plugged && usb.is_attached() => return clock.cycles,
            _ if self.is_plugged != usb.is_attached() && self.bus != BusState::Empty => {
                return clock.cycles;
            }
            BusState::Empty => return NEVER,
            BusState::Suspended | BusState::Debounce => self.idle_s.min(self.until_s),
            BusState::Reset => self.until_s,
            BusState::Running => self.until_s.min(self.next_frame_s),
        };
        match at_s.is_finite() {
            true => clock.cycle_at(at_s),
            false => NEVER,
        }
    }

    /// Does what is due.
    pub(crate) fn happen(&mut self, usb: &mut Usb, now_s: f64) {
        if self.bus != BusState::Empty && !usb.is_attached() {
            let is_plugged = self.is_plugged;
            *self = Self {
                is_plugged,
                ..Self::default()
            };
            return;
        }
        match self.bus {
            BusState::Empty => {
                self.bus = BusState::Debounce;
                (self.until_s, self.idle_s) = (now_s + DEBOUNCE_S, now_s + IDLE_S);
            }
            BusState::Debounce | BusState::Suspended if now_s >= self.idle_s => {
                usb.idle();
                self.idle_s = f64::INFINITY;
            }
            BusState::Debounce => self.reset(usb, now_s),
            BusState::Suspended => self.until_s = f64::INFINITY,
            BusState::Reset => self.run(now_s + RECOVERY_S),
            BusState::Running if now_s >= self.next_frame_s => {
                self.frame += 1;
                usb.start_of_frame(self.frame);
                self.next_frame_s += FRAME_S;
            }
            BusState::Running => self.transact(usb, now_s),
        }
    }

    fn run(&mut self, from_s: f64) {
        self.bus = BusState::Running;
        (self.next_frame_s, self.until_s) = (from_s, from_s);
    }

    fn reset(&mut self, usb: &mut Usb, now_s: f64) {
        usb.bus_reset();
        self.bus = BusState::Reset;
        (self.until_s, self.idle_s) = (now_s + RESET_S, f64::INFINITY);
        (self.address, self.toggles) = (0, [false; 2]);
    }

    /// One transaction: control transfers first, then bulk in both directions by turns.
    fn transact(&mut self, usb: &mut Usb, now_s: f64) {
        if let Some(raw) = self.raw.pop_front() {
            let bytes = raw::carry(usb, &raw);
            self.until_s = now_s + bus_s(bytes);
            return;
        }
        if self.transfer.is_none() {
            self.begin_transfer(usb, now_s);
        }
        if self.bus != BusState::Running || self.until_s > now_s {
            return;
        }
        let (bytes, waits) = match self.transfer.take() {
            Some(transfer) => self.go_on(usb, transfer, now_s),
            None => self.carry(usb),
        };
        let pause_s = if waits { RETRY_S } else { 0.0 };
        self.until_s = self.until_s.max(now_s + bus_s(bytes) + pause_s);
    }

    /// What comes next: of the enumeration, or of what was asked for.
    fn begin_transfer(&mut self, usb: &mut Usb, now_s: f64) {
        match self.enumeration.next() {
            Next::Reset => self.reset(usb, now_s),
            Next::Address(address) => self.address = address,
            Next::Pause(seconds) => self.until_s = now_s + seconds,
            Next::Request(request) => self.transfer = Some(Transfer::new(request)),
            Next::Nothing => self.transfer = self.requests.pop_front().map(Transfer::new),
        }
    }

    fn go_on(&mut self, usb: &mut Usb, mut transfer: Transfer, now_s: f64) -> (usize, bool) {
        let packet_bytes = self.enumeration.packet_bytes();
        let progress = transfer.step(usb, self.address, packet_bytes);
        let request = transfer.request;
        match progress {
            Progress::Continues => self.transfer = Some(transfer),
            Progress::Waits => {
                self.transfer = Some(transfer);
                return (0, true);
            }
            Progress::Done(data) if self.device().is_some() => {
                self.answers.push_back((request, Some(data)));
            }
            Progress::Done(data) => {
                if let Err(wrong) = self.enumeration.take(&data) {
                    self.fail(format!("{wrong} ({request})"));
                }
            }
            Progress::Failed(_) if self.device().is_some() => {
                self.answers.push_back((request, None));
            }
            Progress::Failed(why) => self.fail(format!("{why} ({request}, after {now_s:.3} s)")),
        }
        (packet_bytes, false)
    }

    fn fail(&mut self, why: String) {
        self.failure = Some(why);
        self.bus = BusState::Suspended;
        (self.until_s, self.idle_s) = (f64::INFINITY, f64::INFINITY);
    }

    /// A bulk transaction; its bytes, and whether nothing was ready.
    fn carry(&mut self, usb: &mut Usb) -> (usize, bool) {
        let Some((out, in_)) = self.device().map(|device| device.endpoints) else {
            return (0, true);
        };
        self.wants_in = !self.wants_in;
        if !self.wants_in && !self.to_device.is_empty() {
            return self.carry_out(usb, out);
        }
        if !self.listens {
            return (0, true);
        }
        match usb.fetch(self.address, in_) {
            Ok((packet, toggle)) => {
                // A packet that was heard before is passed over (USB 2.0, section 8.6.4).
                if toggle == self.toggles[1] {
                    self.toggles[1] = !toggle;
                    let ends = packet.len() < BULK_BYTES;
                    self.frame_so_far.extend(&packet);
                    if ends {
                        let frame = std::mem::take(&mut self.frame_so_far);
                        self.from_device.push_back(frame);
                        self.frames += 1;
                    }
                }
                (packet.len(), false)
            }
            Err(Answer::Stall) => {
                self.fail("the device stalls its endpoint to the host".to_owned());
                (0, true)
            }
            Err(_) => (0, self.to_device.is_empty()),
        }
    }

    fn carry_out(&mut self, usb: &mut Usb, out: u8) -> (usize, bool) {
        let Some(packet) = self.to_device.front() else {
            return (0, true);
        };
        let bytes = packet.len();
        match usb.send(self.address, out, packet, self.toggles[0]) {
            Answer::Ack => {
                self.to_device.pop_front();
                self.toggles[0] = !self.toggles[0];
                (bytes, false)
            }
            Answer::Stall => {
                self.fail("the device stalls its endpoint from the host".to_owned());
                (bytes, true)
            }
            Answer::Nak | Answer::Silence => (bytes, true),
        }
    }
}
