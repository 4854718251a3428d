//! Power and temperature of the four actuators, which agree at the end of every step.

use super::Simulation;
use super::actuator::{POLES, poles};
use super::fixed_point::Secant;
use super::pole::Pole;
use super::running::{Running, advance};
use crate::ACTUATORS;
use crate::effect::Acts;

/// Rounds that the fixed point of power and temperature takes at most (secants need about five), and at most where a step was
/// taken back.
const ROUNDS: usize = 12;
const MORE_ROUNDS: usize = 40;
/// Temperatures that agree so well are the same (K): 10 pm of z at the 1 um/K of such mirrors.
const SAME_K: f64 = 1e-5;

impl Simulation<'_> {
    /// Moves the temperatures on by `h`, so that power and temperature agree at its end. With `h` = 0 only the power
    /// changes.
    pub(super) fn heat(&mut self, voltage_v: [f64; ACTUATORS], h: f64) {
        let poles = poles(&self.actuators, h);
        let is_changed = self.effects.iter().any(Running::is_on_the_way);
        if is_changed || !self.agree_at_once(voltage_v, &poles, h) {
            self.agree_in_rounds(voltage_v, &poles, h);
        }
        if is_changed && h > 0.0 {
            self.remember(h);
        }
    }

    /// The same where nothing but eqs. 3 and 4 lies between power and temperature, from the root of their quadratic equation; whether
    /// there is one.
    fn agree_at_once(
        &mut self,
        voltage_v: [f64; ACTUATORS],
        poles: &[[Pole; POLES]; ACTUATORS],
        h: f64,
    ) -> bool {
        let mut ohm = [0.0; ACTUATORS];
        for (index, found) in ohm.iter_mut().enumerate().take(self.computed) {
            let Some(agreed) = self.actuators[index].agreed_ohm(
                &poles[index],
                voltage_v[index],
                self.ambient_k,
                h,
            ) else {
                return false;
            };
            *found = agreed;
        }
        let computed = &mut self.actuators[..self.computed];
        for (index, actuator) in computed.iter_mut().enumerate() {
            let from_k = actuator.heating_k;
            actuator.at_ohm(ohm[index], voltage_v[index]);
            if h > 0.0 {
                actuator.poles_k = std::array::from_fn(|k| {
                    poles[index][k].after(actuator.poles_k[k], from_k, actuator.heating_k)
                });
            }
            actuator.now.t_s = self.t_s;
            actuator.now.ambient_k = self.ambient_k;
            actuator.now.step_s = 0.0;
            actuator.now.temperature_rise_k = self.ambient_k + actuator.raw_temperature();
        }
        if !self.effects.is_empty() {
            self.look_at_the_others(voltage_v);
        }
        true
    }

    /// Tells each actuator of the others' drives, powers and currents.
    fn look_at_the_others(&mut self, voltage_v: [f64; ACTUATORS]) {
        let mean_square_v2 =
            voltage_v.map(|volts| volts * volts).iter().sum::<f64>() / ACTUATORS as f64;
        let powers_w = self.each().map(|actuator| actuator.now.power_w);
        let currents_a = self.each().map(|actuator| actuator.current_a);
        let computed = &mut self.actuators[..self.computed];
        for (index, actuator) in computed.iter_mut().enumerate() {
            actuator.now.mean_square_v2 = mean_square_v2;
            actuator.now.total_power_w = powers_w.iter().sum();
            actuator.now.others_current_a = currents_a.iter().sum::<f64>() - currents_a[index];
            actuator.now.opposite_power_w = powers_w[(index + ACTUATORS / 2) % ACTUATORS];
        }
    }

    /// The same by secants, whatever effects there are.
    fn agree_in_rounds(
        &mut self,
        voltage_v: [f64; ACTUATORS],
        poles: &[[Pole; POLES]; ACTUATORS],
        h: f64,
    ) {
        let start: [_; ACTUATORS] = std::array::from_fn(|i| {
            let actuator = &self.actuators[i];
            (actuator.poles_k, actuator.heating_k)
        });
        let mut secants: [_; ACTUATORS] = std::array::from_fn(|i| {
            let from = (h > 0.0).then(|| self.actuators[i].raw_temperature());
            Secant::new(self.actuators[i].slope(&poles[i]), from)
        });
        for round in 1..=MORE_ROUNDS {
            self.look_at_the_others(voltage_v);
            let (mut moved_k, mut off_k): (f64, f64) = (0.0, 0.0);
            let computed = &mut self.actuators[..self.computed];
            for (index, actuator) in computed.iter_mut().enumerate() {
                let before_k = actuator.now.temperature_rise_k;
                let guess = actuator.heating_k;
                actuator.now.t_s = self.t_s;
                actuator.now.ambient_k = self.ambient_k;
                actuator.now.step_s = h;
                let (start_k, heating) = &start[index];
                if h > 0.0 {
                    let heating_now = actuator.heating_k;
                    actuator.poles_k = std::array::from_fn(|k| {
                        poles[index][k].after(start_k[k], *heating, heating_now)
                    });
                }
                actuator.electrical(index, voltage_v[index], &self.effects);
                moved_k = moved_k.max((actuator.now.temperature_rise_k - before_k).abs());
                off_k = off_k.max((actuator.heating_k - guess).abs());
                actuator.heating_k = secants[index].next(guess, actuator.heating_k);
            }
            let is_found = off_k < SAME_K && moved_k < SAME_K;
            if is_found || (round >= ROUNDS && !secants.iter().any(|s| s.has_retreated)) {
                break;
            }
        }
        for actuator in &mut self.actuators {
            actuator.now.step_s = 0.0;
        }
    }

    /// Moves the states of the effects on the way on by `h`.
    fn remember(&mut self, h: f64) {
        let computed = &mut self.actuators[..self.computed];
        for (index, actuator) in computed.iter_mut().enumerate() {
            let raw = actuator.raw_temperature();
            advance(
                &mut self.effects,
                &[Acts::Voltage, Acts::Resistance, Acts::Heating],
                index,
                actuator.heating_k,
                &actuator.now,
                h,
            );
            advance(
                &mut self.effects,
                &[Acts::Temperature],
                index,
                raw,
                &actuator.now,
                h,
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Model, Preset, Symbol};

    /// The temperature rises and currents after some steps of different lengths and drives.
    fn after_steps(
        model: &Model,
        step: impl Fn(&mut Simulation, [f64; ACTUATORS], f64),
    ) -> Vec<f64> {
        let mut simulation = Simulation::new(model, 0.3);
        simulation.compute_each();
        let drives = [
            ([1.0, 2.0, 0.5, 3.0], 1e-4),
            ([1.0, 2.0, 0.5, 3.0], 3e-2),
            ([4.0, 0.0, 0.0, 3.0], 2e-3),
            ([0.0, 0.1, 2.0, 2.0], 5.0),
        ];
        let seen = drives.into_iter().map(|(voltage_v, h)| {
            step(&mut simulation, voltage_v, 0.0);
            step(&mut simulation, voltage_v, h);
            let seen = simulation.actuators.each_ref();
            seen.map(|a| [a.now.temperature_rise_k, 1e3 * a.current_a])
        });
        seen.flatten().flatten().collect()
    }

    #[test]
    fn the_root_is_where_the_rounds_end() {
        for coefficient in [2e-3, 0.0, -5e-4] {
            let mut model = Model::from(Preset::Paper);
            model
                .parameters
                .set(Symbol::ResistanceCoefficient, coefficient);
            let at_once = after_steps(&model, |simulation, voltage_v, h| {
                simulation.heat(voltage_v, h);
            });
            let in_rounds = after_steps(&model, |simulation, voltage_v, h| {
                let poles = poles(&simulation.actuators, h);
                simulation.agree_in_rounds(voltage_v, &poles, h);
            });
            for (root, found) in at_once.iter().zip(&in_rounds) {
                // Rounds end within SAME_K of it; a milliampere changes by less than a thousandth in a kelvin.
                assert!((root - found).abs() < 2.0 * SAME_K, "{root} {found}");
            }
        }
    }

    #[test]
    fn a_heater_that_conducts_ever_better_has_no_root() {
        let mut model = Model::from(Preset::Paper);
        model.parameters.set(Symbol::ResistanceCoefficient, -5e-3);
        let simulation = Simulation::new(&model, 0.3);
        let poles = poles(&simulation.actuators, 1.0);
        let heater = &simulation.actuators[0];
        assert!(heater.agreed_ohm(&poles[0], 0.5, 0.0, 1.0).is_some());
        assert!(heater.agreed_ohm(&poles[0], 10.0, 0.0, 1.0).is_none());
    }
}
