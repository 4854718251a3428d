//! The mistakes, each in one register.

mod clocks;
mod converters;
mod pins;
mod system;
mod timers;
mod usb;

use silicon_twin::chip::Mistake;

// Base addresses (RM0440, section 2.2.2).
const IWDG: u32 = 0x4000_3000;
const CRS: u32 = 0x4000_2000;
const USB: u32 = 0x4000_5c00;
const PWR: u32 = 0x4000_7000;
const TIM1: u32 = 0x4001_2c00;
const TIM15: u32 = 0x4001_4000;
const RCC: u32 = 0x4002_1000;
const FLASH: u32 = 0x4002_2000;
const GPIOA: u32 = 0x4800_0000;
const GPIOB: u32 = 0x4800_0400;
const GPIOC: u32 = 0x4800_0800;
const ADC1: u32 = 0x5000_0000;
const ADC2: u32 = 0x5000_0100;
const ADC12: u32 = 0x5000_0300;
// The processor's own (ARMv7-M manual, table B3-8): enables, 32 interrupts a word, and priorities, a byte each.
const NVIC_ENABLE: u32 = 0xe000_e100;
const NVIC_PRIORITY: u32 = 0xe000_e400;
/// Interrupts (RM0440, table 97): the conversions' end, USB's, the time driver's, and that of the control loop, which no
/// peripheral of this board uses.
const ADC1_2: u32 = 18;
const USB_LP: u32 = 20;
const TIM1_BRK_TIM15: u32 = 24;
const UART5: u32 = 53;

/// A mistake, and what is known of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mistaken {
    /// What is wrong, beginning with where.
    pub(super) what: &'static str,
    pub(super) mistake: Mistake,
    /// Why a start does not show it, where that is so.
    pub(super) missed_as: Option<&'static str>,
}

impl Mistaken {
    /// Whatever is written into the register at `address`, its `bits` are those of `value`.
    const fn writes(what: &'static str, address: u32, bits: u32, value: u32) -> Self {
        let mistake = Mistake {
            address,
            bits,
            value: Some(value),
        };
        Self {
            what,
            mistake,
            missed_as: None,
        }
    }

    /// The register at `address` is never written.
    const fn omits(what: &'static str, address: u32) -> Self {
        let mistake = Mistake {
            address,
            bits: 0,
            value: None,
        };
        Self {
            what,
            mistake,
            missed_as: None,
        }
    }

    const fn missed_as(self, why: &'static str) -> Self {
        Self {
            missed_as: Some(why),
            ..self
        }
    }
}

/// All of them, those of one part of the chip side by side.
pub(super) fn mistakes() -> Vec<Mistaken> {
    [
        clocks::MISTAKES,
        pins::MISTAKES,
        timers::MISTAKES,
        converters::MISTAKES,
        system::MISTAKES,
        usb::MISTAKES,
    ]
    .concat()
}
