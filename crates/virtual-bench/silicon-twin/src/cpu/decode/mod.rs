//! From half-words to instructions.

mod fields;
mod float;
mod narrow;
mod registers;
mod wide;

use super::instruction::{Decoded, is_wide};

/// Decodes the instruction that begins with `first`; `second` counts where it is one of two half-words.
pub fn decode(first: u16, second: u16) -> Decoded {
    match is_wide(first) {
        false => Decoded {
            instruction: narrow::decode(u32::from(first)),
            bytes: 2,
        },
        true => Decoded {
            instruction: wide::decode(u32::from(first), u32::from(second)),
            bytes: 4,
        },
    }
}
