//! The stage `resistance`, from what the currents told.
//!
//! The core corrects its resistance by what it senses, but only after a while; a course that is right from the start leaves
//! little to correct on the way.

use super::course::Told;

/// A heater's resistance at a temperature rise: a straight line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    pub(super) cold_ohm: f64,
    pub(super) ohm_per_k: f64,
}

impl Line {
    /// The line closest to these readings, each at its rise (K); `None` where they do not tell a heater that grows with
    /// temperature.
    pub(super) fn through(readings: impl Iterator<Item = (f64, Told)>) -> Option<Self> {
        let (mut w, mut x, mut y, mut xx, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (rise, Told { ohm, volts }) in readings {
            // Noise of a current is worth so much less at a higher voltage.
            let weight = volts * volts;
            w += weight;
            x += weight * rise;
            y += weight * ohm;
            xx += weight * rise * rise;
            xy += weight * rise * ohm;
        }
        let ohm_per_k = (w * xy - x * y) / (w * xx - x * x);
        let line = Self {
            cold_ohm: (y - ohm_per_k * x) / w,
            ohm_per_k,
        };
        (line.cold_ohm > 0.0 && line.ohm_per_k > 0.0 && line.ohm_per_k.is_finite()).then_some(line)
    }
}
