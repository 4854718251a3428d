//! What reading the flash costs: wait states, prefetch, and two caches (RM0440, sections 3.3.3 and 3.3.4).
//!
//! An estimate: lines are replaced in turn instead of the least recently used first, and a prefetch always goes on where
//! the program does. A cache holds nothing that the flash does not, so only time depends on it.

use super::memory::FLASH_BYTES;

/// Lines of either cache: 32 of four double words for instructions, 8 for data.
const INSTRUCTION_LINES: usize = 32;
const DATA_LINES: usize = 8;
const LINE_BYTES: usize = 32;
/// What one access of the flash brings where it has two banks.
const WORD_BYTES: usize = 8;

/// ACR: prefetch and the two caches.
const PRFTEN: u32 = 1 << 8;
const ICEN: u32 = 1 << 9;
const DCEN: u32 = 1 << 10;
const LATENCY: u32 = 0xf;

/// Which lines a cache holds.
#[derive(Clone, Debug)]
struct Lines {
    held: Vec<bool>,
    ring: Vec<usize>,
    next: usize,
}

impl Lines {
    fn new(lines: usize) -> Self {
        Self {
            held: vec![false; FLASH_BYTES / LINE_BYTES],
            ring: vec![0; lines],
            next: 0,
        }
    }

    /// Whether a line is held; from now on it is.
    fn meets(&mut self, line: usize) -> bool {
        if self.held[line] {
            return true;
        }
        let slot = &mut self.ring[self.next];
        self.held[*slot] = false;
        *slot = line;
        self.held[line] = true;
        self.next = (self.next + 1) % self.ring.len();
        false
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

    /// Cycles that an instruction at `offset` is waited for, with the flash set up as `acr` says.
    #[inline]
    pub(super) fn fetch(&mut self, offset: usize, now: u64, acr: u32) -> u64 {
        let word = offset / WORD_BYTES;
        match self.word == Some(word) {
            true => 0,
            false => self.fetch_word(word, now, acr),
        }
    }

    fn fetch_word(&mut self, word: usize, now: u64, acr: u32) -> u64 {
        let wait_states = u64::from(acr & LATENCY);
        let line = word * WORD_BYTES / LINE_BYTES;
        let is_cached = acr & ICEN != 0 && self.instructions.meets(line);
        let follows = acr & PRFTEN != 0 && self.word.is_some_and(|before| word == before + 1);
        let stall = match (is_cached, follows) {
            (true, _) => 0,
            // It was on its way since the word before was taken.
            (false, true) => (wait_states + 1).saturating_sub(now - self.since),
            (false, false) => wait_states,
        };
        (self.word, self.since) = (Some(word), now + stall);
        stall
    }

    /// The same for data.
    pub(super) fn load(&mut self, offset: usize, acr: u32) -> u64 {
        match acr & DCEN != 0 && self.data.meets(offset / LINE_BYTES) {
            true => 0,
            false => (acr & LATENCY).into(),
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
        assert_eq!(stalls, [4, 0, 0, 0, 0], "both double words are of one line");
    }

    #[test]
    fn a_prefetch_hides_what_the_program_takes_for_the_word_before() {
        let mut accelerator = Accelerator::new();
        let acr = FOUR | PRFTEN;
        assert_eq!(accelerator.fetch(0, 0, acr), 4);
        assert_eq!(
            accelerator.fetch(8, 4 + 3, acr),
            2,
            "three of five cycles have passed"
        );
        assert_eq!(accelerator.fetch(64, 20, acr), 4, "a branch");
    }

    #[test]
    fn the_oldest_line_makes_room() {
        let mut accelerator = Accelerator::new();
        let acr = FOUR | DCEN;
        for line in 0..=DATA_LINES {
            assert_eq!(accelerator.load(line * LINE_BYTES, acr), 4);
        }
        assert_eq!(accelerator.load(LINE_BYTES, acr), 0);
        assert_eq!(accelerator.load(0, acr), 4, "it had to go");
    }
}
