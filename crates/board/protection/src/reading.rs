//! What the watches look at.

use control_core::{AdcCode, Ampere, CHANNELS, SupplyCode};

/// What was sensed during one tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reading {
    /// Current-sense codes.
    pub codes: [AdcCode; CHANNELS],
    /// The currents that they stand for.
    pub currents: [Ampere; CHANNELS],
    /// The output stages' supply.
    pub supply: SupplyCode,
    /// Control ticks before this one that did not take place.
    pub missed_ticks: u16,
    /// The comparators at the outputs have disabled them since they were enabled last.
    pub is_over_voltage: bool,
}
