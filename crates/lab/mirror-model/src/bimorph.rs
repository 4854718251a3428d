//! From temperature rise to displacement: eqs. 5-9.

use crate::Parameters;

/// How far each part of the half actuator bends at one temperature, and the displacement that results.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deflection {
    /// 1/rho of eq. 6, taken equal in both bimorphs as the paper does.
    pub curvature_per_um: f64,
    /// theta_NI, the angle that the non-inverted bimorph turns (eq. 7).
    pub noninverted_angle_rad: f64,
    /// theta_IV, the angle that the inverted bimorph turns back.
    pub inverted_angle_rad: f64,
    /// d_NI of eq. 8.
    pub noninverted_um: f64,
    /// d_IV of eq. 8.
    pub inverted_um: f64,
    /// d_OL of eq. 8.
    pub overlap_um: f64,
    /// z of eqs. 1 and 9, positive towards the substrate.
    pub z_um: f64,
}

impl Deflection {
    /// Eqs. 6-9. A temperature below the reference gives a negative displacement; nothing here is singular at zero.
    pub fn at(parameters: &Parameters, temperature_rise_k: f64) -> Self {
        Self::of(
            parameters,
            Self::curvature_per_um(parameters, temperature_rise_k),
        )
    }

    /// 1/rho of eq. 6, in 1/um.
    pub fn curvature_per_um(parameters: &Parameters, temperature_rise_k: f64) -> f64 {
        let p = parameters;
        p.curvature_coefficient / p.thickness_um * p.expansion_difference_per_k * temperature_rise_k
    }

    /// Eqs. 5 and 7-9, from a curvature in 1/um.
    pub fn of(parameters: &Parameters, curvature: f64) -> Self {
        let p = parameters;
        let noninverted_angle = p.noninverted_length_um * curvature;
        let inverted_angle = p.inverted_length_um * curvature;
        let noninverted = sagitta(p.noninverted_length_um, noninverted_angle);
        let inverted = sagitta(p.inverted_length_um, inverted_angle);
        let overlap = p.overlap_length_um * noninverted_angle.sin();
        Self {
            curvature_per_um: curvature,
            noninverted_angle_rad: noninverted_angle,
            inverted_angle_rad: inverted_angle,
            noninverted_um: noninverted,
            inverted_um: inverted,
            overlap_um: overlap,
            z_um: 2.0 * p.deflection_factor * (noninverted + inverted + overlap),
        }
    }
}

/// Eq. 5, `2 rho sin^2(theta/2)` with `rho = length/angle`, written so that it holds for a straight beam too.
fn sagitta(length_um: f64, angle_rad: f64) -> f64 {
    let half = angle_rad / 2.0;
    let sinc = if half == 0.0 { 1.0 } else { half.sin() / half };
    length_um * half * sinc * sinc
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cold_actuator_is_flat_and_a_cooled_one_bends_the_other_way() {
        assert_eq!(Deflection::at(&Parameters::PAPER, 0.0).z_um, 0.0);
        let (hot, cold) = (
            Deflection::at(&Parameters::PAPER, 50.0),
            Deflection::at(&Parameters::PAPER, -50.0),
        );
        assert_eq!(hot.z_um, -cold.z_um);
    }

    #[test]
    fn the_sagitta_is_that_of_equation_5() {
        let (length, angle) = (250.0_f64, 0.4_f64);
        let rho = length / angle;
        assert!((sagitta(length, angle) - rho * (1.0 - angle.cos())).abs() < 1e-12);
    }
}
