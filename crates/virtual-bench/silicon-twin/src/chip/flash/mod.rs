//! The flash's controller: keys, programming of double words, erasing of pages, error correction, option bytes (RM0440,
//! chapters 3 and 5; two banks of 128 pages of 2 KB).

mod accelerator;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

pub(super) use accelerator::WrongRead;

use super::memory::Memory;
use super::refused::{Access, Refused, misuse, only};
use super::time::{Clock, NEVER};
use accelerator::Accelerator;

mod offset {
    pub(super) const ACR: u32 = 0x00;
    pub(super) const KEYR: u32 = 0x08;
    pub(super) const SR: u32 = 0x10;
    pub(super) const CR: u32 = 0x14;
    pub(super) const ECCR: u32 = 0x18;
    pub(super) const OPTR: u32 = 0x20;
}

/// Bytes of a bank and of a page, where there are two banks.
const BANK_BYTES: usize = 256 * 1024;
const PAGE_BYTES: usize = 2048;
/// Double words are programmed.
const WORD_BYTES: usize = 8;

/// How long it takes (DS12288, table 46, typical).
const PROGRAM_S: f64 = 81.7e-6;
const ERASE_S: f64 = 22.02e-3;

const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];

/// CR.
const PG: u32 = 1;
const PER: u32 = 1 << 1;
const BKER: u32 = 1 << 11;
const STRT: u32 = 1 << 16;
const EOPIE: u32 = 1 << 24;
const ERRIE: u32 = 1 << 25;
const LOCK: u32 = 1 << 31;
const OPTLOCK: u32 = 1 << 30;
const CR_MODELLED: u32 = PG | PER | 0x7f << 3 | BKER | STRT | EOPIE | ERRIE | LOCK | OPTLOCK;
/// SR.
const EOP: u32 = 1;
const PROGERR: u32 = 1 << 3;
const PGAERR: u32 = 1 << 5;
const SIZERR: u32 = 1 << 6;
const PGSERR: u32 = 1 << 7;
const ERRORS: u32 = 0xc3fa;
const BSY: u32 = 1 << 16;
/// ECCR: two errors in the lower and the upper half of a line, the bank, and the address in it.
const ECCD: u32 = 1 << 31;
const ECCC: u32 = 1 << 30;
const BK_ECC: u32 = 1 << 21;

/// ACR: prefetch, caches, their reset, power-down in sleep.
const ACR_MODELLED: u32 = 0xf | 0x1f << 8 | 1 << 14 | 1 << 18;
/// Option bytes as delivered (section 5.4.8), with the brown-out level that this board wants: 4.
const OPTIONS: u32 = 0xffef_f8aa | 4 << 8;

/// What the controller is about.
#[derive(Clone, Copy, Debug)]
enum Work {
    Program { at: usize, bytes: [u8; WORD_BYTES] },
    Erase { at: usize },
}

impl Work {
    fn at(self) -> usize {
        match self {
            Self::Program { at, .. } | Self::Erase { at } => at,
        }
    }
}

/// The registers.
#[derive(Clone, Debug)]
pub(crate) struct Flash {
    acr: u32,
    cr: u32,
    sr: u32,
    eccr: u32,
    options: u32,
    keys_given: usize,
    /// The first half of a double word.
    half: Option<(usize, u32)>,
    work: Option<(Work, u64)>,
    /// Programs and erasures that have begun, in each bank.
    begun: [u64; 2],
    cells: Cells,
    accelerator: Accelerator,
}

/// What outlives a reset beside the bytes themselves.
#[derive(Clone, Debug, Default)]
struct Cells {
    /// Double words whose error correction does not agree with them.
    torn: BTreeSet<usize>,
    /// They take nothing more.
    are_worn: bool,
}

impl Flash {
    pub(crate) fn new() -> Self {
        Self {
            acr: 0x0004_0600,
            cr: LOCK | OPTLOCK,
            sr: 0,
            eccr: 0,
            options: OPTIONS,
            keys_given: 0,
            half: None,
            work: None,
            begun: [0; 2],
            cells: Cells::default(),
            accelerator: Accelerator::new(),
        }
    }

    /// After a reset, in which the cells keep what they hold.
    pub(crate) fn reset(&mut self) {
        *self = Self {
            begun: self.begun,
            cells: std::mem::take(&mut self.cells),
            ..Self::new()
        };
    }

    /// Two bits of a double word fall over.
    pub(crate) fn damage(&mut self, at: usize, memory: &mut Memory) {
        let word = at / WORD_BYTES * WORD_BYTES;
        let first = memory.flash_bytes()[word];
        memory.set_flash(word, &[first ^ 0b11]);
        self.cells.torn.insert(at / WORD_BYTES);
    }

    /// From now on the cells stay as they are, whatever is done.
    pub(crate) fn wear_out(&mut self) {
        self.cells.are_worn = true;
    }

    /// Programs and erasures that have begun since power came first, in each bank.
    pub(crate) fn begun(&self) -> [u64; 2] {
        self.begun
    }

    /// Cycles that an instruction at `at` is waited for.
    #[inline]
    pub(super) fn fetch(&mut self, at: usize, now: u64) -> Result<u64, WrongRead> {
        self.accelerator.fetch(at, now, self.acr)
    }

    /// The same for data.
    #[inline]
    pub(super) fn load(&mut self, at: usize) -> Result<u64, WrongRead> {
        self.accelerator.load(at, self.acr, self.work.is_some())
    }

    pub(crate) fn wait_states(&self) -> u32 {
        self.acr & 0xf
    }

    pub(crate) fn interrupts(&self) -> bool {
        (self.sr & EOP != 0 && self.cr & EOPIE != 0)
            || (self.sr & ERRORS != 0 && self.cr & ERRIE != 0)
    }

    /// When the present work ends.
    pub(crate) fn next_event(&self) -> u64 {
        self.work.map_or(NEVER, |(_, end)| end)
    }

    /// Until when nothing can be read at `at`: a bank that is written or erased makes the processor wait, the other one
    /// does not (section 3.3.8).
    pub(crate) fn stall(&self, at: usize) -> Option<u64> {
        let (work, end) = self.work?;
        (work.at() / BANK_BYTES == at / BANK_BYTES).then_some(end)
    }

    /// Whether two errors in one double word were met that nobody has acknowledged: so long the NMI is raised (section 5.3.2),
    /// and a handler that returns without a word to the flash is entered again.
    pub(crate) fn raises_nmi(&self) -> bool {
        self.eccr & ECCD != 0
    }

    /// Whether a read at `at` is the first to meet two errors in one double word; of those after it nothing is told until
    /// this one is acknowledged (section 5.3.2).
    pub(crate) fn meets_torn(&mut self, at: usize) -> bool {
        if self.cells.torn.is_empty() || !self.cells.torn.contains(&(at / WORD_BYTES)) {
            return false;
        }
        let is_first = self.eccr & ECCD == 0;
        if is_first {
            let bank = if at < BANK_BYTES { 0 } else { BK_ECC };
            let address = (at % BANK_BYTES / WORD_BYTES) as u32;
            self.eccr = ECCD | bank | address & 0x7_ffff;
        }
        is_first
    }

    pub(crate) fn read(&self, at: u32) -> Access<u32> {
        Ok(match at {
            offset::ACR => self.acr,
            offset::SR => self.sr | if self.work.is_some() { BSY } else { 0 },
            offset::CR => self.cr,
            offset::ECCR => self.eccr,
            offset::OPTR => self.options,
            _ => return Err(Refused::NotModelled),
        })
    }

    pub(crate) fn write(&mut self, at: u32, value: u32, clock: &Clock) -> Access {
        match at {
            offset::ACR => {
                self.acr = only(value, ACR_MODELLED)?;
                return self.accelerator.control(value).or_else(misuse);
            }
            offset::KEYR => return self.unlock(value),
            offset::SR => self.sr &= !(value & (EOP | ERRORS)),
            offset::CR => return self.control(only(value, CR_MODELLED)?, clock),
            offset::ECCR => self.eccr &= !(value & (ECCD | ECCC)),
            _ => return Err(Refused::NotModelled),
        }
        Ok(())
    }

    fn unlock(&mut self, key: u32) -> Access {
        if KEYS.get(self.keys_given) != Some(&key) {
            return misuse("the flash is unlocked by a wrong key (RM0440, section 3.3.5)");
        }
        self.keys_given += 1;
        if self.keys_given == KEYS.len() {
            self.cr &= !LOCK;
        }
        Ok(())
    }

    fn control(&mut self, value: u32, clock: &Clock) -> Access {
        if self.work.is_some() {
            return misuse("FLASH.CR is written while the flash is busy (RM0440, section 3.7.6)");
        }
        if self.cr & LOCK != 0 {
            return match value & !(LOCK | OPTLOCK) {
                0 => Ok(()),
                _ => misuse("FLASH.CR is written while it is locked (RM0440, section 3.3.5)"),
            };
        }
        if value & LOCK != 0 {
            self.keys_given = 0;
        }
        self.cr = value & !STRT;
        if value & STRT != 0 {
            self.begin_erase(clock);
        }
        Ok(())
    }

    fn begin_erase(&mut self, clock: &Clock) {
        let bank = if self.cr & BKER == 0 { 0 } else { BANK_BYTES };
        let page = (self.cr >> 3 & 0x7f) as usize;
        if self.sr & ERRORS != 0 || self.cr & PER == 0 || self.cr & PG != 0 {
            self.sr |= PGSERR;
            return;
        }
        let at = bank + page * PAGE_BYTES;
        self.begin(Work::Erase { at }, ERASE_S, clock);
    }

    fn begin(&mut self, work: Work, seconds: f64, clock: &Clock) {
        self.begun[work.at() / BANK_BYTES] += 1;
        self.work = Some((work, clock.cycle_in(seconds)));
    }

    /// The program writes into the flash: half a double word at a time (section 3.3.7).
    pub(crate) fn program(
        &mut self,
        at: usize,
        bytes: u32,
        value: u32,
        memory: &Memory,
        clock: &Clock,
    ) {
        if self.work.is_some() || self.cr & (LOCK | PG) != PG || self.sr & ERRORS != 0 {
            self.sr |= PGSERR;
            return;
        }
        if bytes != 4 {
            self.sr |= SIZERR;
            return;
        }
        match self.half.take() {
            None if at.is_multiple_of(WORD_BYTES) => self.half = Some((at, value)),
            Some((first_at, first)) if at == first_at + 4 => {
                let word = u64::from(value) << 32 | u64::from(first);
                let there = &memory.flash_bytes()[first_at..first_at + WORD_BYTES];
                if word != 0 && there.iter().any(|byte| *byte != 0xff) {
                    self.sr |= PROGERR;
                    return;
                }
                let work = Work::Program {
                    at: first_at,
                    bytes: word.to_le_bytes(),
                };
                self.begin(work, PROGRAM_S, clock);
            }
            _ => self.sr |= PGAERR,
        }
    }

    /// The present work has ended.
    pub(crate) fn finish(&mut self, memory: &mut Memory) {
        match self.work.take() {
            Some(_) if self.cells.are_worn => {}
            Some((Work::Program { at, bytes }, _)) => {
                memory.set_flash(at, &bytes);
                self.accelerator.outdate(at, WORD_BYTES);
            }
            Some((Work::Erase { at }, _)) => {
                memory.erase_flash(at, PAGE_BYTES);
                self.accelerator.outdate(at, PAGE_BYTES);
                let words = at / WORD_BYTES..(at + PAGE_BYTES) / WORD_BYTES;
                self.cells.torn.retain(|word| !words.contains(word));
            }
            None => return,
        }
        if self.cr & EOPIE != 0 {
            self.sr |= EOP;
        }
    }

    /// Power goes: what was under way stays half done, and its error correction does not agree with it.
    pub(crate) fn cut(&mut self, memory: &mut Memory) {
        let Some((work, _)) = self.work.take() else {
            return;
        };
        if self.cells.are_worn {
            return;
        }
        match work {
            Work::Program { at, bytes } => {
                memory.set_flash(at, &bytes.map(|byte| byte | 0x5a));
                self.cells.torn.insert(at / WORD_BYTES);
            }
            // Half of the page is erased, and the double word between the halves is neither.
            Work::Erase { at } => {
                memory.erase_flash(at, PAGE_BYTES / 2);
                self.cells.torn.insert((at + PAGE_BYTES / 2) / WORD_BYTES);
            }
        }
    }
}
