//! One parameter from one measured point, as the paper's R_T follows from its 173.7 um.

use crate::root::increasing_root;
use crate::{Parameters, PistonModel, Symbol};

/// A steady measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredPoint {
    /// The drive of all four actuators.
    pub voltage_v: f64,
    /// The displacement that it gave.
    pub z_um: f64,
    /// One standard deviation of that displacement.
    pub uncertainty_um: f64,
}

/// The outcome of [`identify`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Identified {
    /// The value, in the parameter's own unit.
    pub value: f64,
    /// One standard deviation of it, from the point's.
    pub standard_error: f64,
}

/// By how much a bracket grows, up and down, until the root is inside: little enough for the nearest one, a choice.
const GROWTH: f64 = 1.2;

/// The value of a parameter, the closest one to its start, at which the model is at a measured point; `None` where it is not
/// there at any value within the parameter's range.
///
/// One point determines one parameter, so this is the root of a function of one number. Fits to many points are
/// `identification`'s.
pub fn identify(symbol: Symbol, start: &Parameters, point: &MeasuredPoint) -> Option<Identified> {
    let off_um = |value: f64| {
        let mut parameters = *start;
        parameters.set(symbol, value);
        let model = PistonModel { parameters };
        model.displacement_at_voltage_um(point.voltage_v) - point.z_um
    };
    let (low, high) = bracket(start.get(symbol), symbol.entry().range, off_um)?;
    let sign = if off_um(high) >= 0.0 { 1.0 } else { -1.0 };
    let value = increasing_root(low, high, |value| sign * off_um(value));
    // Central difference; the cube root of the rounding.
    let h = f64::EPSILON.cbrt() * value;
    let slope = (off_um(value + h) - off_um(value - h)) / (2.0 * h);
    // Without a slope every value is as good, and the point says nothing of the parameter.
    (slope != 0.0).then(|| Identified {
        value,
        standard_error: point.uncertainty_um / slope.abs(),
    })
}

/// Two values around a start, within a range, between which `f` changes its sign.
fn bracket(start: f64, range: (f64, f64), f: impl Fn(f64) -> f64) -> Option<(f64, f64)> {
    let (mut low, mut high) = (start, start);
    while low > range.0 || high < range.1 {
        low = (low / GROWTH).max(range.0);
        high = (high * GROWTH).min(range.1);
        if f(low) * f(high) <= 0.0 {
            return Some((low, high));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use proptest::prelude::*;

    fn point(voltage_v: f64, z_um: f64) -> MeasuredPoint {
        MeasuredPoint {
            voltage_v,
            z_um,
            uncertainty_um: 0.01,
        }
    }

    #[test]
    fn the_papers_displacement_gives_another_thermal_resistance_than_it_prints() {
        let found = identify(
            Symbol::ThermalResistance,
            &Parameters::PAPER,
            &point(3.5, 173.7),
        )
        .unwrap();
        // To the digit that is given.
        assert_abs_diff_eq!(found.value, 4077.4, epsilon = 0.1);
        // The displacement is nearly in proportion to it: 10 nm of 173.7 um are 0.23 K/W, less what saturates.
        assert!(found.standard_error > 0.23 && found.standard_error < 1.0);
    }

    #[test]
    fn what_no_value_explains_has_none() {
        let identify = |point| identify(Symbol::ThermalResistance, &Parameters::PAPER, &point);
        assert_eq!(identify(point(0.0, 0.0)), None);
        assert_eq!(identify(point(f64::NAN, 1.0)), None);
        assert_eq!(identify(point(3.5, f64::NAN)), None);
        // Longer than the whole mirror.
        assert_eq!(identify(point(3.5, 1e4)), None);
    }

    proptest! {
        #[test]
        fn a_known_mirror_is_recovered(truth in 2e3..9e3_f64, beta in 0.6..1.5_f64, volts in 0.5..3.5_f64) {
            let parameters = Parameters { thermal_resistance_k_per_w: truth, curvature_coefficient: beta, ..Parameters::PAPER };
            let model = PistonModel { parameters };
            let point = point(volts, model.displacement_at_voltage_um(volts));
            let start = Parameters { curvature_coefficient: beta, ..Parameters::PAPER };
            let found = identify(Symbol::ThermalResistance, &start, &point).unwrap();
            // The displacement is known to rounding, and a bracketed root to the place where its sign changes.
            prop_assert!((found.value - truth).abs() < 1e-6 * truth);
            let start = Parameters { thermal_resistance_k_per_w: truth, ..Parameters::PAPER };
            let found = identify(Symbol::CurvatureCoefficient, &start, &point).unwrap();
            prop_assert!((found.value - beta).abs() < 1e-6 * beta);
        }
    }
}
