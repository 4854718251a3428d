//! The timer of the PWM, and the one that tells the time.

use super::{Mistaken, TIM1, TIM15};

pub(super) const MISTAKES: &[Mistaken] = &[
    Mistaken::writes("TIM1: a period of 4251", TIM1 + 0x2c, 0xffff, 4250),
    Mistaken::writes("TIM1: an update every third period", TIM1 + 0x30, 0xffff, 2),
    Mistaken::writes("TIM1: an update every period", TIM1 + 0x30, 0xffff, 0),
    Mistaken::writes("TIM1: channel 1 without preload", TIM1 + 0x18, 1 << 3, 0),
    Mistaken::writes("TIM1: channel 4 without preload", TIM1 + 0x1c, 1 << 11, 0),
    Mistaken::writes(
        "TIM1: channel 1 in PWM mode 2",
        TIM1 + 0x18,
        0b111 << 4,
        0b111 << 4,
    ),
    Mistaken::writes("TIM1: channel 3 frozen", TIM1 + 0x1c, 0b111 << 4, 0),
    Mistaken::writes("TIM1: channel 2 is not enabled", TIM1 + 0x20, 1 << 4, 0),
    Mistaken::writes("TIM1: channel 3 is inverted", TIM1 + 0x20, 1 << 9, 1 << 9),
    Mistaken::writes("TIM1: outputs are never enabled", TIM1 + 0x44, 1 << 15, 0),
    Mistaken::writes(
        "TIM1: outputs are enabled from the start",
        TIM1 + 0x44,
        1 << 15,
        1 << 15,
    ),
    Mistaken::writes("TIM1: disabled outputs float", TIM1 + 0x44, 1 << 10, 0)
        .missed_as("the board's pull-downs hold them low as well"),
    Mistaken::writes(
        "TIM1: its break input is not enabled",
        TIM1 + 0x44,
        1 << 12,
        0,
    ),
    Mistaken::writes(
        "TIM1: its break input is active high",
        TIM1 + 0x44,
        1 << 13,
        1 << 13,
    ),
    Mistaken::writes(
        "TIM1: outputs come back by themselves after a break",
        TIM1 + 0x44,
        1 << 14,
        1 << 14,
    ),
    Mistaken::writes(
        "TIM1: a break's flag is never cleared",
        TIM1 + 0x10,
        1 << 7,
        1 << 7,
    ),
    Mistaken::writes("TIM1: channel 1 idles high", TIM1 + 0x04, 1 << 8, 1 << 8),
    Mistaken::writes("TIM1: TRGO2 is not the update", TIM1 + 0x04, 0xf << 20, 0),
    Mistaken::writes("TIM1: it is not started", TIM1, 1, 0),
    Mistaken::writes("TIM1: its limit without preload", TIM1, 1 << 7, 0)
        .missed_as("the firmware writes it once, while the timer stands"),
    Mistaken::omits("TIM1: compare 2 is never written", TIM1 + 0x38),
    Mistaken::omits("TIM1: the update's flag is never cleared", TIM1 + 0x10),
    Mistaken::writes("TIM15: time at half speed", TIM15 + 0x28, 0xffff, 339),
    Mistaken::writes("TIM15: it is not started", TIM15, 1, 0),
];
