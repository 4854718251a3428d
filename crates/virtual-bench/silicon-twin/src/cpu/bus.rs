//! What the processor asks of everything around it.

use super::instruction::Decoded;

/// Why the bus does not answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Abort {
    /// There is nothing, or it refuses: the program sees a bus fault.
    Fault,
    /// The model ends here, and knows why.
    Halt,
}

/// Memory and peripherals, without the processor's own (0xE000_E000 and around).
pub trait Bus {
    /// Reads `BYTES` bytes: 1, 2 or 4.
    ///
    /// # Errors
    /// Where nothing can be read.
    fn read<const BYTES: u32>(&mut self, address: u32) -> Result<u32, Abort>;

    /// Writes the lower `BYTES` bytes of `value`.
    ///
    /// # Errors
    /// Where nothing can be written.
    fn write<const BYTES: u32>(&mut self, address: u32, value: u32) -> Result<(), Abort>;

    /// The instruction at `address`.
    ///
    /// # Errors
    /// Where no code can be.
    fn fetch(&mut self, address: u32) -> Result<Decoded, Abort>;

    /// The processor asked for a reset (AIRCR.SYSRESETREQ).
    fn request_reset(&mut self);

    /// What a driver writes that means to write `value` to one of the processor's own registers: nothing, where it makes
    /// that mistake.
    fn meant(&self, _address: u32, value: u32) -> Option<u32> {
        Some(value)
    }

    /// Cycles of the processor's clock so far.
    fn cycles(&self) -> u64;
}
