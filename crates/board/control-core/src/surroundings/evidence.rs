//! What a heater tells at one reading.

use crate::units::{Ampere, Kelvin};

/// One actuator's reading: its thermometer against its stages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evidence {
    /// Temperature that the resistance tells, over ambient at calibration.
    pub(crate) sensed: Kelvin,
    /// Rise that the stages tell.
    pub(crate) rise: Kelvin,
    /// And that of all four in the mean.
    pub(crate) mean_rise: Kelvin,
    /// What the quick poles have still to bring.
    pub(crate) unsettled: Kelvin,
    /// By how much a bound holds it back.
    pub(crate) held_back: Kelvin,
    /// The current that was read.
    pub(crate) current: Ampere,
}
