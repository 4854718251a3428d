//! Reset and clock control (RM0440, chapter 7).

use super::refused::{Access, Refused, misuse};
use super::time::Clock;

/// Frequency of the internal oscillator (data sheet DS12288, table 51).
const HSI_HZ: f64 = 16e6;
/// That of the internal oscillator for USB.
const HSI48_HZ: f64 = 48e6;
/// Start-up times (DS12288, tables 51 to 55): HSI16, HSI48, LSI, and the lock of the PLL.
const HSI_START_S: f64 = 1.2e-6;
const HSI48_START_S: f64 = 6e-6;
const LSI_START_S: f64 = 130e-6;
const PLL_LOCK_S: f64 = 40e-6;

/// Limits of the PLL (DS12288, table 55), in Hz.
const PLL_INPUT_HZ: std::ops::RangeInclusive<f64> = 2.66e6..=16e6;
const PLL_VCO_HZ: std::ops::RangeInclusive<f64> = 96e6..=344e6;

mod offset {
    pub(super) const CR: u32 = 0x00;
    pub(super) const CFGR: u32 = 0x08;
    pub(super) const PLLCFGR: u32 = 0x0c;
    pub(super) const AHB1RSTR: u32 = 0x28;
    pub(super) const APB2RSTR: u32 = 0x40;
    pub(super) const AHB1ENR: u32 = 0x48;
    pub(super) const AHB2ENR: u32 = 0x4c;
    pub(super) const APB2SMENR: u32 = 0x80;
    pub(super) const AHB1SMENR: u32 = 0x68;
    pub(super) const CCIPR: u32 = 0x88;
    pub(super) const BDCR: u32 = 0x90;
    pub(super) const CSR: u32 = 0x94;
    pub(super) const CRRCR: u32 = 0x98;
    pub(super) const CCIPR2: u32 = 0x9c;
}

const HSION: u32 = 1 << 8;
const HSIRDY: u32 = 1 << 10;
const HSEON: u32 = 1 << 16;
const PLLON: u32 = 1 << 24;
const PLLRDY: u32 = 1 << 25;
/// CRRCR and CSR: on, and ready.
const ON: u32 = 1;
const READY: u32 = 1 << 1;
/// CSR: remove the reset flags, and the flags.
const RMVF: u32 = 1 << 23;
const PINRSTF: u32 = 1 << 26;
const BORRSTF: u32 = 1 << 27;
const SFTRSTF: u32 = 1 << 28;
const IWDGRSTF: u32 = 1 << 29;
const FLAGS: u32 = 0x7f << 25;

/// Why the chip was reset (RM0440, section 7.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// Power came.
    Power,
    /// The program asked for it.
    Software,
    /// The watchdog was not fed.
    Watchdog,
}

/// The enable bits that must be set before a peripheral is used: register and bit.
pub(crate) mod gate {
    pub(crate) const ADC12: (u32, u32) = (0x4c, 13);
    pub(crate) const CRS: (u32, u32) = (0x58, 8);
    pub(crate) const USB: (u32, u32) = (0x58, 23);
    pub(crate) const PWR: (u32, u32) = (0x58, 28);
    pub(crate) const SYSCFG: (u32, u32) = (0x60, 0);
    pub(crate) const TIM1: (u32, u32) = (0x60, 11);
    pub(crate) const TIM15: (u32, u32) = (0x60, 16);
}

/// A clock that takes its time to start.
#[derive(Clone, Copy, Debug, Default)]
struct Source {
    ready_s: Option<f64>,
}

impl Source {
    fn switch(&mut self, on: bool, clock: &Clock, start_s: f64) {
        self.ready_s = match (on, self.ready_s) {
            (true, None) => Some(clock.seconds() + start_s),
            (true, ready) => ready,
            (false, _) => None,
        };
    }

    fn is_ready(self, clock: &Clock) -> bool {
        self.ready_s
            .is_some_and(|ready_s| clock.seconds() >= ready_s)
    }
}

/// The registers.
#[derive(Clone, Debug)]
pub(crate) struct Rcc {
    words: [u32; 41],
    hsi: Source,
    hsi48: Source,
    lsi: Source,
    pll: Source,
}

impl Rcc {
    /// As a reset leaves them; some outlive it.
    pub(crate) fn new(reset: Reset, before: Option<&Self>) -> Self {
        let mut rcc = Self {
            words: [0; 41],
            hsi: Source { ready_s: Some(0.0) },
            hsi48: Source::default(),
            lsi: Source::default(),
            pll: Source::default(),
        };
        rcc.set(offset::CR, HSION);
        rcc.set(offset::CFGR, 0b01);
        rcc.set(offset::PLLCFGR, 0x1000);
        // Flash, SRAM and the rest run in sleep (sections 7.4.24 to 7.4.29), as all peripherals that are on.
        rcc.set(offset::AHB1ENR, 1 << 8);
        for at in (offset::AHB1SMENR..=offset::APB2SMENR).step_by(4) {
            rcc.set(at, u32::MAX);
        }
        let kept = before.map_or(0, |before| before.get(offset::CSR) & FLAGS);
        let flags = match reset {
            Reset::Power => BORRSTF | PINRSTF,
            Reset::Software => SFTRSTF | PINRSTF,
            Reset::Watchdog => IWDGRSTF | PINRSTF,
        };
        rcc.set(offset::CSR, kept | flags);
        rcc.set(
            offset::BDCR,
            before.map_or(0, |before| before.get(offset::BDCR)),
        );
        rcc
    }

    fn get(&self, offset: u32) -> u32 {
        self.words[offset as usize / 4]
    }

    fn set(&mut self, offset: u32, value: u32) {
        self.words[offset as usize / 4] = value;
    }

    /// Whether a peripheral's clock is on.
    pub(crate) fn is_on(&self, (register, bit): (u32, u32)) -> bool {
        self.get(register) >> bit & 1 != 0
    }

    /// Whether a GPIO port's clock is on.
    pub(crate) fn is_port_on(&self, port: u32) -> bool {
        self.is_on((offset::AHB2ENR, port))
    }

    pub(crate) fn read(&self, at: u32, clock: &Clock) -> Access<u32> {
        let ready = |is_ready: bool, bit: u32| if is_ready { bit } else { 0 };
        let word = self.get(at);
        Ok(match at {
            offset::CR => {
                let hsi = ready(self.hsi.is_ready(clock), HSIRDY);
                word | hsi | ready(self.pll.is_ready(clock), PLLRDY)
            }
            // What was asked for is in use at once (SWS).
            offset::CFGR => word & !0b1100 | (word & 0b11) << 2,
            offset::CRRCR => word | ready(self.hsi48.is_ready(clock), READY),
            offset::CSR => word | ready(self.lsi.is_ready(clock), READY),
            offset::PLLCFGR
            | offset::AHB1RSTR..=offset::APB2RSTR
            | offset::AHB1ENR..=offset::APB2SMENR
            | offset::CCIPR
            | offset::BDCR
            | offset::CCIPR2 => word,
            _ => return Err(Refused::NotModelled),
        })
    }

    /// Writes a register; the peripherals that are reset by it, by register and bits.
    pub(crate) fn write(
        &mut self,
        at: u32,
        value: u32,
        clock: &Clock,
    ) -> Access<Option<(u32, u32)>> {
        match at {
            offset::CR => {
                if value & HSEON != 0 {
                    return misuse(
                        "HSE is switched on, and this board has no crystal (docs: the driver board)",
                    );
                }
                if value & (HSION | PLLON) == 0 {
                    return misuse("all clocks are switched off");
                }
                self.hsi.switch(value & HSION != 0, clock, HSI_START_S);
                self.pll.switch(value & PLLON != 0, clock, PLL_LOCK_S);
                self.set(at, value & (HSION | PLLON | 1 << 9));
                self.check_pll()?;
            }
            offset::CFGR => self.select(value, clock)?,
            offset::PLLCFGR => {
                let factors_change = (value ^ self.get(at)) & !(0b1001_0001 << 16) != 0;
                if self.get(offset::CR) & PLLON != 0 && factors_change {
                    return misuse("the PLL is reconfigured while it runs (RM0440, section 7.4.4)");
                }
                self.set(at, value);
            }
            offset::AHB1RSTR..=offset::APB2RSTR => {
                let released = self.get(at) & !value;
                self.set(at, value);
                return Ok((released != 0).then_some((at, released)));
            }
            offset::AHB1ENR..=offset::APB2SMENR | offset::CCIPR | offset::CCIPR2 => {
                self.set(at, value);
            }
            // LSE and RTC do not exist on this board.
            offset::BDCR if value & 1 == 0 => self.set(at, value),
            offset::CSR => {
                self.lsi.switch(value & ON != 0, clock, LSI_START_S);
                let flags = match value & RMVF {
                    0 => self.get(at) & FLAGS,
                    _ => 0,
                };
                self.set(at, flags | value & ON);
            }
            offset::CRRCR => {
                self.hsi48.switch(value & ON != 0, clock, HSI48_START_S);
                self.set(at, value & ON);
            }
            _ => return Err(Refused::NotModelled),
        }
        Ok(None)
    }

    /// SW: the clock must run (section 7.2.8).
    fn select(&mut self, value: u32, clock: &Clock) -> Access {
        let is_ready = match value & 0b11 {
            0b01 => self.hsi.is_ready(clock),
            0b11 => self.pll.is_ready(clock) && self.get(offset::PLLCFGR) >> 24 & 1 != 0,
            _ => false,
        };
        if !is_ready {
            return misuse(
                "SYSCLK is switched to a clock that does not run (RM0440, section 7.2.8)",
            );
        }
        self.set(offset::CFGR, value);
        Ok(())
    }

    /// Frequency at the PLL's oscillator.
    fn vco_hz(&self) -> Access<f64> {
        let word = self.get(offset::PLLCFGR);
        if word & 0b11 != 0b10 {
            return misuse("the PLL has no source that this board has (RM0440, section 7.4.4)");
        }
        let input_hz = HSI_HZ / f64::from((word >> 4 & 0xf) + 1);
        if !PLL_INPUT_HZ.contains(&input_hz) {
            return misuse(format!(
                "the PLL's input has {:.2} MHz, and may have 2.66 to 16",
                input_hz / 1e6
            ));
        }
        let vco_hz = input_hz * f64::from(word >> 8 & 0x7f);
        match PLL_VCO_HZ.contains(&vco_hz) {
            true => Ok(vco_hz),
            false => misuse(format!(
                "the PLL's VCO has {:.1} MHz, and may have 96 to 344",
                vco_hz / 1e6
            )),
        }
    }

    fn check_pll(&self) -> Access {
        match self.get(offset::CR) & PLLON {
            0 => Ok(()),
            _ => self.vco_hz().map(drop),
        }
    }

    /// SYSCLK.
    pub(crate) fn system_hz(&self) -> Access<f64> {
        if self.get(offset::CFGR) & 0b11 == 0b01 {
            return Ok(HSI_HZ);
        }
        let divisor = 2 * ((self.get(offset::PLLCFGR) >> 25 & 0b11) + 1);
        Ok(self.vco_hz()? / f64::from(divisor))
    }

    /// HCLK.
    pub(crate) fn core_hz(&self) -> Access<f64> {
        let shift = match self.get(offset::CFGR) >> 4 & 0xf {
            field @ 8..=11 => field - 7,
            field @ 12.. => field - 6,
            _ => 0,
        };
        Ok(self.system_hz()? / f64::from(1 << shift))
    }

    /// Cycles of HCLK to one of the timers on APB1 or APB2: 1, as long as their prescaler is at most 2 (section 7.2.15).
    pub(crate) fn check_timers(&self) -> Access {
        let fields = self.get(offset::CFGR) >> 8;
        match [fields & 7, fields >> 3 & 7]
            .iter()
            .all(|field| *field <= 4)
        {
            true => Ok(()),
            false => Err(Refused::NotModelled),
        }
    }

    /// The asynchronous clock of ADC1 and ADC2 (section 7.4.27).
    pub(crate) fn adc12_hz(&self) -> Access<f64> {
        match self.get(offset::CCIPR) >> 28 & 0b11 {
            0b10 => self.system_hz(),
            0b01 => misuse("the ADCs have the clock PLL P, and this board's clocks do not use it"),
            _ => misuse("the ADCs have no clock (RM0440, section 7.4.27)"),
        }
    }

    /// Whether USB has its 48 MHz: HSI48, on (section 7.2.9).
    pub(crate) fn check_usb_clock(&self, clock: &Clock) -> Access {
        let vco_hz = || self.vco_hz();
        match self.get(offset::CCIPR) >> 26 & 0b11 {
            0b00 if self.hsi48.is_ready(clock) => Ok(()),
            0b00 => misuse("USB is used without its clock: HSI48 is off"),
            0b10 => {
                let word = self.get(offset::PLLCFGR);
                let divisor = 2 * ((word >> 21 & 0b11) + 1);
                let hz = vco_hz()? / f64::from(divisor);
                match word >> 20 & 1 != 0 && (hz - HSI48_HZ).abs() < 1.0 {
                    true => Ok(()),
                    false => misuse(format!(
                        "USB has a clock of {:.2} MHz, and needs 48",
                        hz / 1e6
                    )),
                }
            }
            _ => misuse("USB has no clock (RM0440, section 7.4.27)"),
        }
    }

    /// The watchdog starts LSI (section 42.3.3).
    pub(crate) fn force_lsi(&mut self, clock: &Clock) {
        self.lsi.switch(true, clock, LSI_START_S);
    }
}
