//! How often the surroundings are looked at.

/// Ticks from one update to the next: each actuator is read once in that time.
pub(crate) const PERIOD: usize = 16;
