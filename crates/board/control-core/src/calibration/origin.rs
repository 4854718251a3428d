//! Where a calibration came from.

use core::fmt;

/// A short text of fixed size, padded with zeros.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Label([u8; Label::CAPACITY]);

impl Label {
    /// Most bytes that it holds: as many as a text of the protocol, so that any board's name fits.
    pub const CAPACITY: usize = 48;

    /// No text.
    pub const EMPTY: Self = Self([0; Self::CAPACITY]);

    /// `text`, or `None` where it is too long or holds a character that does something to a terminal and shows nothing.
    pub const fn new(text: &str) -> Option<Self> {
        let text = text.as_bytes();
        if text.len() > Self::CAPACITY {
            return None;
        }
        let mut bytes = [0; Self::CAPACITY];
        let mut i = 0;
        while i < text.len() {
            if text[i].is_ascii_control() {
                return None;
            }
            bytes[i] = text[i];
            i += 1;
        }
        Some(Self(bytes))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        let end = self.0.iter().position(|byte| *byte == 0);
        core::str::from_utf8(&self.0[..end.unwrap_or(Self::CAPACITY)]).unwrap_or("")
    }

    pub(super) fn to_bytes(self) -> [u8; Self::CAPACITY] {
        self.0
    }

    /// `None` where the bytes are no text, or something follows its end.
    pub(super) fn from_bytes(bytes: [u8; Self::CAPACITY]) -> Option<Self> {
        let text = core::str::from_utf8(&bytes).ok()?;
        Self::new(text.trim_end_matches('\0'))
    }
}

impl fmt::Debug for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), f)
    }
}

/// Which mirror a calibration is for, and what it came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Origin {
    /// The mirror.
    pub device: Label,
    /// When it was measured, as the tool writes it.
    pub date: Label,
    /// Hash of the model file that it inverts.
    pub model_hash: u64,
}
