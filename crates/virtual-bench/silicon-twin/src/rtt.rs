//! The program's log, as a debugger takes it out of RAM: SEGGER's RTT, up-channel 0 (docs.rs, `defmt-rtt`).

use crate::chip::memory::SRAM;

/// The name of the control block, and what it begins with once it is set up.
pub(crate) const SYMBOL: &str = "_SEGGER_RTT";
const MAGIC: &[u8] = b"SEGGER RTT";
/// The first up-channel: name, buffer, size, and where is written and read.
const CHANNEL: usize = 24;
const BUFFER: usize = CHANNEL + 4;
const SIZE: usize = CHANNEL + 8;
const WRITE: usize = CHANNEL + 12;
const READ: usize = CHANNEL + 16;

/// Takes what has been written since the last time out of `ram`, whose control block is at the address `block`.
pub(crate) fn take(ram: &mut [u8], block: u32) -> Vec<u8> {
    taken(ram, block).unwrap_or_default()
}

fn taken(ram: &mut [u8], block: u32) -> Option<Vec<u8>> {
    let block = block.checked_sub(SRAM)? as usize;
    if !ram.get(block..)?.starts_with(MAGIC) {
        return None;
    }
    let field = |ram: &[u8], at: usize| {
        let bytes = ram.get(block + at..block + at + 4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?))
    };
    let buffer = field(ram, BUFFER)?.checked_sub(SRAM)? as usize;
    let size = field(ram, SIZE)? as usize;
    let (write, mut read) = (field(ram, WRITE)? as usize, field(ram, READ)? as usize);
    let bytes = ram.get(buffer..buffer + size)?;
    if write >= size || read >= size {
        return None;
    }
    let mut log = Vec::new();
    while read != write {
        log.push(bytes[read]);
        read = (read + 1) % size;
    }
    let slot = ram.get_mut(block + READ..block + READ + 4)?;
    slot.copy_from_slice(&(read as u32).to_le_bytes());
    Some(log)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_between_the_two_positions_is_taken_once_and_round_the_end() {
        let mut ram = vec![0; 256];
        ram[..MAGIC.len()].copy_from_slice(MAGIC);
        let mut put = |at: usize, word: u32| ram[at..at + 4].copy_from_slice(&word.to_le_bytes());
        put(BUFFER, SRAM + 128);
        put(SIZE, 8);
        put(WRITE, 2);
        put(READ, 6);
        ram[128..136].copy_from_slice(b"cd....ab");
        assert_eq!(take(&mut ram, SRAM), b"abcd");
        assert_eq!(take(&mut ram, SRAM), b"");
        assert_eq!(take(&mut ram, 0), b"", "there is no control block");
    }
}
