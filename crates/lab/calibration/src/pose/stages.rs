//! What of an actuator's stages changes where heat is shared otherwise, and where its loss grows otherwise: on a level plate at rest the same
//! power holds the same position, at the same resistance, and only the rise in between is another.

use control_core::calibration::{Parts, SENSED_RISES, SensedRises};
use control_core::shape::SEGMENTS;
use control_core::{ActuatorCalibration, CHANNELS, InverseTable, Kelvin};

use super::heat::{SharedHeat, level_rises};
use super::point::PoseError;
use super::tables::Table;
use crate::curve::{Curve, beyond};

/// Heat that is another than in the calibration before.
pub(super) struct Changed<'a> {
    tables: &'a [Table; CHANNELS],
    before: &'a SharedHeat,
    after: &'a SharedHeat,
    /// By which part the rises become smaller where they are highest, in the mean of all four.
    pub(super) stretched: f64,
}

impl<'a> Changed<'a> {
    pub(super) fn new(
        parts: &Parts,
        tables: &'a [Table; CHANNELS],
        (before, after): (&'a SharedHeat, &'a SharedHeat),
    ) -> Self {
        let mut changed = Self {
            tables,
            before,
            after,
            stretched: 1.0,
        };
        let top = |i: usize| f64::from(parts.actuators[i].shape.knots()[SEGMENTS]);
        let stretched = (0..CHANNELS).map(|i| top(i) / changed.level_rise(i, top(i)));
        changed.stretched = stretched.sum::<f64>() / CHANNELS as f64;
        changed
    }

    /// The rise of an actuator of a level plate that rests where it was `rise` before (K).
    fn level_rise(&self, i: usize, rise: f64) -> f64 {
        let um = self.tables[i].position_um(rise);
        level_rises((self.before, self.tables), self.after, um)[i]
    }

    /// The stages of an actuator whose table is bent already, and whose resistance tells so much more than its curve at a position (K, um).
    pub(super) fn stages(
        &self,
        actuator: &ActuatorCalibration,
        i: usize,
        told_apart_k: impl Fn(f64) -> f64,
    ) -> Result<ActuatorCalibration, PoseError> {
        let mut changed = *actuator;
        changed.loss_growth.0 = self.after.growths[i] as f32;
        changed.slower_by.0 = self.after.slower_s[i] as f32;
        let level = |rise: f64| self.level_rise(i, rise);
        let knots = actuator.shape.knots();
        let knots = knots.map(|knot| match knot > 0.0 {
            true => level(f64::from(knot)) as f32,
            false => knot,
        });
        changed.shape = InverseTable::new(actuator.shape.top(), knots)
            .map_err(control_core::CalibrationError::from)?;
        changed.thermal_resistance.0 *= self.after.gains[i] as f32;
        // The resistance is a straight line of the rise; this has it nearly right where it is hottest. All four are stretched alike, for a kelvin
        // of the room must stay the same one to all of them.
        changed.tcr.0 *= self.stretched as f32;
        let sensed = &actuator.sensed_rises;
        if sensed.is_known() {
            let rises = (0..SENSED_RISES)
                .map(|knot| f64::from(sensed.top.0) * knot as f64 / (SENSED_RISES - 1) as f64);
            let apart = rises
                .clone()
                .map(|rise| told_apart_k(self.tables[i].position_um(rise)));
            let knots = sensed.knots.iter().zip(apart);
            let told = knots.map(|(k, apart)| (f64::from(*k) + apart) / self.stretched);
            let at = Curve::new(rises.map(level).collect(), told.collect())
                .map_err(|_| PoseError::NotRising(i + 1))?;
            let new_top =
                level(f64::from(sensed.top.0)).max(f64::from(changed.shape.knots()[SEGMENTS]));
            changed.sensed_rises = SensedRises {
                top: Kelvin(new_top as f32),
                knots: std::array::from_fn(|knot| {
                    let rise = new_top * knot as f64 / (SENSED_RISES - 1) as f64;
                    beyond(|rise| at.at(rise), at.end(), rise) as f32
                }),
            };
        }
        Ok(changed)
    }
}
