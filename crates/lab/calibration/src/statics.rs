//! The model at rest, actuator by actuator, and the tables that invert it.

use control_core::CalibrationError;
use control_core::calibration::SensedRises;
use control_core::shape::{KNOTS, SEGMENTS};
use control_core::{
    ActuatorCalibration, InverseTable, KelvinPerWatt, Micrometre, Ohm, PerKelvin, Second,
};
use mirror_model::effect::Acts;
use mirror_model::{ACTUATORS, Interval, Model, simulate};

use crate::curve::Curve;
use crate::error::TabulateError;

/// Drives at which the model is taken to rest. So many leave less than a nanometre between them (`tests/inverse.rs`).
const DRIVES: usize = 256;
/// How long it is left at each (s): longer than any effect's slowest time constant takes.
const REST_S: f64 = 1e7;
/// Step control of the simulation; at rest nothing depends on it.
const RESOLUTION: f64 = 0.5;

/// What memory and clock do is no property of the mirror at rest.
const NOT_AT_REST: [&str; 4] = ["ambient-drift", "softening", "hysteresis", "creep"];

/// The four actuators at rest.
pub(crate) struct Statics([Actuator; ACTUATORS]);

/// One actuator at rest, at drives from 0.
#[derive(Clone)]
struct Actuator {
    drive_v: Vec<f64>,
    z_um: Vec<f64>,
    rise_k: Vec<f64>,
    current_a: Vec<f64>,
}

impl Statics {
    pub(crate) fn new(model: &Model) -> Result<Self, TabulateError> {
        let first = Actuator::of(model, 0)?;
        if are_alike(model) {
            return Ok(Self(std::array::from_fn(|_| first.clone())));
        }
        Ok(Self([
            first,
            Actuator::of(model, 1)?,
            Actuator::of(model, 2)?,
            Actuator::of(model, 3)?,
        ]))
    }

    /// Their numbers; the range is what every one of them reaches.
    pub(crate) fn actuators(&self) -> Result<[ActuatorCalibration; ACTUATORS], TabulateError> {
        let tops = self.0.iter().map(|actuator| actuator.z_um[DRIVES]);
        let top_um = tops.fold(f64::INFINITY, f64::min);
        let [a, b, c, d] = &self.0;
        Ok([
            a.calibration(top_um)?,
            b.calibration(top_um)?,
            c.calibration(top_um)?,
            d.calibration(top_um)?,
        ])
    }
}

impl Actuator {
    /// The mirror with four actuators like this one, all driven alike.
    fn of(model: &Model, index: usize) -> Result<Self, TabulateError> {
        let mut alike = model.clone();
        alike.parameters = model.actuator(index).parameters;
        alike.by_actuator.clear();
        alike.effects.retain(|active| {
            !matches!(active.effect.info().acts, Acts::Motion | Acts::Reading)
                && !NOT_AT_REST.contains(&active.id())
        });
        let top_v = alike.parameters.drive_limit_v;
        let drive_v: Vec<f64> = (0..=DRIVES)
            .map(|i| top_v * i as f64 / DRIVES as f64)
            .collect();
        let held = drive_v
            .iter()
            .map(|&v| Interval::held([v; ACTUATORS], REST_S));
        let outputs = simulate(&alike, &held.collect::<Vec<_>>(), RESOLUTION)?;
        Ok(Self {
            drive_v,
            z_um: outputs.iter().map(|o| o.z_um).collect(),
            rise_k: outputs.iter().map(|o| o.temperature_rise_k[0]).collect(),
            current_a: outputs.iter().map(|o| o.current_a[0]).collect(),
        })
    }

    /// Its numbers, and a table up to `top_um`.
    fn calibration(&self, top_um: f64) -> Result<ActuatorCalibration, TabulateError> {
        let mut calibration = self.electrical_and_heat();
        let squares = self.drive_v.iter().map(|v| v * v).collect();
        let square_at =
            Curve::new(self.z_um.clone(), squares).map_err(|i| TabulateError::NotRising {
                from_v: self.drive_v[i - 1],
                to_v: self.drive_v[i],
            })?;
        let mut knots = [0.0; KNOTS];
        for (i, knot) in knots.iter_mut().enumerate().skip(1) {
            let square = square_at.at(top_um * i as f64 / SEGMENTS as f64);
            *knot = rise_driven_by(&calibration, square) as f32;
        }
        calibration.shape =
            InverseTable::new(Micrometre(top_um as f32), knots).map_err(CalibrationError::from)?;
        Ok(calibration)
    }

    /// Resistance and heat loss as the core knows them, with two numbers each. What these do not
    /// follow goes into the table.
    fn electrical_and_heat(&self) -> ActuatorCalibration {
        let hot = 1..=DRIVES;
        let resistance = |i: usize| self.drive_v[i] / self.current_a[i];
        let loss = |i: usize| self.drive_v[i] * self.current_a[i] / self.rise_k[i];
        let rises = || hot.clone().map(|i| self.rise_k[i]);
        let (cold_ohm, ohm_per_k) = line(rises().zip(hot.clone().map(resistance)));
        let (w_per_k, w_per_k2) = line(rises().zip(hot.clone().map(loss)));
        ActuatorCalibration {
            cold_resistance: Ohm(cold_ohm as f32),
            tcr: PerKelvin((ohm_per_k / cold_ohm) as f32),
            thermal_resistance: KelvinPerWatt((1.0 / w_per_k) as f32),
            loss_growth: PerKelvin((w_per_k2 / w_per_k) as f32),
            slower_by: Second(0.0),
            shape: InverseTable::STRAIGHT,
            sensed_rises: SensedRises::UNKNOWN,
        }
    }
}

/// The temperature rise at which an actuator needs a drive of which this is the square: the core's own
/// equations, in f64.
fn rise_driven_by(actuator: &ActuatorCalibration, square_v2: f64) -> f64 {
    let r0 = f64::from(actuator.cold_resistance.0);
    let (xi, g) = (f64::from(actuator.tcr.0), f64::from(actuator.loss_growth.0));
    let cold_rise = square_v2 / r0 * f64::from(actuator.thermal_resistance.0);
    // dT (1 + g dT) (1 + xi dT) = cold rise; it is convex, so Newton from above does not overshoot.
    let mut rise = cold_rise;
    for _ in 0..60 {
        let value = rise * (1.0 + g * rise) * (1.0 + xi * rise) - cold_rise;
        let slope = 1.0 + 2.0 * (g + xi) * rise + 3.0 * g * xi * rise * rise;
        rise -= value / slope;
    }
    rise
}

/// Least squares of `y = a + b x`.
fn line(points: impl Iterator<Item = (f64, f64)> + Clone) -> (f64, f64) {
    let count = points.clone().count() as f64;
    let sum = |part: fn((f64, f64)) -> f64| points.clone().map(part).sum::<f64>() / count;
    let (x, y) = (sum(|p| p.0), sum(|p| p.1));
    let (xx, xy) = (sum(|p| p.0 * p.0) - x * x, sum(|p| p.0 * p.1) - x * y);
    let slope = xy / xx;
    (y - slope * x, slope)
}

/// Whether the four actuators have the same parameters.
fn are_alike(model: &Model) -> bool {
    let first = model.actuator(0);
    (1..ACTUATORS).all(|index| model.actuator(index) == first)
}
