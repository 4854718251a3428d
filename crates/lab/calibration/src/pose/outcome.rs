//! The calibration that a plate makes: its levers, each actuator's own table, and where the range ends.

use std::f64::consts::SQRT_2;

use control_core::calibration::{Lever, Parts, Plate, Residual};
use control_core::shape::SEGMENTS;
use control_core::{CHANNELS, Calibration, Micrometre};
use nalgebra::{Matrix3, Matrix3x4, Vector4};

use super::drives::{Drives, largest};
use super::fit::{Found, PlateFit};
use super::history::positions_um;
use super::plausible;
use super::point::{PoseError, PosePoint};
use super::stages::Changed;
use crate::correct::bent;
use crate::curve::Curve;
use crate::residual::{LEAST_UM, UNTRIED};

/// Positions may end so far beyond the measured part of a table, of that part: a tenth beyond, the resistances of the paper's virtual mirror
/// tell so much otherwise than their curves, as they go on, that it is taken for another.
const BEYOND: f64 = 0.06;
/// Bisections of the range's end: to a hundredth of a micrometre.
const BISECTIONS: usize = 14;

/// The calibration that a plate makes.
pub(super) struct Outcome<'a> {
    pub(super) parts: &'a Parts,
    pub(super) fit: &'a PlateFit,
    pub(super) found: &'a Found,
}

impl Outcome<'_> {
    /// Up to where the drives hold a level plate, and no heater is warmer than before.
    pub(super) fn calibration(&self, points: &[PosePoint]) -> Result<Calibration, PoseError> {
        let rms_um = self.fit.rms_um(self.found);
        let plate = self.plate().ok_or(PoseError::Unfit)?;
        plausible::check_plate(&plate, &self.parts.plate)?;
        plausible::check_rest(points, self.fit.top_um, self.fit.lever_um, rms_um.1)?;
        let places: Vec<f64> = (0..=SEGMENTS)
            .map(|step| step as f64 / SEGMENTS as f64)
            .collect();
        plausible::check_piston(self.found, self.fit.top_um, &places, self.tried_um())?;
        let changed = Changed::new(
            self.parts,
            &self.fit.tables,
            (&self.fit.heat, &self.found.heat),
        );
        let asked_at = self.asked_at(&places)?;
        let ends_um = asked_at.iter().map(Curve::end);
        let measured_um = ends_um.fold(f64::INFINITY, f64::min);
        let mut common = Parts {
            plate,
            sensed_crosstalk: self.found.sensed_crosstalk as f32,
            residual: self.residual(rms_um, measured_um, points),
            ..*self.parts
        };
        common.heat.shared = self.found.heat.shared.map(|part| part as f32);
        // At the same resistance, for all four.
        common.bounds.rise.0 /= changed.stretched as f32;
        let up_to = |top_um: f64| {
            let mut actuators = self.parts.actuators;
            for (i, actuator) in actuators.iter_mut().enumerate() {
                let told_apart_k = |um| self.found.told_apart_k(i, um / self.fit.top_um);
                actuator.shape = bent(actuator, top_um, &asked_at[i])?;
                *actuator = changed.stages(actuator, i, told_apart_k)?;
            }
            Ok::<_, PoseError>(Parts {
                actuators,
                ..common
            })
        };
        let most_um = (1.0 + BEYOND) * measured_um;
        let top_um = largest(most_um, BISECTIONS, |um| {
            up_to(um).is_ok_and(|it| is_held(&it))
        });
        let mut parts = up_to(top_um)?;
        parts.residual.tried.0 = measured_um.min(top_um) as f32;
        Ok(Calibration::new(parts)?)
    }

    /// What was asked of each actuator where it went (um).
    fn asked_at(&self, places: &[f64]) -> Result<[Curve; CHANNELS], PoseError> {
        let counted = self.counted(places)?;
        let top_um = self.fit.top_um;
        let mut all = Vec::with_capacity(CHANNELS);
        for i in 0..CHANNELS {
            let asked_um = places.iter().map(|place| place * top_um);
            let taken = places
                .iter()
                .map(|place| counted.at(self.found.shape_um(i, *place, top_um)));
            let curve = Curve::new(taken.collect(), asked_um.collect());
            all.push(curve.map_err(|_| PoseError::NotRising(i + 1))?);
        }
        Ok(all.try_into().expect("one of each actuator"))
    }

    /// From what was found of a level plate's piston to what it is counted as (um). So far as the piston was tried before, its curve is known
    /// better than by these poses, and stays.
    fn counted(&self, places: &[f64]) -> Result<Curve, PoseError> {
        let top_um = self.fit.top_um;
        let found_um = |place: f64| self.found.piston_um(place, top_um);
        let tried = places
            .iter()
            .take_while(|place| **place * top_um <= self.tried_um());
        let last_tried = tried.last().copied().unwrap_or_default();
        let counted = places.iter().map(|place| match *place <= last_tried {
            true => place * top_um,
            false => last_tried * top_um + found_um(*place) - found_um(last_tried),
        });
        let found = places.iter().map(|place| found_um(*place));
        Curve::new(found.collect(), counted.collect()).map_err(|_| PoseError::NotRising(1))
    }

    /// Up to where the piston was tried before (um).
    fn tried_um(&self) -> f64 {
        let residual = &self.parts.residual;
        match residual.is_known() {
            true => residual.tried.0.into(),
            false => 0.0,
        }
    }

    /// What is unknown of a plate whose poses leave this, measured up to there. The difference of two actuators tilts it, each with
    /// half of it.
    fn residual(
        &self,
        (piston_um, tilts_um): (f64, f64),
        measured_um: f64,
        points: &[PosePoint],
    ) -> Residual {
        let before = &self.parts.residual;
        let asked = points
            .iter()
            .flat_map(|point| positions_um(&self.parts.plate, self.fit.top_um, &point.asked));
        let squares: f64 = asked.map(|um| um * um).sum();
        let asked_um = (squares / (points.len() * CHANNELS) as f64).sqrt();
        let left_um = piston_um.max(LEAST_UM) as f32;
        let before_um = before.piston.0;
        let piston_um = match self.tried_um() {
            tried_um if tried_um >= measured_um => before_um,
            tried_um if tried_um > 0.0 => before_um.max(left_um),
            _ => left_um,
        };
        Residual {
            piston: Micrometre(piston_um),
            part: UNTRIED.part,
            apart: (SQRT_2 * tilts_um / asked_um) as f32,
            ..*before
        }
    }

    fn plate(&self) -> Option<Plate> {
        let shares = &self.found.shares;
        let square: Matrix3<f64> = shares * shares.transpose();
        let levers = shares.transpose() * square.try_inverse()?;
        let warp = warp(shares);
        let mut plate = Plate::UNKNOWN;
        for (i, lever) in plate.levers.iter_mut().enumerate() {
            *lever = Lever {
                x: Micrometre((-levers[(i, 2)] * self.fit.lever_um) as f32),
                y: Micrometre((levers[(i, 1)] * self.fit.lever_um) as f32),
                warp: warp[i] as f32,
            };
        }
        Some(plate)
    }
}

/// Whether the drives hold a level plate at the top of the range, where no heater is warmer than it may be.
fn is_held(parts: &Parts) -> bool {
    let drive_v = f64::from(parts.bounds.drive.0);
    let tops = parts.actuators.iter().map(|it| it.shape.knots()[SEGMENTS]);
    Drives::new(parts).at_top_v().iter().all(|v| *v <= drive_v)
        && tops.into_iter().all(|k| k <= parts.bounds.rise.0)
}

/// The direction of the actuators' positions that does not move the plate, its largest part 1.
fn warp(shares: &Matrix3x4<f64>) -> Vector4<f64> {
    let minor = |skipped: usize| {
        let sign = if skipped.is_multiple_of(2) { 1.0 } else { -1.0 };
        sign * shares.remove_column(skipped).determinant()
    };
    let warp = Vector4::new(minor(0), minor(1), minor(2), minor(3));
    warp / warp[warp.iamax()]
}
