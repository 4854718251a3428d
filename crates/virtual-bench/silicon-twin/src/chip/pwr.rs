//! Power control, as far as the clock depends on it (RM0440, chapter 6).

use super::refused::{Access, Refused, misuse, only};

mod offset {
    pub(super) const CR1: u32 = 0x00;
    pub(super) const CR2: u32 = 0x04;
    pub(super) const CR3: u32 = 0x08;
    pub(super) const SR2: u32 = 0x14;
    pub(super) const CR5: u32 = 0x80;
}

/// CR1: access to the backup domain, and the range of the core's voltage.
const DBP: u32 = 1 << 8;
const VOS: u32 = 0b11 << 9;
const RANGE_1: u32 = 0b01 << 9;
/// CR5: normal mode in range 1; boost mode where it is 0.
const R1MODE: u32 = 1 << 8;
/// CR3: dead-battery pull-downs of UCPD.
const CR3_MODELLED: u32 = 1 << 14 | 1 << 13 | 1 << 15;

/// The core's voltage, by what frequency it allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Range {
    Boost,
    One,
    Two,
}

/// The registers.
#[derive(Clone, Debug)]
pub(crate) struct Pwr {
    cr1: u32,
    cr2: u32,
    cr3: u32,
    cr5: u32,
}

impl Pwr {
    pub(crate) fn new() -> Self {
        Self {
            cr1: RANGE_1,
            cr2: 0,
            cr3: 1 << 15,
            cr5: R1MODE,
        }
    }

    pub(crate) fn read(&self, at: u32) -> Access<u32> {
        match at {
            offset::CR1 => Ok(self.cr1),
            offset::CR2 => Ok(self.cr2),
            offset::CR3 => Ok(self.cr3),
            // The voltage is there at once.
            offset::SR2 => Ok(0),
            offset::CR5 => Ok(self.cr5),
            _ => Err(Refused::NotModelled),
        }
    }

    pub(crate) fn write(&mut self, at: u32, value: u32) -> Access {
        match at {
            offset::CR1 => self.cr1 = only(value, DBP | VOS)?,
            offset::CR2 => self.cr2 = only(value, 0)?,
            offset::CR3 => self.cr3 = only(value, CR3_MODELLED)?,
            offset::CR5 => self.cr5 = only(value, R1MODE)?,
            _ => return Err(Refused::NotModelled),
        }
        Ok(())
    }

    pub(crate) fn range(&self) -> Range {
        match (self.cr1 & VOS, self.cr5 & R1MODE) {
            (RANGE_1, 0) => Range::Boost,
            (RANGE_1, _) => Range::One,
            _ => Range::Two,
        }
    }

    /// Whether the core may run so fast with so many wait states of the flash (sections 3.3.3 and 6.1.5).
    pub(crate) fn check(&self, core_hz: f64, wait_states: u32) -> Access {
        let (name, step_mhz, highest_mhz) = match self.range() {
            Range::Boost => ("boost mode", 34.0, 170.0),
            Range::One => ("range 1 without boost mode", 30.0, 150.0),
            Range::Two => ("range 2", 12.0, 26.0),
        };
        let mhz = core_hz / 1e6;
        if mhz > highest_mhz {
            return misuse(format!(
                "the core runs at {mhz:.1} MHz, and in {name} at most at {highest_mhz} (RM0440, section 6.1.5)"
            ));
        }
        let needed = (mhz / step_mhz).ceil() as u32 - 1;
        match wait_states >= needed {
            true => Ok(()),
            false => misuse(format!(
                "the flash has {wait_states} wait states, and needs {needed} at {mhz:.1} MHz in {name} (RM0440, \
                 section 3.3.3)"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clock_range_and_wait_states_belong_together() {
        let mut pwr = Pwr::new();
        assert!(pwr.check(170e6, 4).is_err(), "no boost mode");
        pwr.write(offset::CR5, 0).expect("boost mode");
        assert_eq!(pwr.check(170e6, 4), Ok(()));
        assert!(pwr.check(170e6, 3).is_err(), "a wait state is missing");
        assert!(pwr.check(171e6, 15).is_err());
        assert_eq!(pwr.check(16e6, 0), Ok(()));
        assert_eq!(pwr.write(0x40, 1), Err(Refused::NotModelled));
    }
}
