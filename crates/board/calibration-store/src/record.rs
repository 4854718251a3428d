//! One record in one slot.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use embedded_storage::nor_flash::NorFlash;

use crate::StoreError;

/// CRC-32 as in Ethernet; without a table, since flash is scarcer than time here.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Marks the start of a record: `CAL1`.
const MAGIC: u32 = u32::from_le_bytes(*b"CAL1");

/// Bytes that are read or written at a time, and the length of a header.
const CHUNK: usize = 32;

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
    /// Length in flash.
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

    fn to_bytes(self) -> [u8; CHUNK] {
        let mut bytes = [ERASED; CHUNK];
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

    /// Erases the slot, writes a record, and reads it back.
    pub(crate) fn write(&mut self, header: &Header, payload: &[u8]) -> Result<(), StoreError> {
        self.erase().map_err(|_| StoreError::WornOut)?;
        for (piece, at) in payload.chunks(CHUNK).zip((CHUNK..).step_by(CHUNK)) {
            self.write_chunk(at, piece)?;
        }
        // Last, so that what is cut off has no header.
        self.write_chunk(0, &header.to_bytes())?;
        match self.whole_record()? == Some(*header) {
            true => Ok(()),
            false => Err(StoreError::WornOut),
        }
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
        self.flash
            .write(self.start + at as u32, &bytes[..length])
            .map_err(|_| StoreError::WornOut)
    }
}
