//! Peripherals of which programs use a few registers that keep what they are told: SYSCFG, EXTI, DBGMCU.

use super::refused::{Access, Refused, only};

/// System configuration (RM0440, chapter 10).
#[derive(Clone, Debug)]
pub(crate) struct Syscfg {
    /// What is seen at address 0.
    memrmp: u32,
}

impl Syscfg {
    pub(crate) fn new() -> Self {
        Self { memrmp: 0 }
    }

    pub(crate) fn read(&self, at: u32) -> Access<u32> {
        match at {
            0x00 => Ok(self.memrmp),
            _ => Err(Refused::NotModelled),
        }
    }

    pub(crate) fn write(&mut self, at: u32, value: u32) -> Access {
        match at {
            0x00 => self.memrmp = only(value, 0x107)?,
            _ => return Err(Refused::NotModelled),
        }
        Ok(())
    }
}

/// External interrupts (RM0440, chapter 15): nothing on this board raises one.
#[derive(Clone, Debug)]
pub(crate) struct Exti {
    imr: [u32; 2],
}

impl Exti {
    pub(crate) fn new() -> Self {
        Self {
            imr: [0x1f84_0000, 0x0000_0c3c],
        }
    }

    pub(crate) fn read(&self, at: u32) -> Access<u32> {
        match at {
            0x00 => Ok(self.imr[0]),
            0x20 => Ok(self.imr[1]),
            _ => Err(Refused::NotModelled),
        }
    }

    pub(crate) fn write(&mut self, at: u32, value: u32) -> Access {
        match at {
            0x00 => self.imr[0] = value,
            0x20 => self.imr[1] = value,
            _ => return Err(Refused::NotModelled),
        }
        Ok(())
    }
}

/// What a debugger may ask for (RM0440, section 47.6); there is none.
#[derive(Clone, Debug)]
pub(crate) struct Dbgmcu {
    words: [u32; 5],
}

/// STM32G474, revision X (section 47.6.1).
const IDCODE: u32 = 0x2003_6469;

impl Dbgmcu {
    pub(crate) fn new() -> Self {
        Self {
            words: [IDCODE, 0, 0, 0, 0],
        }
    }

    pub(crate) fn read(&self, at: u32) -> Access<u32> {
        let word = self.words.get(at as usize / 4).copied();
        word.ok_or(Refused::NotModelled)
    }

    pub(crate) fn write(&mut self, at: u32, value: u32) -> Access {
        match self.words.get_mut(at as usize / 4) {
            Some(word) if at != 0 => *word = value,
            _ => return Err(Refused::NotModelled),
        }
        Ok(())
    }
}
