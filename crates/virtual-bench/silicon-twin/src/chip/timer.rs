//! An advanced-control or general-purpose timer that counts up (RM0440, chapters 29 and 31): prescaler, repetition
//! counter, preload, compare outputs, idle states, trigger outputs.

use super::refused::{Access, Refused, misuse, only};
use super::time::NEVER;

mod offset {
    pub(super) const CR1: u32 = 0x00;
    pub(super) const CR2: u32 = 0x04;
    pub(super) const SMCR: u32 = 0x08;
    pub(super) const DIER: u32 = 0x0c;
    pub(super) const SR: u32 = 0x10;
    pub(super) const EGR: u32 = 0x14;
    pub(super) const CCMR1: u32 = 0x18;
    pub(super) const CCMR2: u32 = 0x1c;
    pub(super) const CCER: u32 = 0x20;
    pub(super) const CNT: u32 = 0x24;
    pub(super) const PSC: u32 = 0x28;
    pub(super) const ARR: u32 = 0x2c;
    pub(super) const RCR: u32 = 0x30;
    pub(super) const CCR1: u32 = 0x34;
    pub(super) const CCR4: u32 = 0x40;
    pub(super) const BDTR: u32 = 0x44;
}

/// CR1.
const CEN: u32 = 1;
const UDIS: u32 = 1 << 1;
const URS: u32 = 1 << 2;
const ARPE: u32 = 1 << 7;
/// CR2: MMS2, and the idle states of the outputs.
const MMS2: u32 = 0xf << 20;
const MMS2_UPDATE: u32 = 0b0010 << 20;
const IDLE_STATES: u32 = 0b0101_0101 << 8;
/// SR and DIER: update, and the four compares above it.
const UIF: u32 = 1;
const FLAGS: u32 = 0x1f;
/// SR: the first break input was active. Its interrupt is not modelled.
const BIF: u32 = 1 << 7;
/// BDTR; the filter of the break input lets pass what lasts 1.5 us, and what is on the board does.
const OSSI: u32 = 1 << 10;
const OSSR: u32 = 1 << 11;
const BKE: u32 = 1 << 12;
const BKP: u32 = 1 << 13;
const AOE: u32 = 1 << 14;
const MOE: u32 = 1 << 15;
const BKF: u32 = 0xf << 16;
const BDTR_MODELLED: u32 = OSSI | OSSR | BKE | BKP | AOE | MOE | BKF;

/// What a compare output does with its pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Output {
    /// Nothing drives the pin.
    Floating,
    /// One level.
    Level(bool),
    /// This level until a cycle, and the other from then on.
    Until(bool, u64),
}

/// The registers.
#[derive(Clone, Debug)]
pub(crate) struct Timer {
    channels: usize,
    /// TIM1 has a second trigger output and four idle states.
    is_advanced: bool,
    cr1: u32,
    cr2: u32,
    dier: u32,
    sr: u32,
    ccmr: [u32; 2],
    ccer: u32,
    psc: u32,
    arr: u32,
    rcr: u32,
    ccr: [u32; 4],
    bdtr: u32,
    /// The level at the first break input.
    break_level: bool,
    in_use: InUse,
    /// Overflows that are left until an update.
    repetitions: u32,
    /// The cycle in which the counter was 0, or would have been; where it stands while it does not run.
    origin: u64,
    stands_at: u32,
    /// Up to here compare matches were looked for.
    seen: u64,
}

/// The values that the counter works with: those of the shadow registers.
#[derive(Clone, Copy, Debug)]
struct InUse {
    psc: u64,
    arr: u64,
    ccr: [u64; 4],
}

impl Timer {
    pub(crate) fn tim1() -> Self {
        Self::new(4, true)
    }

    pub(crate) fn tim15() -> Self {
        Self::new(2, false)
    }

    fn new(channels: usize, is_advanced: bool) -> Self {
        Self {
            channels,
            is_advanced,
            cr1: 0,
            cr2: 0,
            dier: 0,
            sr: 0,
            ccmr: [0; 2],
            ccer: 0,
            psc: 0,
            arr: 0xffff,
            rcr: 0,
            ccr: [0; 4],
            bdtr: 0,
            break_level: true,
            in_use: InUse {
                psc: 0,
                arr: 0xffff,
                ccr: [0; 4],
            },
            repetitions: 0,
            origin: 0,
            stands_at: 0,
            seen: 0,
        }
    }

    fn runs(&self) -> bool {
        self.cr1 & CEN != 0
    }

    /// Cycles of one count.
    fn count_cycles(&self) -> u64 {
        self.in_use.psc + 1
    }

    fn count(&self, now: u64) -> u64 {
        match self.runs() {
            true => (now - self.origin) / self.count_cycles(),
            false => self.stands_at.into(),
        }
    }

    /// The cycle in which the counter overflows. A counter beyond its limit goes on to the end of its 16 bits.
    pub(crate) fn overflow(&self) -> u64 {
        if !self.runs() {
            return NEVER;
        }
        let limit = match self.count(self.seen) > self.in_use.arr {
            true => 0x1_0000,
            false => self.in_use.arr + 1,
        };
        self.origin + limit * self.count_cycles()
    }

    /// The next cycle in which something happens that an interrupt tells of.
    pub(crate) fn next_event(&self) -> u64 {
        if !self.runs() {
            return NEVER;
        }
        let enabled = (0..self.channels).filter(|channel| self.dier >> (channel + 1) & 1 != 0);
        let matches = enabled.map(|channel| self.match_cycle(channel));
        let soon = matches.filter(|cycle| *cycle > self.seen).min();
        soon.unwrap_or(NEVER).min(self.overflow())
    }

    fn match_cycle(&self, channel: usize) -> u64 {
        self.origin + self.in_use.ccr[channel] * self.count_cycles()
    }

    /// Sets the flags of the compares that matched up to now, which is not beyond the next overflow.
    pub(crate) fn advance(&mut self, now: u64) {
        if self.runs() {
            for channel in 0..self.channels {
                let cycle = self.match_cycle(channel);
                let is_reached = self.in_use.ccr[channel] <= self.in_use.arr;
                if is_reached && self.seen < cycle && cycle <= now {
                    self.sr |= 2 << channel;
                }
            }
        }
        self.seen = now;
    }

    /// The counter overflows now; whether that is an update.
    pub(crate) fn overflows(&mut self, now: u64) -> bool {
        self.advance(now);
        self.origin = now;
        for channel in 0..self.channels {
            if self.in_use.ccr[channel] == 0 {
                self.sr |= 2 << channel;
            }
        }
        if self.repetitions > 0 {
            self.repetitions -= 1;
            return false;
        }
        if self.cr1 & UDIS != 0 {
            return false;
        }
        self.update();
        self.sr |= UIF;
        if self.bdtr & AOE != 0 && !self.is_broken() {
            self.bdtr |= MOE;
        }
        true
    }

    /// Whether an update starts conversions by TRGO2 (MMS2).
    pub(crate) fn triggers_by_update(&self) -> bool {
        self.is_advanced && self.cr2 & MMS2 == MMS2_UPDATE
    }

    /// The preloaded values are taken over.
    fn update(&mut self) {
        self.in_use = InUse {
            psc: self.psc.into(),
            arr: self.arr.into(),
            ccr: self.ccr.map(u64::from),
        };
        self.repetitions = self.rcr;
    }

    /// This level is at the break input now; whether that changes the outputs.
    pub(crate) fn set_break_input(&mut self, level: bool) -> bool {
        let before = self.bdtr;
        self.break_level = level;
        self.follow_break();
        self.bdtr != before
    }

    fn is_broken(&self) -> bool {
        let is_active_high = self.bdtr & BKP != 0;
        self.bdtr & BKE != 0 && self.break_level == is_active_high
    }

    /// A break input that is active keeps the outputs disabled, and its flag set (RM0440, using the break function).
    fn follow_break(&mut self) {
        if self.is_broken() {
            self.bdtr &= !MOE;
            self.sr |= BIF;
        }
    }

    /// Flags whose interrupts are enabled: update, and compares.
    pub(crate) fn interrupts(&self) -> (bool, bool) {
        let due = self.sr & self.dier;
        (due & UIF != 0, due & FLAGS & !UIF != 0)
    }

    /// Compare values in use, and whether the outputs are enabled.
    pub(crate) fn compares(&self) -> ([u16; 4], bool) {
        (self.in_use.ccr.map(|ccr| ccr as u16), self.bdtr & MOE != 0)
    }

    pub(crate) fn output(&self, channel: usize) -> Output {
        let is_on = self.ccer >> (4 * channel) & 1 != 0;
        let inverts = self.ccer >> (4 * channel + 1) & 1 != 0;
        let level = |active: bool| active != inverts;
        if self.bdtr & MOE == 0 {
            let idles_high = self.cr2 >> (8 + 2 * channel) & 1 != 0;
            return match self.bdtr & OSSI {
                0 => Output::Floating,
                _ => Output::Level(idles_high),
            };
        }
        if !is_on {
            return match self.bdtr & OSSR {
                0 => Output::Floating,
                _ => Output::Level(inverts),
            };
        }
        let word = self.ccmr[channel / 2] >> (8 * (channel % 2));
        match word >> 4 & 7 | word >> 13 & 8 {
            0b0100 | 0b0000 => Output::Level(level(false)),
            0b0101 => Output::Level(level(true)),
            mode => {
                let is_active_first = mode == 0b0110;
                match self.runs() {
                    true => Output::Until(level(is_active_first), self.match_cycle(channel)),
                    false => {
                        let is_before = u64::from(self.stands_at) < self.in_use.ccr[channel];
                        Output::Level(level(is_before == is_active_first))
                    }
                }
            }
        }
    }

    pub(crate) fn read(&self, at: u32, now: u64) -> Access<u32> {
        Ok(match at {
            offset::CR1 => self.cr1,
            offset::CR2 => self.cr2,
            offset::SMCR => 0,
            offset::DIER => self.dier,
            offset::SR => self.sr,
            offset::CCMR1 => self.ccmr[0],
            offset::CCMR2 if self.channels > 2 => self.ccmr[1],
            offset::CCER => self.ccer,
            offset::CNT => self.count(now) as u32,
            offset::PSC => self.psc,
            offset::ARR => self.arr,
            offset::RCR => self.rcr,
            offset::CCR1..=offset::CCR4 => self.ccr[self.channel(at)?],
            offset::BDTR => self.bdtr,
            _ => return Err(Refused::NotModelled),
        })
    }

    /// Whether a compare value is there.
    pub(crate) fn is_compare(at: u32) -> bool {
        (offset::CCR1..=offset::CCR4).contains(&at)
    }

    fn channel(&self, at: u32) -> Access<usize> {
        let channel = (at - offset::CCR1) as usize / 4;
        match channel < self.channels {
            true => Ok(channel),
            false => Err(Refused::NotModelled),
        }
    }

    /// Writes a register; whether an update event comes of it.
    pub(crate) fn write(&mut self, at: u32, value: u32, now: u64) -> Access<bool> {
        match at {
            offset::CR1 => self.start_or_stop(only(value, CEN | UDIS | URS | ARPE)?, now),
            offset::CR2 => self.cr2 = self.check_cr2(value)?,
            offset::SMCR => drop(only(value, 0)?),
            offset::DIER => self.dier = only(value, FLAGS)?,
            // Written as 0 it is cleared, and as 1 it stays (section 29.6.5).
            offset::SR => {
                self.sr &= value;
                self.follow_break();
            }
            offset::EGR => return self.generate(only(value, UIF)?, now),
            offset::CCMR1 | offset::CCMR2 => {
                let index = (at - offset::CCMR1) as usize / 4;
                self.ccmr[index] = check_compare_mode(value)?;
            }
            offset::CCER => self.ccer = only(value, 0x3333)?,
            offset::CNT => self.set_count(value, now),
            offset::PSC => self.psc = value & 0xffff,
            offset::ARR => {
                self.arr = only(value, 0xffff)?;
                if self.cr1 & ARPE == 0 {
                    self.in_use.arr = self.arr.into();
                }
            }
            offset::RCR => self.rcr = value & 0xffff,
            offset::CCR1..=offset::CCR4 => {
                let channel = self.channel(at)?;
                self.ccr[channel] = only(value, 0xffff)?;
                let is_preloaded = self.ccmr[channel / 2] >> (3 + 8 * (channel % 2)) & 1 != 0;
                if !is_preloaded {
                    self.in_use.ccr[channel] = self.ccr[channel].into();
                }
            }
            offset::BDTR => {
                self.bdtr = only(value, BDTR_MODELLED)?;
                self.follow_break();
            }
            _ => return Err(Refused::NotModelled),
        }
        Ok(false)
    }

    fn check_cr2(&self, value: u32) -> Access<u32> {
        match self.is_advanced {
            true => only(value, MMS2 | IDLE_STATES),
            false => only(value, 0),
        }
    }

    fn start_or_stop(&mut self, value: u32, now: u64) {
        let count = self.count(now) as u32;
        self.cr1 = value;
        self.set_count(count, now);
    }

    fn set_count(&mut self, count: u32, now: u64) {
        self.stands_at = count;
        // A counter that begins late in a new run of the clock has an origin that may be before it.
        self.origin = now.saturating_sub(u64::from(count) * self.count_cycles());
        self.seen = now;
    }

    /// UG: an update now, from which counter and prescaler begin anew (section 29.6.6).
    fn generate(&mut self, value: u32, now: u64) -> Access<bool> {
        if value & UIF == 0 {
            return Ok(false);
        }
        self.update();
        self.set_count(0, now);
        if self.cr1 & URS == 0 {
            self.sr |= UIF;
        }
        Ok(true)
    }
}

/// CCMR: outputs, in the modes that [`Timer::output`] knows; preload.
fn check_compare_mode(value: u32) -> Access<u32> {
    for shift in [0, 8] {
        let channel = value >> shift;
        if channel & 0b11 != 0 {
            return Err(Refused::NotModelled);
        }
        let mode = channel >> 4 & 7 | channel >> 13 & 8;
        if !matches!(mode, 0 | 4..=7) {
            return misuse(format!(
                "output compare mode {mode} is none that this board can use"
            ));
        }
    }
    only(value, 0x0101_7878)
}

#[cfg(test)]
mod tests;
