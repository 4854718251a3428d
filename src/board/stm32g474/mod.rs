//! The driver PCB, and a Nucleo-G474RE as its stand-in on the bench: STM32G474RE at 170 MHz.
//!
//! Pins, shunts and filters are explained in `docs/board.md`.

pub mod bootloader;
mod converters;
mod endpoints;
pub mod flash;
pub mod link;
mod stop;

pub use stop::origin;

pub use converters::{ConverterPins, Converters, start_control};

use defmt_rtt as _;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::rcc::{
    Hsi48Config, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk, mux::Adcsel, mux::Clk48sel,
};
use embassy_stm32::{Config, pac};

/// PWR_CR5: range 1 in normal mode (RM0440, section 6.4.22; `PWR_CR5_R1MODE` in ST's `stm32g474xx.h`).
const R1MODE: u32 = 1 << 8;

/// Raises the core's voltage, without which it may run at 150 MHz at most (RM0440, section 6.1.5). Call it before
/// [`embassy_stm32::init`]: the bit that `stm32-metapac` 21 has for this is another one, so `Config::boost` does not do
/// it.
pub fn raise_core_voltage() {
    pac::RCC.apb1enr1().modify(|w| w.set_pwren(true));
    pac::PWR.cr5().modify(|w| w.0 &= !R1MODE);
}

/// Clocks: 170 MHz from the internal 16 MHz oscillator, and 48 MHz for USB from the HSI48, which is
/// trimmed by the host's start-of-frame packets, so that the board needs no crystal.
pub fn clocks() -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hsi48 = Some(Hsi48Config {
        sync_from_usb: true,
    });
    rcc.pll = Some(Pll {
        source: PllSource::HSI,
        prediv: PllPreDiv::DIV4,
        mul: PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    rcc.sys = Sysclk::PLL1_R;
    // The wait states of boost mode, in which [`raise_core_voltage`] has put the core.
    rcc.boost = true;
    rcc.mux.adc12sel = Adcsel::SYS;
    rcc.mux.clk48sel = Clk48sel::HSI48;
    config
}

/// Lets the control loop, and USB, interrupt the timer that embassy's time is counted by: its interrupt is enabled
/// at the highest priority there is. Call it once [`embassy_stm32::init`] has started it.
pub fn lower_time_driver() {
    interrupt::TIM1_BRK_TIM15.set_priority(Priority::P3);
}
