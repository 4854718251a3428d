//! One record in one slot.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use embedded_storage::nor_flash::NorFlash;

use crate::error::StoreError;

/// CRC-32 as in Ethernet; without a table, since flash is scarcer than time here.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Marks the start of a record: `CAL1`.
const MAGIC: u32 = u32::from_le_bytes(*b"CAL1");

/// Bytes that are read or written at a time, and those before the payload: header and seal.
const CHUNK: usize = 32;

/// Where the seal lies, and what it reads: half of its bits are ones, so that neither erasing nor overwriting it brings
/// the rest closer to it.
const SEAL_AT: usize = 16;
const SEAL: [u8; SEAL_BYTES] = *b"\x5a\xc3\x96\x3c\xa5\x69\x0f\xf0\xc3\x5a\x3c\x96\x69\xa5\xf0\x0f";
const SEAL_BYTES: usize = CHUNK - SEAL_AT;
/// A seal of which so many bits have fallen over still is one; of 128 bits at random, 64 differ, and 16 or fewer in one
/// case of 10^19.
const SEAL_MAY_DIFFER: u32 = 16;

/// What erased flash reads as.
const ERASED: u8 = 0xff;

/// What a record says of itself. The CRC covers the rest of the header, and the payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Header {
    sequence: u32,
    length: u32,
    crc: u32,
}

impl Header {
    /// Length in flash, with the seal.
    pub(crate) const BYTES: usize = CHUNK;

    pub(crate) fn of(sequence: u32, payload: &[u8]) -> Self {
        let length = payload.len() as u32;
        let mut digest = CRC.digest();
        digest.update(&sequence.to_le_bytes());
        digest.update(&length.to_le_bytes());
        digest.update(payload);
        Self {
            sequence,
            length,
            crc: digest.finalize(),
        }
    }

    pub(crate) fn sequence(&self) -> u32 {
        self.sequence
    }

    /// Length of the payload.
    pub(crate) fn length(&self) -> usize {
        self.length as usize
    }

    fn to_bytes(self) -> [u8; SEAL_AT] {
        let mut bytes = [ERASED; SEAL_AT];
        let words = [MAGIC, self.sequence, self.length, self.crc];
        for (slot, word) in bytes.chunks_exact_mut(4).zip(words) {
            slot.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    fn from_bytes(bytes: &[u8; CHUNK]) -> Option<Self> {
        let word = |i: usize| {
            u32::from_le_bytes([
                bytes[4 * i],
                bytes[4 * i + 1],
                bytes[4 * i + 2],
                bytes[4 * i + 3],
            ])
        };
        (word(0) == MAGIC).then(|| Self {
            sequence: word(1),
            length: word(2),
            crc: word(3),
        })
    }
}

/// One slot of the ring.
pub(crate) struct Slot<'a, F, const BYTES: usize> {
    flash: &'a mut F,
    start: u32,
}

impl<'a, F: NorFlash, const BYTES: usize> Slot<'a, F, BYTES> {
    pub(crate) fn new(flash: &'a mut F, index: u32) -> Self {
        Self {
            flash,
            start: index * BYTES as u32,
        }
    }

    /// The header, where the record that it heads is whole.
    pub(crate) fn whole_record(&mut self) -> Result<Option<Header>, StoreError> {
        let Some(header) = Header::from_bytes(&self.chunk(0)?) else {
            return Ok(None);
        };
        if header.length() > BYTES - CHUNK {
            return Ok(None);
        }
        let mut digest = CRC.digest();
        digest.update(&header.sequence.to_le_bytes());
        digest.update(&header.length.to_le_bytes());
        for at in (0..header.length()).step_by(CHUNK) {
            let length = CHUNK.min(header.length() - at);
            digest.update(&self.chunk(CHUNK + at)?[..length]);
        }
        Ok((digest.finalize() == header.crc).then_some(header))
    }

    pub(crate) fn read_payload(&mut self, payload: &mut [u8]) -> Result<(), StoreError> {
        for (piece, at) in payload.chunks_mut(CHUNK).zip((CHUNK..).step_by(CHUNK)) {
            piece.copy_from_slice(&self.chunk(at)?[..piece.len()]);
        }
        Ok(())
    }

    /// Whether nothing was written since the slot was erased.
    pub(crate) fn is_blank(&mut self) -> Result<bool, StoreError> {
        for at in (0..BYTES).step_by(CHUNK) {
            if self.chunk(at)? != [ERASED; CHUNK] {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Whether the record in the slot was whole once, and is the last that was stored.
    pub(crate) fn is_sealed(&mut self) -> Result<bool, StoreError> {
        let chunk = self.chunk(0)?;
        let differ: u32 = chunk[SEAL_AT..]
            .iter()
            .zip(SEAL)
            .map(|(byte, seal)| (byte ^ seal).count_ones())
            .sum();
        Ok(differ <= SEAL_MAY_DIFFER)
    }

    /// Takes the seal off a record that another follows. Zeros may be written over anything (RM0440, section 3.3.8).
    pub(crate) fn unseal(&mut self) -> Result<(), StoreError> {
        if self.is_sealed()? {
            self.write_bytes(SEAL_AT, &[0; SEAL_BYTES])?;
        }
        Ok(())
    }

    /// Erases the slot, writes a record, reads it back, and seals it.
    pub(crate) fn write(&mut self, header: &Header, payload: &[u8]) -> Result<(), StoreError> {
        // A seal that outlived half an erasure would speak of a record that nobody misses.
        self.unseal()?;
        self.erase().map_err(|_| StoreError::WornOut)?;
        for (piece, at) in payload.chunks(CHUNK).zip((CHUNK..).step_by(CHUNK)) {
            self.write_chunk(at, piece)?;
        }
        // Last, so that what is cut off has no header.
        self.write_bytes(0, &header.to_bytes())?;
        if self.whole_record()? != Some(*header) {
            return Err(StoreError::WornOut);
        }
        self.write_bytes(SEAL_AT, &SEAL)
    }

    fn erase(&mut self) -> Result<(), F::Error> {
        self.flash.erase(self.start, self.start + BYTES as u32)
    }

    fn chunk(&mut self, at: usize) -> Result<[u8; CHUNK], StoreError> {
        let mut bytes = [0; CHUNK];
        self.flash
            .read(self.start + at as u32, &mut bytes)
            .map_err(|_| StoreError::Unreadable)?;
        Ok(bytes)
    }

    /// Writes up to a chunk, filled up to whole words with what is erased already.
    fn write_chunk(&mut self, at: usize, piece: &[u8]) -> Result<(), StoreError> {
        let mut bytes = [ERASED; CHUNK];
        bytes[..piece.len()].copy_from_slice(piece);
        let length = piece.len().next_multiple_of(F::WRITE_SIZE);
        self.write_bytes(at, &bytes[..length])
    }

    /// Writes whole words.
    fn write_bytes(&mut self, at: usize, words: &[u8]) -> Result<(), StoreError> {
        self.flash
            .write(self.start + at as u32, words)
            .map_err(|_| StoreError::WornOut)
    }
}
