//! The independent watchdog (RM0440, chapter 42).

use super::refused::{Access, Refused};
use super::time::{Clock, NEVER};

/// Frequency of the LSI oscillator (DS12288, table 54: 31.04 to 32.96 kHz).
const LSI_HZ: f64 = 32e3;
/// A new prescaler or reload value is there after five of its clocks (section 42.4.4).
const UPDATE_S: f64 = 5.0 / LSI_HZ;

const START: u32 = 0xcccc;
const FEED: u32 = 0xaaaa;
const UNLOCK: u32 = 0x5555;

/// SR: a new prescaler, reload value or window is on its way.
const PVU: u32 = 1;
const RVU: u32 = 1 << 1;

/// The registers.
#[derive(Clone, Debug)]
pub(crate) struct Iwdg {
    prescaler: u32,
    reload: u32,
    is_unlocked: bool,
    updates: [f64; 2],
    /// When it bites (s).
    due_s: Option<f64>,
    /// How often it was fed.
    pub(crate) feeds: u64,
}

impl Iwdg {
    pub(crate) fn new() -> Self {
        Self {
            prescaler: 0,
            reload: 0xfff,
            is_unlocked: false,
            updates: [0.0; 2],
            due_s: None,
            feeds: 0,
        }
    }

    pub(crate) fn read(&self, at: u32, clock: &Clock) -> Access<u32> {
        let is_under_way = |index: usize| clock.seconds() < self.updates[index];
        Ok(match at {
            0x04 => self.prescaler,
            0x08 => self.reload,
            0x0c => {
                let prescaler = if is_under_way(0) { PVU } else { 0 };
                prescaler | if is_under_way(1) { RVU } else { 0 }
            }
            _ => return Err(Refused::NotModelled),
        })
    }

    /// Writes a register; whether the watchdog starts by it.
    pub(crate) fn write(&mut self, at: u32, value: u32, clock: &Clock) -> Access<bool> {
        let updated_s = clock.seconds() + UPDATE_S;
        match at {
            0x00 => {
                self.is_unlocked = value == UNLOCK;
                match value {
                    START if self.due_s.is_none() => {
                        self.feed(clock);
                        return Ok(true);
                    }
                    FEED => {
                        self.feeds += 1;
                        if self.due_s.is_some() {
                            self.feed(clock);
                        }
                    }
                    _ => {}
                }
            }
            0x04 if self.is_unlocked => (self.prescaler, self.updates[0]) = (value & 7, updated_s),
            0x08 if self.is_unlocked => (self.reload, self.updates[1]) = (value & 0xfff, updated_s),
            // Locked: the write has no effect (section 42.3.2).
            0x04 | 0x08 => {}
            _ => return Err(Refused::NotModelled),
        }
        Ok(false)
    }

    fn feed(&mut self, clock: &Clock) {
        let divisor = 4 << self.prescaler.min(6);
        let period_s = f64::from((self.reload + 1) * divisor) / LSI_HZ;
        self.due_s = Some(clock.seconds() + period_s);
    }

    /// The cycle in which it bites.
    pub(crate) fn next_event(&self, clock: &Clock) -> u64 {
        self.due_s.map_or(NEVER, |due_s| clock.cycle_at(due_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_bites_unless_it_is_fed() {
        let mut clock = Clock::new(16e6);
        let mut iwdg = Iwdg::new();
        iwdg.write(0x08, 999, &clock).expect("RLR");
        assert_eq!(iwdg.read(0x08, &clock), Ok(0xfff), "locked");
        for (at, value) in [(0x00, UNLOCK), (0x04, 2), (0x08, 999), (0x00, START)] {
            iwdg.write(at, value, &clock).expect("a register");
        }
        // 1000 periods of 16 clocks of 32 kHz.
        assert_eq!(iwdg.next_event(&clock), 8_000_000);
        clock.cycles = 5_000_000;
        iwdg.write(0x00, FEED, &clock).expect("KR");
        assert_eq!(iwdg.next_event(&clock), 13_000_000);
    }
}
