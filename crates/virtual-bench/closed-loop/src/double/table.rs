//! The tables of one actuator, read forward and backward.

use control_core::calibration::{ActuatorCalibration, Parts};
use control_core::shape::SEGMENTS;

fn knot(actuator: &ActuatorCalibration, i: usize) -> (f64, f64) {
    let top_um = f64::from(actuator.shape.top().0);
    let z_um = top_um * i as f64 / SEGMENTS as f64;
    (z_um, f64::from(actuator.shape.knots()[i]))
}

/// Along a straight line through two points.
fn line((x0, y0): (f64, f64), (x1, y1): (f64, f64), x: f64) -> f64 {
    y0 + (x - x0) / (x1 - x0) * (y1 - y0)
}

/// The table; beyond its ends, its ends.
pub(super) fn rise_k(actuator: &ActuatorCalibration, z_um: f64) -> f64 {
    let top_um = f64::from(actuator.shape.top().0);
    let z_um = z_um.clamp(0.0, top_um);
    let segment = ((z_um / top_um * SEGMENTS as f64) as usize).min(SEGMENTS - 1);
    line(knot(actuator, segment), knot(actuator, segment + 1), z_um)
}

/// The table read forward, straight on beyond its ends.
pub(super) fn position_um(actuator: &ActuatorCalibration, rise_k: f64) -> f64 {
    let above = (1..SEGMENTS).find(|&i| knot(actuator, i).1 > rise_k);
    let segment = above.unwrap_or(SEGMENTS) - 1;
    let turned = |i: usize| {
        let (z_um, rise_k) = knot(actuator, i);
        (rise_k, z_um)
    };
    line(turned(segment), turned(segment + 1), rise_k)
}

/// Where a drive holds the mirror, by the table: a straight line in its square from knot to knot, and beyond the last.
pub(super) fn rest_um(actuator: &ActuatorCalibration, volts: f64) -> f64 {
    let r_t = f64::from(actuator.thermal_resistance.0);
    let growth = f64::from(actuator.loss_growth.0);
    let point = |i: usize| {
        let (z_um, rise) = knot(actuator, i);
        let power_w = rise * (1.0 + growth * rise) / r_t;
        (power_w * resistance_ohm(actuator, rise), z_um)
    };
    let square = volts * volts;
    // The squares rise with the knots.
    let (mut low, mut high) = (0, SEGMENTS);
    while high - low > 1 {
        let middle = (low + high) / 2;
        if point(middle).0 <= square {
            low = middle;
        } else {
            high = middle;
        }
    }
    line(point(low), point(low + 1), square)
}

pub(super) fn resistance_ohm(actuator: &ActuatorCalibration, rise_k: f64) -> f64 {
    f64::from(actuator.cold_resistance.0) * (1.0 + f64::from(actuator.tcr.0) * rise_k)
}

/// Where the first of the actuators is as hot as is allowed.
pub(super) fn hottest_um(parts: &Parts) -> f64 {
    let limit = f64::from(parts.bounds.rise.0);
    let reached = parts.actuators.iter();
    reached
        .filter(|actuator| knot(actuator, SEGMENTS).1 > limit)
        .map(|actuator| position_um(actuator, limit))
        .fold(f64::INFINITY, f64::min)
}
