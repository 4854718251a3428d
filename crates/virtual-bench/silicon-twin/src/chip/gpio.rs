//! A port of pins (RM0440, chapter 9).

use super::refused::{Access, Refused};

/// What a pin does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    Input,
    /// Driven to this level.
    Output(bool),
    /// Given to a peripheral, by number.
    Alternate(u8),
    Analogue,
}

/// The registers.
#[derive(Clone, Debug)]
pub(crate) struct Port {
    moder: u32,
    otyper: u32,
    ospeedr: u32,
    pupdr: u32,
    odr: u32,
    afr: [u32; 2],
}

impl Port {
    /// As after reset: ports A and B have the debugger's pins (sections 9.4.1 to 9.4.4).
    pub(crate) fn new(port: u32) -> Self {
        let (moder, ospeedr, pupdr) = match port {
            0 => (0xabff_ffff, 0x0c00_0000, 0x6400_0000),
            1 => (0xffff_febf, 0x0000_00c0, 0x0000_0100),
            _ => (0xffff_ffff, 0, 0),
        };
        Self {
            moder,
            otyper: 0,
            ospeedr,
            pupdr,
            odr: 0,
            afr: [0; 2],
        }
    }

    pub(crate) fn mode(&self, pin: u32) -> Mode {
        match self.moder >> (2 * pin) & 0b11 {
            0b00 => Mode::Input,
            0b01 => Mode::Output(self.odr >> pin & 1 != 0),
            0b10 => {
                let word = self.afr[usize::from(pin >= 8)];
                Mode::Alternate((word >> (4 * (pin % 8)) & 0xf) as u8)
            }
            _ => Mode::Analogue,
        }
    }

    /// Whether a pin is driven high and low, and not low only.
    pub(crate) fn is_push_pull(&self, pin: u32) -> bool {
        self.otyper >> pin & 1 == 0
    }

    pub(crate) fn read(&self, at: u32) -> Access<u32> {
        Ok(match at {
            0x00 => self.moder,
            0x04 => self.otyper,
            0x08 => self.ospeedr,
            0x0c => self.pupdr,
            0x14 => self.odr,
            0x20 => self.afr[0],
            0x24 => self.afr[1],
            _ => return Err(Refused::NotModelled),
        })
    }

    pub(crate) fn write(&mut self, at: u32, value: u32) -> Access {
        match at {
            0x00 => self.moder = value,
            0x04 => self.otyper = value & 0xffff,
            0x08 => self.ospeedr = value,
            0x0c => self.pupdr = value,
            0x14 => self.odr = value & 0xffff,
            // BSRR: setting goes before clearing (section 9.4.7).
            0x18 => self.odr = self.odr & !(value >> 16) | value & 0xffff,
            0x20 => self.afr[0] = value,
            0x24 => self.afr[1] = value,
            0x28 => self.odr &= !value,
            _ => return Err(Refused::NotModelled),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pin_does_what_its_registers_say() {
        let mut port = Port::new(2);
        assert_eq!(port.mode(0), Mode::Analogue);
        port.write(0x20, 0x2).expect("AFRL");
        port.write(0x00, 0xffff_fffe).expect("MODER");
        assert_eq!(port.mode(0), Mode::Alternate(2));
        port.write(0x18, 1 << 3 | 1 << (3 + 16)).expect("BSRR");
        port.write(0x00, 0xffff_ff7f).expect("MODER");
        assert_eq!(port.mode(3), Mode::Output(true), "setting goes first");
    }
}
