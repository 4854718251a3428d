//! Which poses the drives hold: where actuators share their heat, the others may hold one warmer than a pose asks of it, and a heater cannot
//! cool.

use control_core::CHANNELS;
use control_core::calibration::{Parts, Plate};

use super::heat::SharedHeat;
use super::history::positions_um;
use super::tables::{Table, tables};
use crate::reach::PlatePose;

/// Part of what is shared that an actuator's own power must be at the least: a tenth, which is more than a calibration is off by. An actuator
/// without power tells nothing by its resistance, either.
const LEAST_PART: f64 = 0.1;
/// Bisections of a tilt: to a thousandth.
const BISECTIONS: usize = 10;

/// The drives under a calibration.
#[derive(Clone, Debug)]
pub struct Drives {
    plate: Plate,
    top_um: f64,
    tables: [Table; CHANNELS],
    heat: SharedHeat,
}

impl Drives {
    /// Those of a calibration.
    pub fn new(parts: &Parts) -> Self {
        Self {
            plate: parts.plate,
            top_um: f64::from(parts.actuators[0].shape.top().0),
            tables: tables(parts),
            heat: SharedHeat::of(parts),
        }
    }

    /// Whether they hold a pose at rest.
    pub fn hold(&self, pose: &PlatePose) -> bool {
        let um = positions_um(&self.plate, self.top_um, pose);
        let rises = std::array::from_fn(|i| self.tables[i].rise(um[i]));
        let least = LEAST_PART * self.heat.shared_rise(&rises);
        let powers = self.heat.powers_at_rest(&rises);
        powers.iter().all(|power| *power >= least)
    }

    /// The largest of the tilts up to `most_rad` that they hold.
    pub(super) fn largest_tilt_rad(&self, most_rad: f64, tilted: impl Fn(f64) -> PlatePose) -> f64 {
        if self.hold(&tilted(most_rad)) {
            return most_rad;
        }
        let (mut held, mut not_held) = (0.0, most_rad);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (held + not_held);
            match self.hold(&tilted(middle)) {
                true => held = middle,
                false => not_held = middle,
            }
        }
        held
    }
}
