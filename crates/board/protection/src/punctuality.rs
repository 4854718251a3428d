//! Which control ticks did not take place, by a clock that goes on while nobody looks.

/// A control tick (us).
const TICK_US: u16 = 100;

/// Tells the ticks that were missed from those that came late. An interrupt that is kept from running for longer than a
/// tick is one interrupt afterwards, however many ticks it stands for; a clock knows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Punctuality {
    /// When the next tick is due, by a clock of 16 bits (us): a period after the earliest, so that one that came late
    /// makes no other late.
    due_us: Option<u16>,
}

impl Punctuality {
    /// Before the first tick.
    pub const fn new() -> Self {
        Self { due_us: None }
    }

    /// A tick takes place at `now_us`, by a clock of 16 bits that is derived from the same oscillator as the ticks; how
    /// many before it did not. Good for up to 32 ms without a tick.
    pub fn missed_before(&mut self, now_us: u16) -> u16 {
        let late_us = self
            .due_us
            .map_or(0, |due_us| now_us.wrapping_sub(due_us).cast_signed());
        let missed = late_us.max(0).unsigned_abs() / TICK_US;
        // Less than a period ago, or now.
        let due_us = now_us.wrapping_sub(late_us.max(0).unsigned_abs() % TICK_US);
        self.due_us = Some(due_us.wrapping_add(TICK_US));
        missed
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    /// What is missed before each of the ticks that take place at these times.
    fn missed(times_us: &[u16]) -> Vec<u16> {
        let mut punctuality = Punctuality::new();
        let missed = |now_us: &u16| punctuality.missed_before(*now_us);
        times_us.iter().map(missed).collect()
    }

    #[test]
    fn ticks_in_time_and_late_ones_are_none_that_were_missed() {
        assert_eq!(missed(&[7, 107, 207]), [0, 0, 0]);
        // The first comes late itself; the others were earlier.
        assert_eq!(missed(&[60, 107, 207, 307]), [0, 0, 0, 0]);
        assert_eq!(missed(&[0, 199, 200, 300, 399, 400]), [0; 6]);
    }

    #[test]
    fn ticks_that_did_not_take_place_are_counted_once() {
        assert_eq!(missed(&[0, 100, 300, 400, 500]), [0, 0, 1, 0, 0]);
        assert_eq!(missed(&[0, 1150, 1200, 1300]), [0, 10, 0, 0]);
    }

    #[test]
    fn the_clock_may_begin_anew() {
        assert_eq!(missed(&[65_450, 14, 114, 414]), [0, 0, 0, 2]);
    }
}
