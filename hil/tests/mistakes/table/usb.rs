//! USB, device and full speed.

use super::{Mistaken, USB};

pub(super) const MISTAKES: &[Mistaken] = &[
    Mistaken::writes("USB: the pull-up stays off", USB + 0x58, 1 << 15, 0),
    Mistaken::writes("USB: transfers do not interrupt", USB + 0x40, 1 << 15, 0),
    Mistaken::writes("USB: a reset does not interrupt", USB + 0x40, 1 << 10, 0),
    Mistaken::writes("USB: the function is not enabled", USB + 0x4c, 1 << 7, 0),
    Mistaken::writes("USB: an address that is one too high", USB + 0x4c, 1, 0),
    Mistaken::writes("USB: endpoint 0 is a bulk endpoint", USB, 0b11 << 9, 0),
    Mistaken::writes(
        "USB: the buffer table is elsewhere",
        USB + 0x50,
        0x3f8,
        0x40,
    ),
    Mistaken::omits("USB: events are never cleared", USB + 0x44),
];
