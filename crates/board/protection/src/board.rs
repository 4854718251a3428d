//! The watch over what all channels share: the comparators at their outputs, the supply, and the beat of the control tick.

use control_core::SupplyCode;
use control_core::design::{HIGHEST_SUPPLY_MV, LOWEST_SUPPLY_MV};

use crate::fault::Fault;
use crate::reading::Reading;

const LOWEST_SUPPLY: SupplyCode = SupplyCode::from_millivolt(LOWEST_SUPPLY_MV);
const HIGHEST_SUPPLY: SupplyCode = SupplyCode::from_millivolt(HIGHEST_SUPPLY_MV);
const TICKS_TO_TRIP: u8 = 3;

/// A missed tick weighs as much as so many good ones.
const MISSED_TICK: u16 = 100;
/// Five missed ticks on end, six within 10 ms, or more than one in a hundred for long.
const TOO_MANY: u16 = 5 * MISSED_TICK;

/// The watch over comparators, supply and ticks.
#[derive(Clone, Debug, Default)]
pub(crate) struct BoardWatch {
    suspect_ticks: u8,
    missed: u16,
}

impl BoardWatch {
    /// One tick, in which the stages had their supply or not. What the comparators say is true at once, since the timer has
    /// filtered it and has acted; and it is said of stages without supply for as long as they have none.
    pub(crate) fn check(&mut self, reading: &Reading, are_supplied: bool) -> Option<Fault> {
        if (LOWEST_SUPPLY.0..=HIGHEST_SUPPLY.0).contains(&reading.supply.0) {
            self.suspect_ticks = 0;
        } else {
            self.suspect_ticks = self.suspect_ticks.saturating_add(1);
        }
        self.missed = self
            .missed
            .saturating_sub(1)
            .saturating_add(reading.missed_ticks.saturating_mul(MISSED_TICK));
        if reading.is_over_voltage && are_supplied {
            Some(Fault::OutputOverVoltage)
        } else if self.suspect_ticks >= TICKS_TO_TRIP {
            Some(Fault::SupplyOutOfRange)
        } else if self.missed >= TOO_MANY {
            Some(Fault::TickOverrun)
        } else {
            None
        }
    }

    /// Forgets what was suspected.
    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOUND: SupplyCode = SupplyCode::from_millivolt(5_000);

    fn check(watch: &mut BoardWatch, supply: SupplyCode, missed_ticks: u16) -> Option<Fault> {
        let reading = Reading {
            supply,
            missed_ticks,
            ..Reading::default()
        };
        watch.check(&reading, true)
    }

    #[test]
    fn a_supply_out_of_range_is_found_in_three_ticks_and_a_glitch_is_none() {
        for millivolt in [0, 4_100, 5_600, 6_599] {
            let bad = SupplyCode::from_millivolt(millivolt);
            let mut watch = BoardWatch::default();
            for supply in [bad, bad, SOUND, bad, bad] {
                assert_eq!(check(&mut watch, supply, 0), None, "{millivolt} mV");
            }
            assert_eq!(check(&mut watch, bad, 0), Some(Fault::SupplyOutOfRange));
        }
    }

    #[test]
    fn a_low_power_usb_port_is_no_fault() {
        // USB 2.0, section 7.2.2: 4.40 V at the port, less 125 mV in the cable.
        let supply = SupplyCode::from_millivolt(4_275);
        let mut watch = BoardWatch::default();
        assert!((0..100).all(|_| check(&mut watch, supply, 0).is_none()));
    }

    #[test]
    fn a_missed_tick_now_and_then_is_borne_and_five_on_end_are_not() {
        let mut watch = BoardWatch::default();
        for tick in 0..10_000 {
            let missed = u16::from(tick % 101 == 0);
            assert_eq!(check(&mut watch, SOUND, missed), None, "tick {tick}");
        }
        watch.clear();
        assert_eq!(check(&mut watch, SOUND, 5), Some(Fault::TickOverrun));
        watch.clear();
        assert_eq!(check(&mut watch, SOUND, u16::MAX), Some(Fault::TickOverrun));
    }
}
