//! What an effect sees of the chain: a moment, and a step from one to the next.

/// What the chain shows at one moment.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moment {
    /// Time from the session's start (s).
    pub t_s: f64,
    /// Voltage at the driver (V).
    pub voltage_v: f64,
    /// Mean square of the voltages at all four drivers (V^2).
    pub mean_square_v2: f64,
    /// Resistance of the heater (ohm).
    pub resistance_ohm: f64,
    /// R0 (1 + xi dT) split: the cold resistance (ohm).
    pub cold_resistance_ohm: f64,
    /// The part of the resistance that grew with temperature (ohm).
    pub grown_resistance_ohm: f64,
    /// Power of this actuator (W).
    pub power_w: f64,
    /// Power of all four (W).
    pub total_power_w: f64,
    /// Power of the actuator across the mirror; they are numbered around it (W).
    pub opposite_power_w: f64,
    /// Currents of the other three (A).
    pub others_current_a: f64,
    /// R_T of this actuator (K/W).
    pub thermal_resistance_k_per_w: f64,
    /// Temperature rise, with that of the surroundings (K).
    pub temperature_rise_k: f64,
    /// Temperature rise of the surroundings since the session's start, where that is known (K).
    pub ambient_k: f64,
    /// Curvature that one kelvin makes (1/(um K)).
    pub curvature_per_k: f64,
    /// Displacement of this actuator, or of the centre for an effect on the whole mirror (um).
    pub z_um: f64,
    /// How long the step is that ends at this moment, while the states are still those of its begin; 0 where they are of now (s).
    /// What comes back to the heat within a step asks for it, so that heat and states agree at the step's end.
    pub step_s: f64,
}

/// One step of the simulation, as an effect with memory sees it.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// The effect's input at the step's start.
    pub from: f64,
    /// The effect's input at its end. In between it runs straight.
    pub to: f64,
    /// The step's length (s).
    pub duration_s: f64,
    /// The chain at its end.
    pub moment: Moment,
}

impl Step {
    /// Where a first-order lag of time constant `tau_s` that was at `x` is after the step; exact for a straight input.
    pub fn relax(&self, x: f64, tau_s: f64) -> f64 {
        relax(x, tau_s, self.from, self.to, self.duration_s)
    }
}

impl Moment {
    /// Where a first-order lag of time constant `tau_s` is now, that was at `x` where its states are of, at an input that has run
    /// straight from `from` to `to` since.
    pub(super) fn lagged(&self, x: f64, tau_s: f64, from: f64, to: f64) -> f64 {
        if self.step_s > 0.0 {
            relax(x, tau_s, from, to, self.step_s)
        } else {
            x
        }
    }
}

/// A first-order lag driven by an input that runs straight from `from` to `to`.
fn relax(x: f64, tau_s: f64, from: f64, to: f64, duration_s: f64) -> f64 {
    if tau_s < 1e-9 {
        return to;
    }
    let behind = (to - from) / duration_s * tau_s;
    to - behind + (x - from + behind) * (-duration_s / tau_s).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_is_exact_however_long_the_step() {
        let (mut fine, coarse) = (0.3, relax(0.3, 0.2, 1.0, 3.0, 1.0));
        for i in 0..1000 {
            let at = |i: i32| 1.0 + 2.0 * f64::from(i) / 1000.0;
            fine = relax(fine, 0.2, at(i), at(i + 1), 1e-3);
        }
        assert!((fine - coarse).abs() < 1e-9);
    }
}
