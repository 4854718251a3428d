//! A calibration's stages refined by what a mirror did.
//!
//! The model says which physics there is, with few numbers; the core's stages hold more than these, and a mirror of
//! distributed heat and several memories has more. Thermal poles, the growth of the heat loss and of the time constants, the times of creep and the release
//! of the play operators are fitted by damped least squares, beginning with the model's; in each of their trials the rest follows
//! by linear least squares: a smooth bend of the tables, play operators and creep. Heating is the power that the currents show, and
//! a slow pole warms the heaters as well, which creep does not: both the displacement and the resistances are fitted, so that
//! neither is taken for the other. What the currents show of resistance also makes the actuators' own lines. Play operators let go
//! while nothing moves: a drive that trembles by its own rounding loosens friction.
//!
//! - `timeline`: the session as time steps; `noise`: how exactly each reading can be followed;
//! - `heat`, `thermal`, `linear`, `resistance`: the stages forward; `heaters`: what resistances tell of the poles;
//! - `films`, `unknowns`, `projection`, `fit`: what is sought, and how; `tables`: the outcome.

mod error;
mod films;
mod fit;
mod heat;
mod heaters;
mod linear;
mod noise;
mod projection;
mod resistance;
mod sensed;
mod springs;
mod tables;
mod thermal;
mod timeline;
mod unknowns;

use control_core::calibration::{Heat, Parts, SensedRises};
use control_core::shape::SEGMENTS;
use control_core::{Calibration, Kelvin, Ohm, PerKelvin, Second};
use measurement::Session;

pub use self::error::RefineError;
pub(crate) use self::linear::bend_terms;

use self::fit::{FOLLOWED, Fitted, StagesFit};
use self::noise::Lagging;
use self::tables::Bend;
use self::timeline::Timeline;
use self::unknowns::Unknowns;

/// Fewer readings than this refine nothing: eight for each of the unknowns, 22 nonlinear ones and eight weights of memory.
const FEWEST: usize = 240;
/// Stages that leave more than this part of the range follow nothing: a calibrated mirror is followed forty times closer
/// (`docs/figures/positioning.md`).
const FOLLOWS: f64 = 0.02;

/// What one kelvin of the surroundings is worth, in kelvins of a heater, where nobody has measured it: the bimorphs' ends are
/// colder than their heater's mean, and as warm as the rest in a warm room. Virtual mirrors of the families A, B and D, the
/// paper's and the bench's have 1.007 to 1.032; those with a heater on part of the beam only, or a loss that is uneven along
/// it, more, and are to be measured in another room (`docs/theory/surroundings.md`).
const USUAL_AMBIENT_RATIO: f32 = 1.02;

/// A refined calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Refined {
    /// What a board needs.
    pub calibration: Calibration,
    /// Root mean square of what its stages leave of the displacement (um), each reading weighted by its variance: ringing and
    /// the first moments after a jump count little.
    pub residual_rms_um: f64,
    /// Where the mirror rests, its own memory left out, from where it did at the beginning (um); 0 where films are usual.
    pub rest_um: f64,
}

impl Refined {
    /// What its stages leave where the mirror rests (um, root mean square): friction lets go there otherwise than on its way.
    pub fn rest_rms_um(&self) -> f64 {
        self.residual_rms_um.hypot(noise::HELD_UM)
    }
}

/// `calibration` with its stages refined by a session.
///
/// Only rows whose heating is known count: along a smooth drive, and after a jump of it when they come soon enough, with a
/// current of every driven actuator. What is missing bears no weight.
///
/// # Errors
/// Where too little was measured, or no stages follow it.
pub fn refined(calibration: &Calibration, session: &Session) -> Result<Refined, RefineError> {
    let parts = calibration.parts();
    let best = |lagging, most| {
        let timeline = Timeline::of(session, &parts.path, lagging);
        let readings = timeline.readings();
        if readings < FEWEST {
            return Err(RefineError::TooFew(readings));
        }
        let slow = Timeline::of(session, &parts.path, Lagging::LARGE);
        let fit = StagesFit::new(parts, timeline, slow);
        let fitted = fit.best(most, Unknowns::starts(&parts.heat));
        Ok((fit, fitted))
    };
    let (mut fit, mut fitted) = best(Lagging::USUAL, FOLLOWED)?;
    if !fitted.as_ref().is_some_and(Fitted::follows) {
        // Unusual films may be why.
        (fit, fitted) = best(Lagging::LARGE, 0.0)?;
    }
    let fitted = fitted
        .filter(|fitted| fitted.residual_rms_um < FOLLOWS * fit.thermal.top_um)
        .ok_or(RefineError::NoFit)?;
    Ok(Refined {
        calibration: Calibration::new(refined_parts(parts, &fit, &fitted)?)?,
        residual_rms_um: fitted.residual_rms_um,
        rest_um: fitted.linear.rest_um(),
    })
}

/// The calibration that fitted stages make.
fn refined_parts(parts: &Parts, fit: &StagesFit, fitted: &Fitted) -> Result<Parts, RefineError> {
    let bend = Bend::of(&fitted.linear, fit.thermal.top_um)?;
    let mut actuators = parts.actuators;
    let losses = fit.thermal.losses.iter().zip(&fitted.losses);
    let resistances = fit.resistances(fitted);
    for ((actuator, (before, after)), line) in actuators.iter_mut().zip(losses).zip(&resistances) {
        actuator.shape = bend.table(actuator, before, after)?;
        actuator.loss_growth = PerKelvin(after.growth as f32);
        if let Some(line) = line {
            actuator.cold_resistance = Ohm(line.cold_ohm as f32);
            actuator.tcr = PerKelvin((line.ohm_per_k / line.cold_ohm) as f32);
        }
    }
    let tops_k = actuators
        .each_ref()
        .map(|actuator| f64::from(actuator.shape.knots()[SEGMENTS]));
    let sensed = fit.sensed_rises(fitted, &resistances, tops_k);
    let is_known = sensed.iter().all(Option::is_some);
    for (actuator, sensed) in actuators.iter_mut().zip(sensed) {
        actuator.sensed_rises = sensed.unwrap_or(SensedRises::UNKNOWN);
    }
    // The same heating as before is allowed.
    let losses = fit.thermal.losses.iter().zip(&fitted.losses);
    let hottest = losses
        .map(|(before, after)| after.rise(before.heating(f64::from(parts.bounds.rise.0))))
        .fold(0.0, f64::max);
    let mut bounds = parts.bounds;
    bounds.rise = Kelvin(hottest as f32);
    Ok(Parts {
        actuators,
        heat: Heat {
            beam_lag: Second(fitted.unknowns.beam_lag_s as f32),
            ..fitted.unknowns.network.heat()
        },
        memory: fitted.linear.memory(&fitted.unknowns),
        bounds,
        ambient_ratio: if is_known { USUAL_AMBIENT_RATIO } else { 0.0 },
        ..*parts
    })
}
