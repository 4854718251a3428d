//! Why the firmware stopped, told across the reset that follows.
//!
//! The reason waits at the end of RAM (`LAST_STOP` in each board's `memory.x`), which
//! neither the startup code nor a reset touches.

#![expect(unsafe_code, reason = "memory that no variable may own")]

use core::fmt::{self, Write};

use mirror_protocol::Sentence;
use protection::Fault;

use crate::origin::LastStop;

/// Tells a reason from what memory holds at power-on.
const MAGIC: u32 = 0x5704_4ed0;

/// As many bytes as the message to the host has.
const TEXT_BYTES: usize = 128;

#[repr(C)]
struct Record {
    magic: u32,
    fault: u32,
    length: u32,
    text: [u8; TEXT_BYTES],
}

/// Behind it are the counts of resets.
const _: () = assert!(size_of::<Record>() <= 192);

unsafe extern "C" {
    static mut LAST_STOP: Record;
}

/// Keeps the reason of a stop for the next start. To be called with the outputs off, and once.
pub fn keep(fault: Fault, reason: fmt::Arguments<'_>) {
    let mut text = Text {
        bytes: [0; TEXT_BYTES],
        length: 0,
    };
    // What does not fit is left out.
    let _ = text.write_fmt(reason);
    let record = Record {
        magic: MAGIC,
        fault: fault.code().into(),
        length: text.length as u32,
        text: text.bytes,
    };
    // SAFETY: the linker keeps this memory for it, aligned, and whoever stops is the only one left.
    unsafe { (&raw mut LAST_STOP).write_volatile(record) };
}

/// The reason that the last run left, once.
pub fn take() -> Option<LastStop> {
    // SAFETY: any bytes are a `Record`; it is read before anything can stop and write another.
    let record = unsafe { (&raw const LAST_STOP).read_volatile() };
    // SAFETY: as above.
    unsafe { (&raw mut LAST_STOP.magic).write_volatile(0) };
    if record.magic != MAGIC {
        return None;
    }
    let fault = Fault::from_code(record.fault.try_into().ok()?)?;
    let bytes = record.text.get(..record.length as usize)?;
    let mut text = Sentence::new();
    let _ = text.push_str(core::str::from_utf8(bytes).ok()?);
    Some(LastStop { fault, text })
}

struct Text {
    bytes: [u8; TEXT_BYTES],
    length: usize,
}

impl Write for Text {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for character in text.chars() {
            let mut utf8 = [0; 4];
            let utf8 = character.encode_utf8(&mut utf8).as_bytes();
            let end = self.length + utf8.len();
            let room = self.bytes.get_mut(self.length..end).ok_or(fmt::Error)?;
            room.copy_from_slice(utf8);
            self.length = end;
        }
        Ok(())
    }
}
