//! A heater that is no mirror's: of other size, other materials, and hundreds of kelvins hot.

/// A heater by what its readings say, before anything is fitted to them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heater {
    /// Resistance at next to no power (ohm).
    pub cold_resistance_ohm: f64,
    /// Relative growth of the resistance (1/K), which voltage and current alone do not tell.
    pub resistance_coefficient_per_k: f64,
    /// Temperature rise at the highest power, as that growth has it (K).
    pub hottest_rise_k: f64,
    /// The same if the coolest reading was as cold as the room: the cold resistance is known no better (K).
    pub least_rise_k: f64,
    /// The highest power (W).
    pub hottest_power_w: f64,
}

/// The range of an effect's strength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strengths {
    /// A usual one.
    pub usual: f64,
    /// The lowest plausible one.
    pub low: f64,
    /// The highest plausible one.
    pub high: f64,
}
