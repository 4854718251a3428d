//! Time, in cycles of the processor's clock and in seconds.

/// The cycles so far, at a clock that may change.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    /// Cycles of HCLK since power came.
    pub cycles: u64,
    hz: f64,
    changed_cycles: u64,
    changed_s: f64,
}

/// What never comes.
pub(crate) const NEVER: u64 = u64::MAX;

impl Clock {
    pub(crate) fn new(hz: f64) -> Self {
        Self {
            cycles: 0,
            hz,
            changed_cycles: 0,
            changed_s: 0.0,
        }
    }

    /// Seconds since power came.
    pub fn seconds(&self) -> f64 {
        self.seconds_at(self.cycles)
    }

    /// The seconds at a cycle that is not before the clock last changed.
    pub(crate) fn seconds_at(&self, cycle: u64) -> f64 {
        self.changed_s + cycle.saturating_sub(self.changed_cycles) as f64 / self.hz
    }

    /// HCLK (Hz).
    pub fn hz(&self) -> f64 {
        self.hz
    }

    /// From now on at another frequency.
    pub(crate) fn change(&mut self, hz: f64) {
        self.changed_s = self.seconds();
        self.changed_cycles = self.cycles;
        self.hz = hz;
    }

    /// The first cycle that is not before so many seconds since power came.
    pub(crate) fn cycle_at(&self, seconds: f64) -> u64 {
        let after = (seconds - self.changed_s) * self.hz;
        let cycle = self.changed_cycles + after.max(0.0).ceil() as u64;
        // A product that is rounded down must not make what is due come a moment too early, again and again.
        cycle + u64::from(self.seconds_at(cycle) < seconds)
    }

    /// The cycle so many seconds from now.
    pub(crate) fn cycle_in(&self, seconds: f64) -> u64 {
        self.cycles + (seconds * self.hz).ceil() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_goes_on_where_the_clock_changes() {
        let mut clock = Clock::new(16e6);
        clock.cycles = 1600;
        clock.change(170e6);
        clock.cycles += 170;
        assert!((clock.seconds() - 101e-6).abs() < 1e-12);
        assert_eq!(clock.cycle_at(102e-6), 1600 + 340);
    }
}
