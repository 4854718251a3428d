//! Which poses the drives hold at rest, in the room where the board is. Where actuators share their heat, the others may hold one warmer than
//! a pose asks of it, and a heater cannot cool; and one that is to be hotter than the others has less warm ones around it than on a level
//! plate, and may take more than the highest drive.

use control_core::calibration::{Parts, Plate};
use control_core::surroundings::{beyond_the_curves, platinum_kelvin};
use control_core::{CHANNELS, Estimate};

use super::heat::{Each, SharedHeat};
use super::history::positions_um;
use super::tables::{SensedCurve, Table, tables};
use crate::plate_pose::PlatePose;

/// Part of what is shared that an actuator's own power must be at the least where a pose is measured: a tenth, which is more than a
/// calibration is off by. An actuator without power tells nothing by its resistance, either.
const LEAST_PART: f64 = 0.1;
/// Bisections of a tilt that is measured: to a thousandth.
const BISECTIONS: usize = 10;

/// Steps of Newton's method for a target in another room: each leaves as much of what the one before left as the air has changed by, a fifth
/// at most (docs/requirements.md), so that of 20 K less than a millikelvin is left.
const NEWTON_STEPS: usize = 8;

/// The drives under a calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Drives {
    plate: Plate,
    top_um: f64,
    tables: [Table; CHANNELS],
    heat: SharedHeat,
    /// Each resistance at ambient (ohm), and what a kelvin adds.
    ohms: [(f64, f64); CHANNELS],
    /// What a resistance tells; `None` where the calibration does not know it.
    curves: Option<[SensedCurve; CHANNELS]>,
    highest_v: f64,
    highest_w: f64,
    /// Kelvins of a heater that one of the surroundings is worth, and those of a thermometer for each that resistances tell.
    ambient_ratio: f64,
    platinum_kelvin: f64,
    room: Option<Room>,
    /// What an actuator may be off by and a pose is held all the same (K).
    borne_k: f64,
}

/// What is around the mirror, against its calibration, in kelvins that the resistances tell.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Room {
    rise_k: f64,
    deviation_k: f64,
    loss: f64,
}

/// An actuator that the drives do not take to where a pose has it at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NotHeld {
    /// Which of the four, from 0.
    pub actuator: usize,
    /// By how much it is warmer or less warm than the pose asks (K); below 0: what is left to that.
    pub k: f64,
    /// Why.
    pub cause: Cause,
}

/// Why the drives do not take an actuator to where a pose has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Heat of the others keeps it too warm, and a heater cannot cool.
    KeptWarm,
    /// It would take more than the highest drive.
    HighestDrive,
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
            curves: SensedCurve::of_all(parts),
            highest_v: f64::from(parts.bounds.drive.0),
            highest_w: f64::from(parts.bounds.power.0),
            ambient_ratio: f64::from(parts.ambient_ratio),
            platinum_kelvin: f64::from(platinum_kelvin(parts)),
            room: None,
            borne_k: 0.0,
        }
    }

    /// The same in surroundings that a board knows and compensates; nothing is known of them under a calibration that cannot tell.
    pub fn around(self, estimate: &Estimate) -> Self {
        let is_known = self.curves.is_some() && self.ambient_ratio > 0.0;
        let told_k = |k: f32| f64::from(k) / self.platinum_kelvin;
        let room = Room {
            rise_k: told_k(estimate.rise.0),
            deviation_k: told_k(estimate.rise_deviation.0),
            loss: f64::from(estimate.loss),
        };
        Self {
            room: is_known.then_some(room),
            ..self
        }
    }

    /// The same in the room of the calibration.
    pub(crate) fn at_home(self) -> Self {
        Self { room: None, ..self }
    }

    /// With what an actuator is hardly off by in a room that is estimated, at rest so far (um): no estimate is the same twice.
    pub(crate) fn bearing(self, um: f64) -> Self {
        let hardly_k = self.tables[0].rise(um);
        Self {
            borne_k: self.room.map_or(0.0, |_| hardly_k),
            ..self
        }
    }

    /// What an actuator may be off by and a pose is held all the same (K).
    pub(crate) fn borne_k(&self) -> f64 {
        self.borne_k
    }

    /// How far the ends of the range may be from where they are told to be, for what is not known of the room (um, standard deviation); `None`
    /// where nothing is compensated.
    pub(crate) fn ends_deviation_um(&self) -> Option<f64> {
        let (room, curves) = (self.room?, self.curves.as_ref()?);
        let of_a_heater = |i: usize| {
            let (_, first_slope) = curves[i].at(0.0);
            let k = self.ambient_ratio * room.deviation_k / first_slope;
            let at_top_k = self.tables[i].rise(self.top_um);
            let at_top_um = self.top_um - self.tables[i].position_um(at_top_k - k);
            self.tables[i].position_um(k).max(at_top_um)
        };
        (0..CHANNELS).map(of_a_heater).max_by(f64::total_cmp)
    }

    /// The voltages that hold a level plate at rest at the top of the range.
    pub fn at_top_v(&self) -> [f64; CHANNELS] {
        let rises = self.tables.each_ref().map(|table| table.rise(self.top_um));
        let watts = self.heat.watts(&self.heat.powers_at_rest(&rises));
        std::array::from_fn(|i| (watts[i] * self.ohm(i, rises[i])).max(0.0).sqrt())
    }

    fn ohm(&self, actuator: usize, rise: f64) -> f64 {
        let (cold_ohm, ohm_per_k) = self.ohms[actuator];
        cold_ohm + ohm_per_k * rise
    }

    /// Whether they may hold less than the tables' range: where actuators share heat, and in another room.
    pub(crate) fn may_hold_less(&self) -> bool {
        self.heat.whole_shared() > 0.0 || self.room.is_some()
    }

    /// Whether they hold a pose at rest with so much power of each actuator's own that it can be measured there.
    pub fn hold_with_a_margin(&self, pose: &PlatePose) -> bool {
        let rises = self.rises(pose);
        let least = LEAST_PART * self.heat.shared_rise(&rises);
        let powers = self.heat.powers_at_rest(&rises);
        powers.iter().all(|power| *power >= least)
    }

    /// The actuator that is off by most, or nearest to it, at a pose that is to be held at rest.
    pub(crate) fn farthest_off(&self, pose: &PlatePose) -> NotHeld {
        let asked = self.rises(pose);
        let in_room: [_; CHANNELS] = std::array::from_fn(|i| self.in_room(i, asked[i]));
        // All four at once: what they share is what all of them bring.
        let powers = self.heat.powers_at_rest(&in_room.map(|(rise, _)| rise));
        let watts_per_kelvin = self.heat.watts(&[1.0; CHANNELS]);
        let own = 1.0 - self.heat.whole_shared();
        let both = (0..CHANNELS).flat_map(|actuator| {
            let by_drive_w = self.highest_v.powi(2) / self.ohm(actuator, in_room[actuator].1);
            let most = by_drive_w.min(self.highest_w) / watts_per_kelvin[actuator];
            [
                (Cause::KeptWarm, -powers[actuator]),
                (Cause::HighestDrive, powers[actuator] - most),
            ]
            .map(|(cause, off)| NotHeld {
                actuator,
                k: own * off,
                cause,
            })
        });
        both.max_by(|a, b| a.k.total_cmp(&b.k))
            .expect("a mirror has actuators")
    }

    /// The rise of the stages for which the core drives an actuator that is to bend as at `rise` in the room of the calibration
    /// (`control_core`, `surroundings.rs`, where a step of Newton's method is made at a time), and what its resistance tells there (K).
    fn in_room(&self, actuator: usize, rise: f64) -> (f64, f64) {
        let Some(curves) = &self.curves else {
            return (rise, rise);
        };
        let (curve, growth) = (&curves[actuator], self.heat.growths[actuator]);
        let (told_k, _) = curve.at(rise);
        let Some(room) = self.room else {
            return (rise, told_k);
        };
        let (_, first_slope) = curve.at(0.0);
        let wanted_k = told_k + (1.0 - self.ambient_ratio) * room.rise_k;
        let of_room_k = room.rise_k * (1.0 + growth / first_slope * room.rise_k);
        let mut target = rise;
        for _ in 0..NEWTON_STEPS {
            let (there_k, slope) = curve.at(target);
            let left_k = wanted_k - there_k;
            let halfway = target + 0.5 * left_k / slope;
            let heating_k = target * (1.0 + growth * target) * first_slope;
            let sensitivity = (1.0 + 2.0 * growth * halfway) * first_slope / slope;
            let apart_k = (of_room_k - room.loss * heating_k) / sensitivity;
            target += (left_k - apart_k) / slope;
        }
        let unknown = room.deviation_k.powi(2);
        let compensated = beyond_the_curves((target - rise) as f32, unknown as f32);
        (rise + f64::from(compensated), wanted_k)
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
