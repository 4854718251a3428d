//! Times of a day one after the other, which go on over midnight.

use super::cell::Cell;

/// Times of a day go on from the day before where they fall by more than this (s).
const HALF_A_DAY_S: f64 = 43_200.0;
const HOUR_S: f64 = 3600.0;
/// From 12 to 1 o'clock a clock of twelve hours falls by more than this (s); nothing else of one hour at rest does.
const FROM_12_TO_1_S: f64 = 10.0 * HOUR_S;

/// Whether a column tells dates or clock times, and how long ago it began to.
#[derive(Clone, Default)]
pub(super) struct Clock {
    /// Whether it is no duration.
    pub(super) is_one: bool,
    /// Whether a time was no one of twelve hours, as 13:05 and 0:05.
    is_of_24_hours: bool,
    before_s: f64,
    added_s: f64,
}

/// A cell's number, and whether only a clock of twelve hours goes there from the one before.
pub(super) struct TimeNumber {
    pub(super) number: f64,
    pub(super) is_of_12_hours: bool,
}

impl Clock {
    /// The next cell as a number.
    pub(super) fn number(&mut self, cell: Cell) -> TimeNumber {
        self.is_one |= matches!(cell, Cell::Instant(_) | Cell::Clock(_));
        let mut is_of_12_hours = false;
        let number = match cell {
            Cell::Number(number) | Cell::Percent(number) | Cell::Instant(number) => number,
            Cell::Clock(seconds) | Cell::Duration(seconds) => {
                self.is_of_24_hours |= !(HOUR_S..13.0 * HOUR_S).contains(&seconds);
                let fall_s = self.before_s - seconds;
                if fall_s > HALF_A_DAY_S {
                    self.added_s += 2.0 * HALF_A_DAY_S;
                    // What begins a day anew is no duration.
                    self.is_one = true;
                } else if fall_s > FROM_12_TO_1_S && self.is_one && !self.is_of_24_hours {
                    self.added_s += HALF_A_DAY_S;
                    is_of_12_hours = true;
                }
                self.before_s = seconds;
                self.added_s + seconds
            }
        };
        TimeNumber {
            number,
            is_of_12_hours,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_a_day_go_on() {
        for (times, passed) in [
            ([86_399.0, 0.0, 1.0], [0.0, 1.0, 2.0]),
            ([46_799.0, 3600.0, 3601.0], [0.0, 1.0, 2.0]),
            // A clock of 24 hours that has been read anew.
            ([46_800.0, 3601.0, 3602.0], [0.0, -43_199.0, -43_198.0]),
            ([43_300.0, 43_100.0, 43_101.0], [0.0, -200.0, -199.0]),
        ] {
            let mut clock = Clock::default();
            let read = times.map(|time| clock.number(Cell::Clock(time)).number);
            assert_eq!(read.map(|time| time - read[0]), passed);
        }
    }

    /// LibreOffice stores times of a day as durations.
    #[test]
    fn a_duration_that_begins_anew_is_a_clock() {
        let mut clock = Clock::default();
        for (seconds, is_one) in [(86_399.0, false), (0.0, true)] {
            clock.number(Cell::Duration(seconds));
            assert_eq!(clock.is_one, is_one);
        }
    }
}
