//! One entry, as it lies in flash: header, payload, and what is left erased.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

/// CRC-32 as in Ethernet; without a table, since flash is scarcer than time here.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Marks an entry: `LOG1`.
const MAGIC: [u8; 4] = *b"LOG1";

/// Bytes of a slot.
pub(crate) const ENTRY_BYTES: usize = 128;
const HEADER_BYTES: usize = 16;

/// Longest payload, bytes.
pub const MAX_BYTES: usize = ENTRY_BYTES - HEADER_BYTES;

/// A slot that nothing was written to since its page was erased.
pub(crate) const ERASED: [u8; ENTRY_BYTES] = [0xff; ENTRY_BYTES];

/// What an entry says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Header {
    pub(crate) number: u32,
    length: u32,
}

impl Header {
    /// The header of what lies in a slot, where that is a whole entry. Once in the image is enough of it.
    #[inline(never)]
    pub(crate) fn of(bytes: &[u8; ENTRY_BYTES]) -> Option<Self> {
        let word = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
        let header = Self {
            number: word(4)?,
            length: word(8)?,
        };
        let payload = header.payload(bytes)?;
        let is_whole = bytes.starts_with(&MAGIC) && word(12)? == header.crc(payload);
        is_whole.then_some(header)
    }

    /// What the entry holds; `None` where it cannot be as long.
    pub(crate) fn payload(self, bytes: &[u8; ENTRY_BYTES]) -> Option<&[u8]> {
        let end = HEADER_BYTES.checked_add(self.length as usize)?;
        bytes.get(HEADER_BYTES..end)
    }

    fn crc(self, payload: &[u8]) -> u32 {
        let mut digest = CRC.digest();
        digest.update(&self.number.to_le_bytes());
        digest.update(&self.length.to_le_bytes());
        digest.update(payload);
        digest.finalize()
    }
}

/// An entry, and what is left erased of its slot. A payload beyond [`MAX_BYTES`] is left out.
pub(crate) fn to_bytes(number: u32, payload: &[u8]) -> [u8; ENTRY_BYTES] {
    let header = Header {
        number,
        length: payload.len() as u32,
    };
    let crc = header.crc(payload).to_le_bytes();
    let parts = [
        &MAGIC[..],
        &number.to_le_bytes(),
        &header.length.to_le_bytes(),
        &crc,
        payload,
    ];
    let mut entry = ERASED;
    for (slot, byte) in entry.iter_mut().zip(parts.into_iter().flatten()) {
        *slot = *byte;
    }
    entry
}

/// Bytes of an entry that are written.
pub(crate) fn length(payload: &[u8]) -> usize {
    HEADER_BYTES + payload.len()
}
