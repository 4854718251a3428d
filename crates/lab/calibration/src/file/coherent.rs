//! What the numbers of a file say of each other: each may be a mirror's while all of them together are none, as after one was mistyped.

use std::ops::RangeInclusive;

use control_core::design::HIGHEST_POWER_W;
use control_core::shape::KNOTS;
use control_core::{ActuatorCalibration, Calibration, Kelvin};

/// Power at the top of an actuator's table, as a part of the highest that the board may drive: what is calibrated was driven, with twice
/// that for tables that go on beyond.
const MOST_OF_BOARD: f32 = 2.0;
/// The same as a part of the calibration's own highest power. The table goes up to the highest drive, or ends earlier where another actuator
/// ends the range: a hundredth is far from both, and nearer than kelvins in another unit.
const LEAST_OF_BOUND: f32 = 0.01;
/// The same as a part of what the other actuators take: those of a mirror are made alike, those of virtual ones within a fifth, and a digit too many or too few is a factor of ten.
const OF_OTHERS: RangeInclusive<f32> = 0.25..=4.0;

/// Names the first actuator whose heater does not belong to the highest rise of its table.
pub(super) fn check(calibration: &Calibration) -> Result<(), String> {
    let actuators = calibration.actuators();
    let highest_w = actuators.each_ref().map(power_at_top_w);
    let mut sorted_w = highest_w;
    sorted_w.sort_by(f32::total_cmp);
    let middle_w = (sorted_w[1] * sorted_w[2]).sqrt();
    let bound_w = calibration.parts().bounds.power.0;
    for (i, (actuator, power_w)) in actuators.iter().zip(highest_w).enumerate() {
        let beside = if power_w > MOST_OF_BOARD * HIGHEST_POWER_W {
            told("the board drives at most", HIGHEST_POWER_W)
        } else if power_w < LEAST_OF_BOUND * bound_w {
            told("max_power_w is", bound_w)
        } else if !OF_OTHERS.contains(&(power_w / middle_w)) {
            told("the other actuators take about", middle_w)
        } else {
            continue;
        };
        return Err(format!(
            "with the thermal_resistance_k_per_w of actuator {} the highest rise of its temperature_rise_k, {:.1} K, takes {}, and {beside}",
            i + 1,
            top(actuator).0,
            milliwatts(power_w),
        ));
    }
    Ok(())
}

/// The table rises.
fn top(actuator: &ActuatorCalibration) -> Kelvin {
    Kelvin(actuator.shape.knots()[KNOTS - 1])
}

fn power_at_top_w(actuator: &ActuatorCalibration) -> f32 {
    actuator.power(top(actuator)).0
}

fn told(what: &str, power_w: f32) -> String {
    format!("{what} {}", milliwatts(power_w))
}

fn milliwatts(power_w: f32) -> String {
    format!("{:.3} mW", 1e3 * power_w)
}
