//! Clocks of the core and of the peripherals, and the wait states that go with them.

use super::{CRS, FLASH, Mistaken, PWR, RCC};

pub(super) const MISTAKES: &[Mistaken] = &[
    Mistaken::writes(
        "core: boost mode is not switched on",
        PWR + 0x80,
        1 << 8,
        1 << 8,
    ),
    Mistaken::writes("core: PLL times 86", RCC + 0x0c, 0x7f << 8, 86 << 8),
    Mistaken::writes(
        "core: PLL times 80, so 160 MHz",
        RCC + 0x0c,
        0x7f << 8,
        80 << 8,
    ),
    Mistaken::writes("core: PLL input divided by 3", RCC + 0x0c, 0xf << 4, 2 << 4),
    Mistaken::writes("core: the PLL's output is off", RCC + 0x0c, 1 << 24, 0),
    Mistaken::writes(
        "core: APB2 divided by 4",
        RCC + 0x08,
        0b111 << 11,
        0b101 << 11,
    ),
    Mistaken::writes("core: AHB divided by 2", RCC + 0x08, 0xf << 4, 0b1000 << 4),
    Mistaken::writes("flash: three wait states", FLASH, 0xf, 3),
    Mistaken::writes("clocks: HSI48 stays off", RCC + 0x98, 1, 0),
    Mistaken::writes(
        "clocks: USB from PLL Q, which is off",
        RCC + 0x88,
        0b11 << 26,
        0b10 << 26,
    ),
    Mistaken::writes("clocks: none for the ADCs", RCC + 0x88, 0b11 << 28, 0),
    Mistaken::writes("clocks: ADC12 is not enabled", RCC + 0x4c, 1 << 13, 0),
    Mistaken::writes("clocks: GPIOC is not enabled", RCC + 0x4c, 1 << 2, 0),
    Mistaken::writes("clocks: TIM1 is not enabled", RCC + 0x60, 1 << 11, 0),
    Mistaken::writes("clocks: USB is not enabled", RCC + 0x58, 1 << 23, 0),
    Mistaken::writes("clocks: CRS is not enabled", RCC + 0x58, 1 << 8, 0),
    Mistaken::writes("clocks: CRS does not trim", CRS, 1 << 6, 0),
    Mistaken::writes(
        "clocks: CRS follows the wrong signal",
        CRS + 0x04,
        0b11 << 28,
        0,
    ),
];
