//! How much of its stack the firmware has used: the startup code paints the stack, and what is still painted was never
//! used.

use std::fs;
use std::io::{self, BufRead, BufReader, Write};
use std::ops::Range;
use std::os::unix::net::UnixStream;
use std::path::Path;

use object::{Object, ObjectSymbol};

/// Socket of QEMU's monitor, in the emulator's working directory. Who reaches it can do all that the user can.
pub(crate) const MONITOR: &str = "monitor";
/// The file there that memory is written to.
const MEMORY: &str = "memory";

/// What the startup code paints with (cortex-m-rt's `STACK_PAINT_VALUE`).
const PAINT: [u8; 4] = 0xcccc_cccc_u32.to_le_bytes();

/// A stack, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stack {
    /// What there is.
    pub size: usize,
    /// What was used at most since the last reset.
    pub used: usize,
}

impl Stack {
    /// Looks at the stack of a running emulator that was started with `image` in `directory`.
    pub(crate) fn of(image: &Path, directory: &Path) -> io::Result<Self> {
        let place = Self::place(&fs::read(image)?).ok_or(io::ErrorKind::InvalidData)?;
        save_memory(directory, &place)?;
        Ok(Self::painted(&fs::read(directory.join(MEMORY))?))
    }

    /// Addresses at which the linker of this image has placed the stack; `None` where the image does not say.
    pub fn place(elf: &[u8]) -> Option<Range<u64>> {
        let file = object::File::parse(elf).ok()?;
        let address = |name| Some(file.symbol_by_name(name)?.address());
        Some(address("_stack_end")?..address("_stack_start")?)
    }

    /// What the paint tells that is left in the stack's memory.
    pub fn painted(memory: &[u8]) -> Self {
        let (words, _) = memory.as_chunks();
        let unused = words.iter().take_while(|word| **word == PAINT).count();
        Self {
            size: memory.len(),
            used: memory.len() - unused * PAINT.len(),
        }
    }
}

/// Has QEMU write that part of the board's memory to a file.
fn save_memory(directory: &Path, range: &Range<u64>) -> io::Result<()> {
    let mut monitor = UnixStream::connect(directory.join(MONITOR))?;
    let mut answers = BufReader::new(monitor.try_clone()?).lines();
    let save = format!(
        r#"{{"execute": "pmemsave", "arguments": {{"val": {}, "size": {}, "filename": "{MEMORY}"}}}}"#,
        range.start,
        range.end - range.start
    );
    for command in [r#"{"execute": "qmp_capabilities"}"#, &save] {
        writeln!(monitor, "{command}")?;
        loop {
            let answer = answers.next().ok_or(io::ErrorKind::UnexpectedEof)??;
            if answer.contains(r#""error""#) {
                return Err(io::Error::other(answer));
            }
            // Greeting and events come in between.
            if answer.contains(r#""return""#) {
                break;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stack_is_used_from_its_top_down_to_the_first_word_that_is_not_painted() {
        let mut memory = PAINT.repeat(16);
        let of = |memory: &[u8]| Stack::painted(memory).used;
        assert_eq!(of(&memory), 0);
        memory[40] = 1;
        assert_eq!(of(&memory), 64 - 40);
        // A word that was once painted over below another one.
        memory[12] = 1;
        assert_eq!(of(&memory), 64 - 12);
    }
}
