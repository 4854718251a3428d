//! The converters of currents, supply and position.

use super::{ADC1, ADC2, ADC12, Mistaken};

pub(super) const MISTAKES: &[Mistaken] = &[
    Mistaken::writes(
        "ADC1: started by another trigger",
        ADC1 + 0x4c,
        0x1f << 2,
        0,
    ),
    Mistaken::writes("ADC1: started by no trigger", ADC1 + 0x4c, 0b11 << 7, 0),
    Mistaken::writes("ADC2: started by no trigger", ADC2 + 0x4c, 0b11 << 7, 0),
    Mistaken::writes("ADC1: three conversions of four", ADC1 + 0x4c, 0b11, 2),
    Mistaken::writes(
        "ADC1: the first two inputs exchanged",
        ADC1 + 0x4c,
        0x7df << 9,
        (2 | 1 << 6) << 9,
    ),
    Mistaken::writes(
        "ADC1: an input that is not connected",
        ADC1 + 0x4c,
        0x1f << 9,
        9 << 9,
    ),
    Mistaken::writes(
        "ADC1: sampling for 640.5 clocks",
        ADC1 + 0x14,
        0b111 << 3,
        0b111 << 3,
    ),
    Mistaken::writes("ADC1: sampling for 2.5 clocks", ADC1 + 0x14, 0b111 << 3, 0),
    Mistaken::writes("ADC1: no oversampling", ADC1 + 0x10, 1 << 1, 0),
    Mistaken::writes(
        "ADC1: eightfold oversampling",
        ADC1 + 0x10,
        0b111 << 2,
        0b010 << 2,
    ),
    Mistaken::writes("ADC2: results shifted", ADC2 + 0x10, 0xf << 5, 4 << 5),
    Mistaken::writes(
        "ADC1: its sequence's end does not interrupt",
        ADC1 + 0x04,
        1 << 6,
        0,
    ),
    Mistaken::writes(
        "ADC1: each conversion's end interrupts",
        ADC1 + 0x04,
        1 << 5,
        1 << 5,
    ),
    Mistaken::omits("ADC1: the end's flag is never cleared", ADC1),
    Mistaken::writes("ADC1: not calibrated", ADC1 + 0x08, 1 << 31, 0),
    Mistaken::writes("ADC2: without its regulator", ADC2 + 0x08, 1 << 28, 0),
    Mistaken::writes(
        "ADC12: its clock is not divided",
        ADC12 + 0x08,
        0xf << 18,
        0,
    ),
];
