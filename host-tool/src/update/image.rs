//! The firmware image in an ELF file, checked before anything is erased.

use mirror_protocol::usb::{IMAGE_MARK, PRODUCT};
use object::Endianness;
use object::elf::{EM_ARM, PT_LOAD};
use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};

/// Where programs lie on the driver board, up to the flash for calibrations.
const FLASH: std::ops::Range<u32> = 0x0800_0000..0x0807_8000;
/// Where the stack may begin: SRAM1, SRAM2 and the CCM, seen as one.
const RAM: std::ops::RangeInclusive<u32> = 0x2000_0000..=0x2002_0000;
/// The processor's own vectors.
const VECTORS_BYTES: usize = 64;
/// Bytes that the flash writes together.
const WORD_BYTES: usize = 8;
/// What erased flash reads as.
const ERASED: u8 = 0xff;

/// Bytes for the flash, from its start on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image(Vec<u8>);

/// Why a file is no firmware for the driver board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ImageError {
    /// Not an ELF file of 32 bits.
    #[error("it is no ELF file, as `cargo xtask build stm32g474` makes one")]
    NotElf,
    /// For another kind of processor.
    #[error("it is for another kind of processor")]
    Processor,
    /// Something lies outside the board's flash.
    #[error("it is for another board: a part of it lies at {address:#010x}")]
    Address {
        /// Where.
        address: u32,
    },
    /// It does not begin where the processor does.
    #[error("nothing of it lies at the start of the flash, where the processor begins")]
    Start,
    /// The first two vectors are not a stack and an entry.
    #[error("its vectors are broken: stack {stack:#010x}, entry {entry:#010x}")]
    Vectors {
        /// Initial stack pointer.
        stack: u32,
        /// Reset vector.
        entry: u32,
    },
    /// The name of the product is not in it.
    #[error("it is not the firmware of this board: it does not hold the name `{PRODUCT}`")]
    Stranger,
}

impl Image {
    /// The address of its first byte.
    pub const START: u32 = FLASH.start;

    /// Reads and checks an ELF file.
    ///
    /// # Errors
    /// Says why it is no firmware for the driver board.
    pub fn from_elf(elf: &[u8]) -> Result<Self, ImageError> {
        let file = ElfFile32::<Endianness>::parse(elf).map_err(|_| ImageError::NotElf)?;
        let endian = file.endian();
        if file.elf_header().e_machine(endian) != EM_ARM {
            return Err(ImageError::Processor);
        }
        let mut bytes = Vec::new();
        for header in file.elf_program_headers() {
            if header.p_type(endian) != PT_LOAD || header.p_filesz(endian) == 0 {
                continue;
            }
            let address = header.p_paddr(endian);
            let segment = header.data(endian, elf).map_err(|()| ImageError::NotElf)?;
            let end = u64::from(address) + segment.len() as u64;
            if address < FLASH.start || end > u64::from(FLASH.end) {
                return Err(ImageError::Address { address });
            }
            let at = (address - FLASH.start) as usize;
            bytes.resize(bytes.len().max(at + segment.len()), ERASED);
            bytes[at..at + segment.len()].copy_from_slice(segment);
        }
        Self::from_bytes(bytes)
    }

    /// Takes what is written from the start of the flash on, and checks it.
    ///
    /// # Errors
    /// Says why it is no firmware for the driver board.
    pub fn from_bytes(mut bytes: Vec<u8>) -> Result<Self, ImageError> {
        if bytes.len() > FLASH.len() {
            return Err(ImageError::Address { address: FLASH.end });
        }
        bytes.resize(bytes.len().next_multiple_of(WORD_BYTES), ERASED);
        let image = Self(bytes);
        image.check()?;
        Ok(image)
    }

    /// The bytes: whole words of the flash.
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }

    /// Version and commit, as the firmware within says them; `None` of one that does not.
    pub fn says(&self) -> Option<(&str, &str)> {
        let mark = IMAGE_MARK.as_bytes();
        let at = self.0.windows(mark.len()).position(|part| part == mark)?;
        let says = self.0[at + mark.len()..]
            .split(|byte| *byte == b';')
            .next()?;
        std::str::from_utf8(says).ok()?.split_once(' ')
    }

    fn check(&self) -> Result<(), ImageError> {
        if self.0.len() < VECTORS_BYTES
            || self.0[..VECTORS_BYTES].iter().all(|byte| *byte == ERASED)
        {
            return Err(ImageError::Start);
        }
        let word = |at: usize| {
            u32::from_le_bytes([self.0[at], self.0[at + 1], self.0[at + 2], self.0[at + 3]])
        };
        let (stack, entry) = (word(0), word(4));
        let end = FLASH.start + self.0.len() as u32;
        let is_thumb = entry % 2 == 1;
        if !RAM.contains(&stack) || !is_thumb || !(FLASH.start..end).contains(&entry) {
            return Err(ImageError::Vectors { stack, entry });
        }
        let name = PRODUCT.as_bytes();
        if !self.0.windows(name.len()).any(|part| part == name) {
            return Err(ImageError::Stranger);
        }
        Ok(())
    }
}
