//! Flash, RAM and the ROM's part that programs read, as bytes (RM0440, section 2.2).

use crate::cpu::decode::decode;
use crate::cpu::instruction::{Decoded, Instruction, is_wide};

/// Where the flash is, and how large.
pub const FLASH: u32 = 0x0800_0000;
/// Its size.
pub const FLASH_BYTES: usize = 512 * 1024;
/// SRAM1, SRAM2 and the second sight of CCM SRAM lie side by side.
pub const SRAM: u32 = 0x2000_0000;
/// Their size.
pub const SRAM_BYTES: usize = 128 * 1024;
/// CCM SRAM, where code reaches it.
const CCM: u32 = 0x1000_0000;
const CCM_BYTES: usize = 32 * 1024;
/// Where CCM SRAM is within [`SRAM`].
const CCM_IN_SRAM: usize = 96 * 1024;
/// What ST wrote into each chip: the unique number and the size of the flash (RM0440, sections 48.1 and 48.2).
const UNIQUE_ID: u32 = 0x1fff_7590;
const FLASH_SIZE: u32 = 0x1fff_75e0;

/// What erased flash reads as.
const ERASED: u8 = 0xff;

/// What RAM holds when power comes is random; a pattern repeats (RM0440 says nothing of it).
const UNKNOWN: [u8; 2] = [0x5a, 0xa5];

/// A slot of the cache that holds nothing yet.
const EMPTY: Decoded = Decoded {
    instruction: Instruction::Unknown,
    bytes: 0,
};

/// The bytes.
#[derive(Clone, Debug)]
pub struct Memory {
    flash: Vec<u8>,
    sram: Vec<u8>,
    unique_id: [u8; 12],
    /// The instruction at each half-word of the flash, once it was fetched.
    decoded: Vec<Decoded>,
}

/// Where an address leads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Region {
    Flash(usize),
    Sram(usize),
    UniqueId(usize),
    FlashSize(usize),
    Peripheral,
    Nothing,
}

impl Memory {
    pub(crate) fn new(segments: &[(u32, Vec<u8>)], unique_id: [u8; 12]) -> Self {
        let mut flash = vec![ERASED; FLASH_BYTES];
        for (address, bytes) in segments {
            let start = (address - FLASH) as usize;
            flash[start..start + bytes.len()].copy_from_slice(bytes);
        }
        Self {
            flash,
            sram: UNKNOWN.repeat(SRAM_BYTES / 2),
            unique_id,
            decoded: vec![EMPTY; FLASH_BYTES / 2],
        }
    }

    #[inline]
    pub(crate) fn region(address: u32) -> Region {
        let within = |first: u32, bytes: usize| {
            let offset = address.wrapping_sub(first) as usize;
            (offset < bytes).then_some(offset)
        };
        if let Some(offset) = within(SRAM, SRAM_BYTES) {
            return Region::Sram(offset);
        }
        if let Some(offset) = within(FLASH, FLASH_BYTES).or_else(|| within(0, FLASH_BYTES)) {
            return Region::Flash(offset);
        }
        if address >> 28 == 4 || address >> 28 == 5 || address >> 16 == 0xe004 {
            return Region::Peripheral;
        }
        if let Some(offset) = within(CCM, CCM_BYTES) {
            return Region::Sram(offset + CCM_IN_SRAM);
        }
        if let Some(offset) = within(UNIQUE_ID, 12) {
            return Region::UniqueId(offset);
        }
        match within(FLASH_SIZE, 2) {
            Some(offset) => Region::FlashSize(offset),
            None => Region::Nothing,
        }
    }

    /// The same, sooner where code mostly is.
    #[inline]
    pub(crate) fn region_of_code(address: u32) -> Region {
        match address.wrapping_sub(FLASH) as usize {
            offset @ 0..FLASH_BYTES => Region::Flash(offset),
            _ => Self::region(address),
        }
    }

    /// Reads from SRAM; `None` beyond its end.
    #[inline]
    pub(crate) fn sram<const BYTES: u32>(&self, offset: usize) -> Option<u32> {
        word::<BYTES>(&self.sram, offset)
    }

    #[inline]
    pub(crate) fn flash<const BYTES: u32>(&self, offset: usize) -> Option<u32> {
        word::<BYTES>(&self.flash, offset)
    }

    pub(crate) fn unique_id<const BYTES: u32>(&self, offset: usize) -> Option<u32> {
        word::<BYTES>(&self.unique_id, offset)
    }

    pub(crate) fn flash_size<const BYTES: u32>(&self, offset: usize) -> Option<u32> {
        let kilobytes = (FLASH_BYTES / 1024) as u16;
        word::<BYTES>(&kilobytes.to_le_bytes(), offset)
    }

    #[inline]
    pub(crate) fn write_sram<const BYTES: u32>(&mut self, offset: usize, value: u32) -> Option<()> {
        let slot = self.sram.get_mut(offset..offset + BYTES as usize)?;
        slot.copy_from_slice(&value.to_le_bytes()[..BYTES as usize]);
        Some(())
    }

    /// Power went.
    pub(crate) fn lose_ram(&mut self) {
        self.sram = UNKNOWN.repeat(SRAM_BYTES / 2);
    }

    /// The whole RAM, for who looks at it from outside.
    pub fn ram(&self) -> &[u8] {
        &self.sram
    }

    /// The same, to write.
    pub fn ram_mut(&mut self) -> &mut [u8] {
        &mut self.sram
    }

    /// The whole flash.
    pub fn flash_bytes(&self) -> &[u8] {
        &self.flash
    }

    /// For each byte of the flash whether it is of an instruction that was executed since it was written.
    pub(crate) fn executed(&self) -> Vec<bool> {
        let mut executed = vec![false; FLASH_BYTES];
        for (place, decoded) in self.decoded.iter().enumerate() {
            let start = 2 * place;
            let end = (start + usize::from(decoded.bytes)).min(FLASH_BYTES);
            executed[start..end].fill(true);
        }
        executed
    }

    /// Puts bytes into the flash, whatever was there.
    pub(crate) fn set_flash(&mut self, offset: usize, bytes: &[u8]) {
        self.flash[offset..offset + bytes.len()].copy_from_slice(bytes);
        // An instruction may begin in the half-word before.
        let first = (offset / 2).saturating_sub(1);
        let last = (offset + bytes.len()).div_ceil(2);
        self.decoded[first..last].fill(EMPTY);
    }

    pub(crate) fn erase_flash(&mut self, offset: usize, bytes: usize) {
        self.set_flash(offset, &vec![ERASED; bytes]);
    }

    /// The instruction in flash.
    #[inline]
    pub(crate) fn instruction(&mut self, offset: usize) -> Option<Decoded> {
        match self.decoded.get(offset / 2) {
            Some(decoded) if decoded.bytes != 0 => Some(*decoded),
            Some(_) => self.decode(offset),
            None => None,
        }
    }

    #[cold]
    fn decode(&mut self, offset: usize) -> Option<Decoded> {
        let decoded = decode_at(&self.flash, offset)?;
        self.decoded[offset / 2] = decoded;
        Some(decoded)
    }

    /// The instruction in RAM.
    pub(crate) fn instruction_in_ram(&self, offset: usize) -> Option<Decoded> {
        decode_at(&self.sram, offset)
    }
}

fn decode_at(bytes: &[u8], offset: usize) -> Option<Decoded> {
    let first = word::<2>(bytes, offset)? as u16;
    let second = match is_wide(first) {
        true => word::<2>(bytes, offset + 2)? as u16,
        false => 0,
    };
    Some(decode(first, second))
}

#[inline]
fn word<const BYTES: u32>(bytes: &[u8], offset: usize) -> Option<u32> {
    let mut word = [0; 4];
    word[..BYTES as usize].copy_from_slice(bytes.get(offset..offset + BYTES as usize)?);
    Some(u32::from_le_bytes(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ccm_is_seen_twice() {
        let Region::Sram(first) = Memory::region(CCM) else {
            panic!("CCM SRAM");
        };
        assert_eq!(Memory::region(0x2001_8000), Region::Sram(first));
        assert_eq!(Memory::region(0x2002_0000), Region::Nothing);
    }

    #[test]
    fn new_code_is_decoded_anew() {
        let mut memory = Memory::new(&[(FLASH, vec![0x00, 0xbf])], [0; 12]);
        let before = memory.instruction(0);
        memory.set_flash(0, &[0x01, 0x20]);
        assert_ne!(memory.instruction(0), before);
    }
}
