//! Watchdog, interrupts, and flash.

use super::{
    ADC1_2, FLASH, IWDG, Mistaken, NVIC_ENABLE, NVIC_PRIORITY, TIM1_BRK_TIM15, UART5, USB_LP,
};

pub(super) const MISTAKES: &[Mistaken] = &[
    Mistaken::writes("IWDG: it is never started", IWDG, 0xffff, 0x5555),
    Mistaken::writes("IWDG: it is never fed", IWDG, 0x2222, 0),
    Mistaken::writes("IWDG: eight times too slow", IWDG + 0x04, 0b111, 0b110),
    Mistaken::writes(
        "NVIC: the control loop below USB and time",
        NVIC_PRIORITY + UART5,
        0xf0,
        0xf0,
    ),
    Mistaken::writes("NVIC: USB above all", NVIC_PRIORITY + USB_LP, 0xf0, 0),
    Mistaken::writes(
        "NVIC: the time driver above all",
        NVIC_PRIORITY + TIM1_BRK_TIM15,
        0xf0,
        0,
    ),
    Mistaken::writes(
        "NVIC: the conversions' end is not enabled",
        NVIC_ENABLE,
        1 << ADC1_2,
        0,
    ),
    Mistaken::writes(
        "NVIC: the control loop is not enabled",
        NVIC_ENABLE + 4,
        1 << (UART5 - 32),
        0,
    ),
    Mistaken::writes("NVIC: USB is not enabled", NVIC_ENABLE, 1 << USB_LP, 0),
    Mistaken::omits("flash: its key is not given", FLASH + 0x08),
    Mistaken::writes("flash: programming is not enabled", FLASH + 0x14, 1, 0),
    Mistaken::writes(
        "flash: the page is erased in the program's own bank",
        FLASH + 0x14,
        1 << 11,
        0,
    ),
    Mistaken::writes("flash: the data cache is not reset", FLASH, 1 << 12, 0),
    Mistaken::writes(
        "flash: the data cache stays on while a page is written",
        FLASH,
        1 << 10,
        1 << 10,
    ),
];
