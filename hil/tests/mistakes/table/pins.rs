//! Pins: their modes, functions and levels.

use super::{GPIOA, GPIOB, GPIOC, Mistaken};

pub(super) const MISTAKES: &[Mistaken] = &[
    Mistaken::writes(
        "pins: drive 1 on alternate function 1",
        GPIOC + 0x20,
        0xf,
        1,
    ),
    Mistaken::writes("pins: drive 2 stays an input", GPIOC, 0b11 << 2, 0),
    Mistaken::writes(
        "pins: drive 3 is an open drain",
        GPIOC + 0x04,
        1 << 2,
        1 << 2,
    ),
    Mistaken::writes(
        "pins: drive 4 is a plain output",
        GPIOC,
        0b11 << 6,
        0b01 << 6,
    ),
    Mistaken::writes("pins: current sense 1 is an input", GPIOA, 0b11, 0),
    Mistaken::writes("pins: current sense 4 is an input", GPIOB, 0b11 << 2, 0),
    Mistaken::writes("pins: the supply's sense is an input", GPIOC, 0b11 << 10, 0),
    Mistaken::writes(
        "pins: the position sensor's is an input",
        GPIOB,
        0b11 << 4,
        0,
    ),
    Mistaken::writes(
        "pins: the comparators' line stays an input",
        GPIOB,
        0b11 << 24,
        0,
    ),
    Mistaken::writes(
        "pins: the comparators' line on alternate function 5",
        GPIOB + 0x24,
        0xf << 16,
        5 << 16,
    ),
    Mistaken::writes(
        "pins: the load switch's enable stays an input",
        GPIOC,
        0b11 << 24,
        0,
    ),
    Mistaken::writes(
        "pins: the load switch's enable is an open drain",
        GPIOC + 0x04,
        1 << 12,
        1 << 12,
    ),
    Mistaken::writes(
        "pins: the load switch is never switched on",
        GPIOC + 0x18,
        1 << 12,
        0,
    ),
    Mistaken::writes(
        "pins: the load switch is never switched off",
        GPIOC + 0x18,
        1 << 28,
        0,
    ),
];
