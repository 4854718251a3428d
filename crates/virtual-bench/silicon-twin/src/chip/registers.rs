//! What is behind the addresses of the peripherals' registers.

use super::adc::{self, Adc};
use super::crs::Crs;
use super::refused::{Access, Refused, misuse};
use super::small::Syscfg;
use super::timer::Timer;
use super::usb::Usb;
use super::{Chip, address, rcc};
use crate::names;

impl Chip {
    /// The core's clock after what was written, where it may have it.
    fn follow_clock(&mut self) -> Access {
        let p = &self.peripherals;
        let hz = p.rcc.core_hz()?;
        p.pwr.check(hz, p.flash.wait_states())?;
        p.rcc.check_timers()?;
        if hz != self.clock.hz() {
            self.settle();
            self.clock.change(hz);
        }
        Ok(())
    }

    pub(super) fn read_register(&mut self, at: u32) -> Access<u32> {
        self.check_gate(at)?;
        let (p, clock) = (&mut self.peripherals, &self.clock);
        let offset = at & 0x3ff;
        match at & !0x3ff {
            address::RCC => p.rcc.read(offset, clock),
            address::PWR => p.pwr.read(offset),
            address::FLASH => p.flash.read(offset),
            address::TIM1 => p.tim1.read(offset, clock.cycles),
            address::TIM15 => p.tim15.read(offset, clock.cycles),
            address::IWDG => p.iwdg.read(offset, clock),
            address::CRS => p.crs.read(offset),
            address::USB => p.usb.read(offset),
            address::SYSCFG => p.syscfg.read(offset),
            address::EXTI => p.exti.read(offset),
            address::DBGMCU => p.dbgmcu.read(offset),
            address::ADC1 => match offset {
                0x300.. => p.adc_common.read(offset - 0x300),
                _ => p.adcs[adc_index(offset)?].read(offset & 0xff, clock),
            },
            _ => match port(at) {
                Some(port) => p.ports[port as usize].read(offset),
                None => Err(Refused::NotModelled),
            },
        }
    }

    pub(super) fn write_register(&mut self, at: u32, value: u32) -> Access {
        self.check_gate(at)?;
        let Some(value) = self.mistaken(at, value) else {
            return Ok(());
        };
        let offset = at & 0x3ff;
        let base = at & !0x3ff;
        if base == address::TIM1 || port(at).is_some() {
            self.settle();
        }
        let (p, clock) = (&mut self.peripherals, &self.clock);
        match base {
            address::RCC => {
                let released = p.rcc.write(offset, value, clock)?;
                if let Some((register, bits)) = released {
                    self.reset_peripherals(register, bits)?;
                }
                self.follow_clock()?;
            }
            address::PWR => {
                p.pwr.write(offset, value)?;
                self.follow_clock()?;
            }
            address::FLASH => {
                p.flash.write(offset, value, clock)?;
                self.follow_clock()?;
            }
            address::TIM1 => {
                if Timer::is_compare(offset) {
                    self.trace.written(clock.cycles);
                }
                let is_update = p.tim1.write(offset, value, clock.cycles)?;
                if is_update {
                    self.update(self.clock.cycles);
                }
            }
            address::TIM15 => drop(p.tim15.write(offset, value, clock.cycles)?),
            address::IWDG => {
                if p.iwdg.write(offset, value, clock)? {
                    p.rcc.force_lsi(clock);
                }
            }
            address::CRS => p.crs.write(offset, value)?,
            address::USB => {
                let crs = p.crs.check_for_usb();
                let clocked = p.rcc.check_usb_clock(clock).and(crs);
                p.usb.write(offset, value, clock, clocked)?;
            }
            address::SYSCFG => p.syscfg.write(offset, value)?,
            address::EXTI => p.exti.write(offset, value)?,
            address::DBGMCU => p.dbgmcu.write(offset, value)?,
            address::ADC1 => match offset {
                0x300.. => p.adc_common.write(offset - 0x300, value)?,
                _ => {
                    let hz = p.adc_common.hz(&p.rcc);
                    p.adcs[adc_index(offset)?].write(offset & 0xff, value, clock, hz)?;
                }
            },
            _ => match port(at) {
                Some(port) => p.ports[port as usize].write(offset, value)?,
                None => return Err(Refused::NotModelled),
            },
        }
        let p = &self.peripherals;
        if base == address::TIM1 || port(at).is_some() {
            self.pins.follow(&p.ports, &p.tim1);
        }
        Ok(())
    }

    /// What the driver writes that means to write `value`; nothing, where that is its mistake.
    pub(super) fn mistaken(&self, at: u32, value: u32) -> Option<u32> {
        match self.mistake {
            Some(mistake) if mistake.address == at => mistake
                .value
                .map(|wrong| value & !mistake.bits | wrong & mistake.bits),
            _ => Some(value),
        }
    }

    /// A peripheral whose clock is off does not answer (RM0440, section 7.2.17).
    pub(super) fn check_gate(&self, at: u32) -> Access {
        use rcc::gate;
        let rcc = &self.peripherals.rcc;
        let is_on = match at & !0x3ff {
            address::PWR => rcc.is_on(gate::PWR),
            address::TIM1 => rcc.is_on(gate::TIM1),
            address::TIM15 => rcc.is_on(gate::TIM15),
            address::CRS => rcc.is_on(gate::CRS),
            address::USB | address::USBRAM => rcc.is_on(gate::USB),
            address::SYSCFG => rcc.is_on(gate::SYSCFG),
            address::ADC1 => rcc.is_on(gate::ADC12),
            _ => port(at).is_none_or(|port| rcc.is_port_on(port)),
        };
        match is_on {
            true => Ok(()),
            false => {
                let name = names::register(at);
                misuse(format!(
                    "{name} is used while its peripheral has no clock (RM0440, section 7.2.17)"
                ))
            }
        }
    }

    /// Bits of a reset register are released.
    fn reset_peripherals(&mut self, register: u32, bits: u32) -> Access {
        let p = &mut self.peripherals;
        let is = |(enable, bit): (u32, u32)| register == enable - 0x20 && bits >> bit & 1 != 0;
        if is(rcc::gate::TIM1) {
            p.tim1 = Timer::tim1();
        }
        if is(rcc::gate::TIM15) {
            p.tim15 = Timer::tim15();
        }
        if is(rcc::gate::ADC12) {
            p.adcs = [Adc::new("ADC1"), Adc::new("ADC2")];
            p.adc_common = adc::Common::default();
        }
        if is(rcc::gate::CRS) {
            p.crs = Crs::new();
        }
        if is(rcc::gate::USB) {
            p.usb = Usb::new();
        }
        if is(rcc::gate::SYSCFG) {
            p.syscfg = Syscfg::new();
        }
        self.pins.follow(&p.ports, &p.tim1);
        Ok(())
    }
}

/// Which of the two converters has a register at this offset.
fn adc_index(offset: u32) -> Access<usize> {
    match offset >> 8 {
        index @ (0 | 1) => Ok(index as usize),
        _ => Err(Refused::NotModelled),
    }
}

fn port(at: u32) -> Option<u32> {
    let port = at.checked_sub(address::GPIO)? >> 10;
    (port < address::GPIO_PORTS).then_some(port)
}
