//! Which poses the drives hold: where actuators share their heat, the others may hold one warmer than a pose asks of it, and a heater cannot
//! cool.

use control_core::CHANNELS;
use control_core::calibration::{Parts, Plate};

use super::heat::{Each, SharedHeat};
use super::history::positions_um;
use super::tables::{Table, tables};
use crate::plate_pose::PlatePose;

/// Part of what is shared that an actuator's own power must be at the least where a pose is measured: a tenth, which is more than a
/// calibration is off by. An actuator without power tells nothing by its resistance, either.
const LEAST_PART: f64 = 0.1;
/// Bisections of a tilt that is measured: to a thousandth.
const BISECTIONS: usize = 10;

/// The drives under a calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Drives {
    plate: Plate,
    top_um: f64,
    tables: [Table; CHANNELS],
    heat: SharedHeat,
    /// Each resistance at ambient (ohm), and what a kelvin adds.
    ohms: [(f64, f64); CHANNELS],
}

/// An actuator that the heat of the others keeps warm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeptWarm {
    /// Which of the four, from 0.
    pub actuator: usize,
    /// By how much it is warmer than a pose asks without any power of its own (K); below 0: what its own power brings.
    pub k: f64,
}

impl Drives {
    /// Those of a calibration.
    pub fn new(parts: &Parts) -> Self {
        Self {
            plate: parts.plate,
            top_um: f64::from(parts.actuators[0].shape.top().0),
            tables: tables(parts),
            heat: SharedHeat::of(parts),
            ohms: parts.actuators.each_ref().map(|actuator| {
                let cold_ohm = f64::from(actuator.cold_resistance.0);
                (cold_ohm, cold_ohm * f64::from(actuator.tcr.0))
            }),
        }
    }

    /// The voltages that hold a level plate at rest at the top of the range.
    pub fn at_top_v(&self) -> [f64; CHANNELS] {
        let rises = self.tables.each_ref().map(|table| table.rise(self.top_um));
        let watts = self.heat.watts(&self.heat.powers_at_rest(&rises));
        std::array::from_fn(|i| {
            let (cold_ohm, ohm_per_k) = self.ohms[i];
            (watts[i] * (cold_ohm + ohm_per_k * rises[i]))
                .max(0.0)
                .sqrt()
        })
    }

    /// Whether actuators share heat. Where they do not, every pose within the tables' range is held.
    pub fn share_heat(&self) -> bool {
        self.heat.whole_shared() > 0.0
    }

    /// Whether they hold a pose at rest with so much power of each actuator's own that it can be measured there.
    pub fn hold_with_a_margin(&self, pose: &PlatePose) -> bool {
        let rises = self.rises(pose);
        let least = LEAST_PART * self.heat.shared_rise(&rises);
        let powers = self.heat.powers_at_rest(&rises);
        powers.iter().all(|power| *power >= least)
    }

    /// The actuator that is kept warm by most at a pose that is held at rest, where the surroundings alone hold the actuators at `low_um`.
    pub(crate) fn kept_warm_most(&self, pose: &PlatePose, low_um: f64) -> KeptWarm {
        let rises = self.rises(pose);
        // What the surroundings do of a rise, the heaters do not.
        let by_room = |table: &Table| table.rise(low_um) - table.rise(0.0);
        let heated = std::array::from_fn(|i| rises[i] - by_room(&self.tables[i]));
        let own = 1.0 - self.heat.whole_shared();
        let powers = self.heat.powers_at_rest(&heated).into_iter().enumerate();
        let kept_warm = powers.map(|(actuator, power)| KeptWarm {
            actuator,
            k: -own * power,
        });
        kept_warm
            .max_by(|a, b| a.k.total_cmp(&b.k))
            .expect("a mirror has actuators")
    }

    fn rises(&self, pose: &PlatePose) -> Each {
        let um = positions_um(&self.plate, self.top_um, pose);
        std::array::from_fn(|i| self.tables[i].rise(um[i]))
    }

    /// The largest of the tilts up to `most_rad` that can be measured.
    pub(super) fn largest_tilt_rad(&self, most_rad: f64, tilted: impl Fn(f64) -> PlatePose) -> f64 {
        largest(most_rad, BISECTIONS, |rad| {
            self.hold_with_a_margin(&tilted(rad))
        })
    }
}

/// The largest number from 0, which is taken to be held, to `most` that is held, by so many bisections.
pub(crate) fn largest(most: f64, bisections: usize, is_held: impl Fn(f64) -> bool) -> f64 {
    if is_held(most) {
        return most;
    }
    let (mut held, mut not_held) = (0.0, most);
    for _ in 0..bisections {
        let middle = 0.5 * (held + not_held);
        match is_held(middle) {
            true => held = middle,
            false => not_held = middle,
        }
    }
    held
}
