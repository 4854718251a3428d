//! One parameter from measured points, as the paper identifies R_T from its 173.7 um.

use crate::{Parameters, PistonModel, Symbol};
use thiserror::Error;

/// A steady measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredPoint {
    /// The drive of all four actuators.
    pub voltage_v: f64,
    /// The displacement that it gave.
    pub z_um: f64,
    /// One standard deviation of that displacement, above zero.
    pub uncertainty_um: f64,
}

/// The outcome of [`identify`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Identified {
    /// The best value, in the parameter's own unit.
    pub value: f64,
    /// One standard deviation of it. Where the points scatter more than their uncertainties say, it is widened to match.
    pub standard_error: f64,
    /// Root mean square of what the points are off after the fit.
    pub residual_rms_um: f64,
}

/// Why no value was identified.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum IdentifyError {
    /// Not one point says anything about the parameter.
    #[error("no measured point depends on {0}: at least one with a voltage above 0 V is needed")]
    Uninformative(Symbol),
    /// A number is not finite, or an uncertainty is not positive.
    #[error(
        "point {0} is not usable: voltage and displacement must be finite, the uncertainty above zero"
    )]
    BadPoint(usize),
    /// The steps did not settle on a value inside the parameter's range.
    #[error("no value of {0} within its range of {1} to {2} {3} fits these points")]
    NoValue(Symbol, f64, f64, &'static str),
}

/// Weighted least squares over one parameter (Gauss-Newton, which these nearly linear problems need 3 to 6 steps of).
///
/// # Errors
/// See [`IdentifyError`].
pub fn identify(
    symbol: Symbol,
    start: &Parameters,
    points: &[MeasuredPoint],
) -> Result<Identified, IdentifyError> {
    if let Some(bad) = points.iter().position(|p| !usable(p)) {
        return Err(IdentifyError::BadPoint(bad + 1));
    }
    let entry = symbol.entry();
    let no_value = IdentifyError::NoValue(symbol, entry.range.0, entry.range.1, entry.unit);
    let mut parameters = *start;
    for _ in 0..50 {
        let sums = Sums::at(symbol, &parameters, points);
        if sums.information <= 0.0 {
            return Err(IdentifyError::Uninformative(symbol));
        }
        let value = parameters.get(symbol);
        let step = (sums.gradient / sums.information).clamp(-0.5 * value, value);
        let next = value + step;
        if !(entry.range.0..=entry.range.1).contains(&next) {
            return Err(no_value);
        }
        parameters.set(symbol, next);
        if step.abs() < 1e-14 * value {
            return Ok(sums.conclude(next, points.len()));
        }
    }
    Err(no_value)
}

fn usable(point: &MeasuredPoint) -> bool {
    point.voltage_v.is_finite()
        && point.z_um.is_finite()
        && point.uncertainty_um.is_finite()
        && point.uncertainty_um > 0.0
}

/// The sums of the normal equation.
#[derive(Default)]
struct Sums {
    information: f64,
    gradient: f64,
    cost: f64,
    squares_um2: f64,
}

impl Sums {
    fn at(symbol: Symbol, parameters: &Parameters, points: &[MeasuredPoint]) -> Self {
        let value = parameters.get(symbol);
        let h = 1e-6 * value;
        let shifted = |by: f64| {
            let mut moved = *parameters;
            moved.set(symbol, value + by);
            PistonModel { parameters: moved }
        };
        let (below, here, above) = (
            shifted(-h),
            PistonModel {
                parameters: *parameters,
            },
            shifted(h),
        );
        points.iter().fold(Self::default(), |sums, point| {
            let z = |model: &PistonModel| model.displacement_at_voltage_um(point.voltage_v);
            let weight = point.uncertainty_um.powi(-2);
            let slope = (z(&above) - z(&below)) / (2.0 * h);
            let residual = point.z_um - z(&here);
            Self {
                information: sums.information + weight * slope * slope,
                gradient: sums.gradient + weight * slope * residual,
                cost: sums.cost + weight * residual * residual,
                squares_um2: sums.squares_um2 + residual * residual,
            }
        })
    }

    fn conclude(&self, value: f64, count: usize) -> Identified {
        let scatter = if count > 1 {
            (self.cost / (count - 1) as f64).max(1.0)
        } else {
            1.0
        };
        Identified {
            value,
            standard_error: (scatter / self.information).sqrt(),
            residual_rms_um: (self.squares_um2 / count as f64).sqrt(),
        }
    }
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
            &[point(3.5, 173.7)],
        )
        .unwrap();
        assert_abs_diff_eq!(found.value, 4077.4, epsilon = 0.1);
        assert!(found.residual_rms_um < 1e-9);
        assert!(found.standard_error > 0.1 && found.standard_error < 1.0);
    }

    #[test]
    fn what_says_nothing_is_refused() {
        let identify = |points: &[MeasuredPoint]| {
            identify(Symbol::ThermalResistance, &Parameters::PAPER, points)
        };
        assert!(matches!(
            identify(&[]),
            Err(IdentifyError::Uninformative(_))
        ));
        assert!(matches!(
            identify(&[point(0.0, 0.0)]),
            Err(IdentifyError::Uninformative(_))
        ));
        assert_eq!(
            identify(&[point(1.0, 2.0), point(f64::NAN, 1.0)]),
            Err(IdentifyError::BadPoint(2))
        );
        assert!(matches!(
            identify(&[point(3.5, -100.0)]),
            Err(IdentifyError::NoValue(..))
        ));
    }

    proptest! {
        #[test]
        fn a_known_mirror_is_recovered(truth in 2e3..9e3_f64, beta in 0.6..1.5_f64) {
            let parameters = Parameters { thermal_resistance_k_per_w: truth, curvature_coefficient: beta, ..Parameters::PAPER };
            let model = PistonModel { parameters };
            let points: Vec<_> = (1..=7).map(|i| f64::from(i) * 0.5).map(|v| point(v, model.displacement_at_voltage_um(v))).collect();
            let start = Parameters { curvature_coefficient: beta, ..Parameters::PAPER };
            let found = identify(Symbol::ThermalResistance, &start, &points).unwrap();
            prop_assert!((found.value - truth).abs() < 1e-6 * truth);
            let start = Parameters { thermal_resistance_k_per_w: truth, ..Parameters::PAPER };
            let found = identify(Symbol::CurvatureCoefficient, &start, &points).unwrap();
            prop_assert!((found.value - beta).abs() < 1e-6 * beta);
        }
    }
}
