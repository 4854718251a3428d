//! What the displacement sensor adds.

use super::catalogue::{Effect, Effects};
use crate::state::State;

/// The sensor's errors.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Errors {
    offset_um: f64,
    gain: f64,
    ripple_um: f64,
    abbe_um: f64,
}

impl Errors {
    /// Period of a triangulating sensor's error (um).
    const PERIOD_UM: f64 = 110.0;

    pub(crate) fn new(effects: &Effects) -> Self {
        Self {
            offset_um: 0.5 * effects.strength(Effect::SensorOffset),
            gain: 0.01 * effects.strength(Effect::SensorGain),
            ripple_um: 0.4 * effects.strength(Effect::SensorNonlinearity),
            abbe_um: 300.0 * effects.strength(Effect::SensorAbbe),
        }
    }

    /// What the sensor makes of the mirror's state (um), before noise.
    pub(crate) fn read(&self, state: &State) -> f64 {
        let z = state.seen_z_um;
        let ripple = self.ripple_um * (std::f64::consts::TAU * z / Self::PERIOD_UM).sin();
        let abbe = self.abbe_um * state.tilt_y_deg.to_radians().sin();
        self.offset_um + z * (1.0 + self.gain) + ripple + abbe
    }
}

/// Frequency of the sensor's critically damped output filter (Hz).
pub(crate) fn filter_hz(effects: &Effects) -> Option<f64> {
    effects
        .active(Effect::SensorLag)
        .map(|strength| 160.0 / strength)
}
