//! What reading the flash costs: wait states, prefetch, and two caches (RM0440, sections 3.3.3 and 3.3.4); and what the
//! caches hold that the flash does not any more.
//!
//! Time is an estimate: lines are replaced in turn instead of the least recently used first, and a prefetch always goes on
//! where the program does.

use crate::chip::memory::FLASH_BYTES;

/// Lines of either cache: 32 of four double words for instructions, 8 for data.
const INSTRUCTION_LINES: usize = 32;
const DATA_LINES: usize = 8;
const LINE_BYTES: usize = 32;
/// What one access of the flash brings where it has two banks.
const WORD_BYTES: usize = 8;

/// ACR: prefetch, the two caches, and their resets.
const PRFTEN: u32 = 1 << 8;
const ICEN: u32 = 1 << 9;
const DCEN: u32 = 1 << 10;
const ICRST: u32 = 1 << 11;
const DCRST: u32 = 1 << 12;
const LATENCY: u32 = 0xf;

/// A read that does not bring what the flash holds, or may not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::chip) enum WrongRead {
    /// From a line that was filled before the flash was written there.
    Stale,
    /// Through the data cache while the flash is written.
    WhileWritten,
}

impl WrongRead {
    /// What is wrong.
    pub(in crate::chip) fn sentence(self) -> &'static str {
        match self {
            Self::Stale => {
                "comes from a cache that holds what was there before the flash was written, and was not reset since \
                 (RM0440, section 3.3.4)"
            }
            Self::WhileWritten => {
                "goes through the data cache while the flash is written, which may corrupt it (errata ES0430, section \
                 2.2.2)"
            }
        }
    }
}

/// What a cache has of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Held {
    Nothing,
    /// What the flash has.
    Line,
    /// What it had.
    Stale,
}

/// Which lines a cache holds.
#[derive(Clone, Debug)]
struct Lines {
    held: Vec<Held>,
    ring: Vec<usize>,
    next: usize,
}

impl Lines {
    fn new(lines: usize) -> Self {
        Self {
            held: vec![Held::Nothing; FLASH_BYTES / LINE_BYTES],
            ring: vec![0; lines],
            next: 0,
        }
    }

    /// Whether a line is held; from now on it is.
    fn meets(&mut self, line: usize) -> Result<bool, WrongRead> {
        match self.held[line] {
            Held::Line => return Ok(true),
            Held::Stale => return Err(WrongRead::Stale),
            Held::Nothing => {}
        }
        let slot = &mut self.ring[self.next];
        self.held[*slot] = Held::Nothing;
        *slot = line;
        self.held[line] = Held::Line;
        self.next = (self.next + 1) % self.ring.len();
        Ok(false)
    }

    /// The flash has something else at `offset` from now on.
    fn outdate(&mut self, offset: usize, bytes: usize) {
        let lines = offset / LINE_BYTES..(offset + bytes).div_ceil(LINE_BYTES);
        for held in &mut self.held[lines] {
            if *held == Held::Line {
                *held = Held::Stale;
            }
        }
    }

    fn has_stale(&self) -> bool {
        self.ring.iter().any(|line| self.held[*line] == Held::Stale)
    }

    fn forget(&mut self) {
        *self = Self::new(self.ring.len());
    }
}

/// The accelerator's state.
#[derive(Clone, Debug)]
pub(super) struct Accelerator {
    instructions: Lines,
    data: Lines,
    /// The double word that instructions come from, and since which cycle.
    word: Option<usize>,
    since: u64,
}

impl Accelerator {
    pub(super) fn new() -> Self {
        Self {
            instructions: Lines::new(INSTRUCTION_LINES),
            data: Lines::new(DATA_LINES),
            word: None,
            since: 0,
        }
    }

    /// ACR is written as `acr`; what is wrong with that. A cache is reset while it is off only (section 3.7.1), and is not
    /// switched on with lines that the flash has otherwise, whether or not one of them is read then.
    pub(super) fn control(&mut self, acr: u32) -> Result<(), &'static str> {
        for (reset, enable, lines) in [
            (ICRST, ICEN, &mut self.instructions),
            (DCRST, DCEN, &mut self.data),
        ] {
            match (acr & reset != 0, acr & enable != 0) {
                (true, true) => {
                    return Err(
                        "a cache of the flash is reset while it is on (RM0440, section 3.7.1)",
                    );
                }
                (true, false) => lines.forget(),
                (false, true) if lines.has_stale() => {
                    return Err(
                        "a cache of the flash is switched on with lines of before the flash was written (RM0440, section \
                         3.3.4)",
                    );
                }
                (false, _) => {}
            }
        }
        Ok(())
    }

    /// The flash has something else at `offset` from now on. What caches hold of it they keep, also while they are off.
    pub(super) fn outdate(&mut self, offset: usize, bytes: usize) {
        self.instructions.outdate(offset, bytes);
        self.data.outdate(offset, bytes);
    }

    /// Cycles that an instruction at `offset` is waited for, with the flash set up as `acr` says.
    #[inline]
    pub(super) fn fetch(&mut self, offset: usize, now: u64, acr: u32) -> Result<u64, WrongRead> {
        let word = offset / WORD_BYTES;
        match self.word == Some(word) {
            true => Ok(0),
            false => self.fetch_word(word, now, acr),
        }
    }

    fn fetch_word(&mut self, word: usize, now: u64, acr: u32) -> Result<u64, WrongRead> {
        let wait_states = u64::from(acr & LATENCY);
        let line = word * WORD_BYTES / LINE_BYTES;
        let is_cached = acr & ICEN != 0 && self.instructions.meets(line)?;
        let follows = acr & PRFTEN != 0 && self.word.is_some_and(|before| word == before + 1);
        let stall = match (is_cached, follows) {
            (true, _) => 0,
            // It was on its way since the word before was taken.
            (false, true) => (wait_states + 1).saturating_sub(now - self.since),
            (false, false) => wait_states,
        };
        (self.word, self.since) = (Some(word), now + stall);
        Ok(stall)
    }

    /// The same for data.
    #[inline]
    pub(super) fn load(
        &mut self,
        offset: usize,
        acr: u32,
        is_written: bool,
    ) -> Result<u64, WrongRead> {
        match acr & DCEN != 0 {
            true if is_written => Err(WrongRead::WhileWritten),
            true if self.data.meets(offset / LINE_BYTES)? => Ok(0),
            _ => Ok((acr & LATENCY).into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FOUR: u32 = 4;

    #[test]
    fn a_loop_costs_its_wait_states_once() {
        let mut accelerator = Accelerator::new();
        let acr = FOUR | ICEN;
        let fetches = [0, 8, 0, 8, 0];
        let stalls = fetches.map(|offset| accelerator.fetch(offset, 0, acr));
        assert_eq!(
            stalls,
            [4, 0, 0, 0, 0].map(Ok),
            "both double words are of one line"
        );
    }

    #[test]
    fn a_prefetch_hides_what_the_program_takes_for_the_word_before() {
        let mut accelerator = Accelerator::new();
        let acr = FOUR | PRFTEN;
        assert_eq!(accelerator.fetch(0, 0, acr), Ok(4));
        assert_eq!(
            accelerator.fetch(8, 4 + 3, acr),
            Ok(2),
            "three of five cycles have passed"
        );
        assert_eq!(accelerator.fetch(64, 20, acr), Ok(4), "a branch");
    }

    #[test]
    fn the_oldest_line_makes_room() {
        let mut accelerator = Accelerator::new();
        let acr = FOUR | DCEN;
        for line in 0..=DATA_LINES {
            assert_eq!(accelerator.load(line * LINE_BYTES, acr, false), Ok(4));
        }
        assert_eq!(accelerator.load(LINE_BYTES, acr, false), Ok(0));
        assert_eq!(accelerator.load(0, acr, false), Ok(4), "it had to go");
    }

    #[test]
    fn a_line_that_the_flash_has_otherwise_is_stale_until_its_cache_is_reset_while_it_is_off() {
        let mut accelerator = Accelerator::new();
        let acr = FOUR | DCEN;
        assert_eq!(accelerator.load(0, acr, false), Ok(4));
        accelerator.outdate(8, 8);
        assert_eq!(accelerator.load(0, acr, false), Err(WrongRead::Stale));
        assert_eq!(accelerator.load(0, FOUR, false), Ok(4), "past the cache");
        assert!(accelerator.control(acr | DCRST).is_err(), "it is on");
        assert_eq!(accelerator.control(FOUR), Ok(()));
        assert!(accelerator.control(acr).is_err(), "on again");
        assert_eq!(accelerator.load(0, acr, false), Err(WrongRead::Stale));
        assert_eq!(accelerator.control(FOUR | DCRST), Ok(()));
        assert_eq!(accelerator.load(0, acr, false), Ok(4));
    }

    #[test]
    fn the_data_cache_is_off_while_the_flash_is_written() {
        let mut accelerator = Accelerator::new();
        let read = accelerator.load(0, FOUR | DCEN, true);
        assert_eq!(read, Err(WrongRead::WhileWritten));
        assert_eq!(accelerator.load(0, FOUR, true), Ok(4));
    }
}
