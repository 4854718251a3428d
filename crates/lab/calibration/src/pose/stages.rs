//! What of an actuator's stages changes where heat is shared otherwise, and where its loss grows otherwise: at rest the same power holds
//! the same position, at the same resistance, and only the rise in between is another.

use control_core::calibration::{Parts, SENSED_RISES, SensedRises};
use control_core::shape::SEGMENTS;
use control_core::{ActuatorCalibration, CHANNELS, InverseTable, Kelvin};

use super::history::Table;
use super::point::PoseError;
use crate::curve::Curve;
use crate::refine::HeatLoss;

/// Heat that is shared otherwise than in the calibration before.
pub(super) struct Changed<'a> {
    tables: &'a [Table; CHANNELS],
    /// By how much more of a heating at rest is shared, as a part of what was not.
    more_shared: f64,
}

impl<'a> Changed<'a> {
    pub(super) fn new<const POLES: usize>(
        parts: &Parts,
        tables: &'a [Table; CHANNELS],
        more_shared: &[f64; POLES],
    ) -> Self {
        let poles = parts.heat.poles();
        let weights = || poles.iter().map(|pole| f64::from(pole.weight));
        let shared = parts.heat.shared.iter().map(|part| f64::from(*part));
        let before: f64 = weights().zip(shared).map(|(w, part)| w * part).sum();
        let more: f64 = weights().zip(more_shared).map(|(w, part)| w * part).sum();
        Self {
            tables,
            more_shared: more / (1.0 - before),
        }
    }

    /// The rise of an actuator of a level plate that rests where it was `rise` before (K).
    fn level_rise(&self, i: usize, rise: f64, growth: f64) -> f64 {
        let um = self.tables[i].position_um(rise);
        let rises = self.tables.iter().map(|table| table.rise(um));
        let apart = rise - rises.sum::<f64>() / CHANNELS as f64;
        rise - self.more_shared * apart / (1.0 + 2.0 * growth * rise)
    }

    /// The stages of an actuator whose table is bent already, and whose loss grows by so much more (1/K).
    pub(super) fn stages(
        &self,
        actuator: &ActuatorCalibration,
        i: usize,
        more_growth: f64,
    ) -> Result<ActuatorCalibration, PoseError> {
        let loss = |growth: f64| HeatLoss {
            k_per_w: f64::from(actuator.thermal_resistance.0),
            growth,
        };
        let before = loss(f64::from(actuator.loss_growth.0));
        let after = loss(before.growth + more_growth);
        let by_growth = |rise: f64| after.rise(before.heating(rise));
        let mut changed = *actuator;
        changed.loss_growth.0 = after.growth as f32;
        let knots = actuator
            .shape
            .knots()
            .map(|k| by_growth(f64::from(k)) as f32);
        changed.shape = InverseTable::new(actuator.shape.top(), knots)
            .map_err(control_core::CalibrationError::from)?;
        let level = |rise: f64| by_growth(self.level_rise(i, rise, before.growth));
        // The resistance is a straight line of the rise; this one has it right where it is hottest.
        let top = f64::from(actuator.shape.knots()[SEGMENTS]);
        let stretched = top / level(top);
        changed.tcr.0 *= stretched as f32;
        let sensed = &actuator.sensed_rises;
        if sensed.is_known() {
            let rises = (0..SENSED_RISES)
                .map(|knot| f64::from(sensed.top.0) * knot as f64 / (SENSED_RISES - 1) as f64);
            let told = sensed.knots.iter().map(|k| f64::from(*k) / stretched);
            let at = Curve::new(rises.map(level).collect(), told.collect())
                .map_err(|_| PoseError::NotRising(i + 1))?;
            let new_top = level(f64::from(sensed.top.0));
            changed.sensed_rises = SensedRises {
                top: Kelvin(new_top as f32),
                knots: std::array::from_fn(|knot| {
                    at.at(new_top * knot as f64 / (SENSED_RISES - 1) as f64) as f32
                }),
            };
        }
        Ok(changed)
    }
}
