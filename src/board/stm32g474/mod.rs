//! The driver PCB, and a Nucleo-G474RE as its stand-in on the bench: STM32G474RE at 170 MHz.
//!
//! Pins, shunts and filters are explained in `docs/board.md`.

pub mod bootloader;
mod converters;
pub mod flash;
pub mod link;
mod stop;

pub use stop::origin;

pub use converters::{ConverterPins, Converters, start_control};

use defmt_rtt as _;
use embassy_stm32::Config;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::rcc::{
    Hsi48Config, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk, mux::Adcsel, mux::Clk48sel,
};

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
    // Required above 150 MHz (RM0440, section 6.1.5).
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
