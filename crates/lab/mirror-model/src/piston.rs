//! One actuator's chain `V -> R, P -> dT -> z` in steady state, forward and inverse.

use crate::root::increasing_root;
use crate::{Deflection, Parameters};
use thiserror::Error;

/// The piston model with one actuator's parameters: eqs. 1-9 of the paper and their exact inverses.
///
/// All four actuators driven alike move the mirror by what this gives (eq. 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PistonModel {
    /// The numbers that it computes with.
    pub parameters: Parameters,
}

/// Everything that the model says about one steady drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PistonState {
    /// V, the drive.
    pub voltage_v: f64,
    /// dT, the mean temperature rise of the heater (eq. 4).
    pub temperature_rise_k: f64,
    /// R(dT), the hot resistance.
    pub resistance_ohm: f64,
    /// I = V/R.
    pub current_a: f64,
    /// P = V^2/R.
    pub power_w: f64,
    /// The parts of the deflection.
    pub deflection: Deflection,
    /// z, the displacement towards the substrate (eq. 9).
    pub z_um: f64,
}

/// What was asked lies outside what the model can give.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error(
    "{quantity} of {asked:.6} {unit} is out of range: this model goes from {low} to {high:.6} {unit}"
)]
pub struct RangeError {
    /// What was asked for, in words.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The value that was asked for.
    pub asked: f64,
    /// Lowest possible value.
    pub low: f64,
    /// Highest possible value.
    pub high: f64,
}

impl PistonModel {
    /// R(dT) = R0 (1 + xi dT), as used in eq. 3.
    pub fn resistance_ohm(&self, temperature_rise_k: f64) -> f64 {
        self.parameters.cold_resistance_ohm
            * (1.0 + self.parameters.resistance_coefficient_per_k * temperature_rise_k)
    }

    /// The steady power that holds a temperature rise: P = dT/R_T.
    pub fn power_w(&self, temperature_rise_k: f64) -> f64 {
        temperature_rise_k / self.parameters.thermal_resistance_k_per_w
    }

    /// The parts of the deflection at a temperature rise (eqs. 6-9).
    pub fn deflection(&self, temperature_rise_k: f64) -> Deflection {
        Deflection::at(&self.parameters, temperature_rise_k)
    }

    /// z at a temperature rise (eqs. 6-9).
    pub fn displacement_um(&self, temperature_rise_k: f64) -> f64 {
        self.deflection(temperature_rise_k).z_um
    }

    /// Steady dT at a drive (eq. 4), written without the difference that cancels at small drives. The sign of V is moot.
    pub fn temperature_rise_at_voltage(&self, voltage_v: f64) -> f64 {
        let p = &self.parameters;
        let cold_rise =
            p.thermal_resistance_k_per_w * voltage_v * voltage_v / p.cold_resistance_ohm;
        2.0 * cold_rise / ((4.0 * p.resistance_coefficient_per_k * cold_rise + 1.0).sqrt() + 1.0)
    }

    /// z at a drive.
    pub fn displacement_at_voltage_um(&self, voltage_v: f64) -> f64 {
        self.displacement_um(self.temperature_rise_at_voltage(voltage_v))
    }

    /// Every intermediate at a drive.
    pub fn state_at_voltage(&self, voltage_v: f64) -> PistonState {
        let temperature_rise_k = self.temperature_rise_at_voltage(voltage_v);
        let resistance_ohm = self.resistance_ohm(temperature_rise_k);
        let deflection = self.deflection(temperature_rise_k);
        PistonState {
            voltage_v,
            temperature_rise_k,
            resistance_ohm,
            current_a: voltage_v / resistance_ohm,
            power_w: voltage_v * voltage_v / resistance_ohm,
            deflection,
            z_um: deflection.z_um,
        }
    }

    /// The temperature rise at the highest drive.
    pub fn highest_temperature_rise_k(&self) -> f64 {
        self.temperature_rise_at_voltage(self.parameters.drive_limit_v)
    }

    /// The displacement at the highest drive; the inverses accept 0 to this.
    pub fn highest_displacement_um(&self) -> f64 {
        self.displacement_um(self.highest_temperature_rise_k())
    }

    /// The steady temperature rise that gives a displacement, to 1e-9 um.
    ///
    /// # Errors
    /// A displacement outside 0 to [`Self::highest_displacement_um`].
    pub fn temperature_rise_at(&self, z_um: f64) -> Result<f64, RangeError> {
        let high = self.highest_displacement_um();
        self.check("a displacement", "um", z_um, high)?;
        Ok(increasing_root(
            0.0,
            self.highest_temperature_rise_k(),
            |rise| self.displacement_um(rise) - z_um.min(high),
        ))
    }

    /// The steady drive that holds a temperature rise: V = sqrt(P(dT) R(dT)).
    ///
    /// # Errors
    /// A rise outside 0 to [`Self::highest_temperature_rise_k`].
    pub fn voltage_at_temperature_rise(&self, temperature_rise_k: f64) -> Result<f64, RangeError> {
        self.check(
            "a temperature rise",
            "K",
            temperature_rise_k,
            self.highest_temperature_rise_k(),
        )?;
        Ok((self.power_w(temperature_rise_k) * self.resistance_ohm(temperature_rise_k)).sqrt())
    }

    /// The steady drive that gives a displacement, to 1e-9 um.
    ///
    /// # Errors
    /// A displacement outside 0 to [`Self::highest_displacement_um`].
    pub fn voltage_at(&self, z_um: f64) -> Result<f64, RangeError> {
        self.voltage_at_temperature_rise(self.temperature_rise_at(z_um)?)
    }

    /// The top of a range is reached by computing it, so its last bits are forgiven.
    fn check(
        &self,
        quantity: &'static str,
        unit: &'static str,
        asked: f64,
        high: f64,
    ) -> Result<(), RangeError> {
        let forgiven = 1e-12 * high;
        if (0.0..=high + forgiven).contains(&asked) {
            Ok(())
        } else {
            Err(RangeError {
                quantity,
                unit,
                asked,
                low: 0.0,
                high,
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use proptest::prelude::*;

    const PAPER: PistonModel = PistonModel {
        parameters: Parameters::PAPER,
    };

    /// V, dT in K, R in ohm, P in mW, z in um: eqs. 1-9 with Table 1, computed independently of this crate.
    const TABLE: [(f64, f64, f64, f64, f64); 7] = [
        (0.5, 3.90, 365.5, 0.68, 6.88),
        (1.0, 14.96, 381.1, 2.62, 26.39),
        (1.5, 31.69, 404.7, 5.56, 55.86),
        (1.9, 48.09, 427.9, 8.44, 84.62),
        (2.5, 76.20, 467.5, 13.37, 133.44),
        (3.0, 101.84, 503.7, 17.87, 177.25),
        (3.5, 128.86, 541.9, 22.61, 222.39),
    ];

    #[test]
    fn the_papers_own_parameters_give_222_um_and_not_its_173_7() {
        // To the digits of the table.
        for (voltage, rise, resistance, power, z) in TABLE {
            let state = PAPER.state_at_voltage(voltage);
            assert_abs_diff_eq!(state.temperature_rise_k, rise, epsilon = 0.01);
            assert_abs_diff_eq!(state.resistance_ohm, resistance, epsilon = 0.06);
            assert_abs_diff_eq!(state.power_w * 1e3, power, epsilon = 0.01);
            assert_abs_diff_eq!(state.z_um, z, epsilon = 0.01);
            assert_abs_diff_eq!(
                state.current_a * state.current_a * state.resistance_ohm,
                state.power_w,
                epsilon = 1e-12
            );
        }
    }

    #[test]
    fn the_parts_add_up_to_the_whole() {
        let state = PAPER.state_at_voltage(2.0);
        let parts = state.deflection.noninverted_um
            + state.deflection.inverted_um
            + state.deflection.overlap_um;
        assert_abs_diff_eq!(2.0 * 0.921 * parts, state.z_um, epsilon = 1e-12);
    }

    #[test]
    fn out_of_range_says_what_the_range_is() {
        let said = PAPER.voltage_at(300.0).unwrap_err().to_string();
        assert!(
            said.contains("300.0") && said.contains("222.387978 um"),
            "{said}"
        );
        for nonsense in [-0.1, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(PAPER.temperature_rise_at(nonsense).is_err());
            assert!(PAPER.voltage_at_temperature_rise(nonsense).is_err());
        }
    }

    #[test]
    fn both_ends_of_the_range_can_be_asked_for() {
        assert_eq!(PAPER.voltage_at(0.0), Ok(0.0));
        let top = PAPER.voltage_at(PAPER.highest_displacement_um()).unwrap();
        assert_abs_diff_eq!(top, 3.5, epsilon = 1e-9);
    }

    proptest! {
        #[test]
        fn the_inverse_is_exact_to_a_femtometre(
            fraction in 0.0..=1.0_f64, beta in 0.6..1.5_f64, r_t in 1e3..8e3_f64, r0 in 200.0..500.0_f64, xi in 1e-3..5e-3_f64,
        ) {
            let model = PistonModel { parameters: Parameters {
                curvature_coefficient: beta, thermal_resistance_k_per_w: r_t, cold_resistance_ohm: r0,
                resistance_coefficient_per_k: xi, ..Parameters::PAPER
            }};
            let z = fraction * model.highest_displacement_um();
            let rise = model.temperature_rise_at(z).unwrap();
            prop_assert!((model.displacement_um(rise) - z).abs() < 1e-9);
            let voltage = model.voltage_at(z).unwrap();
            prop_assert!((model.displacement_at_voltage_um(voltage) - z).abs() < 1e-9);
        }

        #[test]
        fn more_voltage_is_more_of_everything(low in 0.0..3.4_f64, more in 1e-3..0.1_f64) {
            let (a, b) = (PAPER.state_at_voltage(low), PAPER.state_at_voltage(low + more));
            prop_assert!(a.z_um < b.z_um && a.temperature_rise_k < b.temperature_rise_k);
            prop_assert!(a.resistance_ohm < b.resistance_ohm && a.power_w < b.power_w);
        }
    }
}
