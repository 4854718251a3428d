//! Effects in a heater that is no mirror's, with the strengths that are plausible there.

use super::{Active, Effect, Heater, Info, Moment, Step, Strengths, Timing};
use std::sync::Arc;

impl Heater {
    /// The effect with strengths that are plausible in this heater.
    pub fn suits(&self, effect: &Arc<dyn Effect>) -> Arc<dyn Effect> {
        let Some(strengths) = effect.strengths_in(self) else {
            return effect.clone();
        };
        let mut info = effect.info().clone();
        let strength = &mut info.parameters.to_mut()[0];
        strength.start = strengths.usual;
        strength.low = strengths.low;
        strength.high = strengths.high;
        Arc::new(Suited {
            effect: effect.clone(),
            info,
        })
    }

    /// The effect of a model, likewise.
    pub fn suits_active(&self, active: &Active) -> Active {
        Active {
            effect: self.suits(&active.effect),
            ..active.clone()
        }
    }
}

/// An effect with other strengths than usual.
struct Suited {
    effect: Arc<dyn Effect>,
    info: Info,
}

impl Effect for Suited {
    fn info(&self) -> &Info {
        &self.info
    }
    fn output(&self, parameters: &[f64], input: f64, state: &[f64], moment: &Moment) -> f64 {
        self.effect.output(parameters, input, state, moment)
    }
    fn states(&self) -> usize {
        self.effect.states()
    }
    fn form(&self) -> &str {
        self.effect.form()
    }
    fn other_forms(&self) -> &'static [&'static dyn Effect] {
        self.effect.other_forms()
    }
    fn looks_at_displacement(&self) -> bool {
        self.effect.looks_at_displacement()
    }
    fn looks_at_other_actuators(&self) -> bool {
        self.effect.looks_at_other_actuators()
    }
    fn is_of_time(&self) -> bool {
        self.effect.is_of_time()
    }
    fn timing(&self) -> Option<Timing> {
        self.effect.timing()
    }
    fn is_course(&self) -> bool {
        self.effect.is_course()
    }
    fn is_inverted(&self) -> bool {
        self.effect.is_inverted()
    }
    fn definition(&self) -> Option<&str> {
        self.effect.definition()
    }
    fn strengths_in(&self, heater: &Heater) -> Option<Strengths> {
        self.effect.strengths_in(heater)
    }
    fn advance(&self, parameters: &[f64], state: &mut [f64], step: &Step) {
        self.effect.advance(parameters, state, step);
    }
}

#[cfg(test)]
mod tests {
    use super::super::find;
    use super::*;

    /// Of a small lamp.
    const LAMP: Heater = Heater {
        cold_resistance_ohm: 2.0,
        resistance_coefficient_per_k: 4.5e-3,
        hottest_rise_k: 2000.0,
        least_rise_k: 2000.0,
        hottest_power_w: 2.0,
    };

    fn high(id: &str) -> f64 {
        let effect = LAMP.suits(&find(id).expect("an effect"));
        effect.info().parameters[0].high
    }

    #[test]
    fn a_filament_may_lose_all_its_power_as_light() {
        let radiated_w = high("radiation") * (2295.0_f64.powi(4) - 295.0_f64.powi(4));
        assert!(
            (1.0..2.0).contains(&(radiated_w / LAMP.hottest_power_w)),
            "{radiated_w} W"
        );
    }

    #[test]
    fn leads_are_counted_in_parts_of_the_heater() {
        assert!(high("series-resistance") <= LAMP.cold_resistance_ohm);
    }

    #[test]
    fn resistances_bend_either_way_and_never_fall() {
        let bent = high("quadratic-tcr") * LAMP.hottest_rise_k;
        assert!(bent > 0.0 && bent <= 0.5 * LAMP.resistance_coefficient_per_k);
    }

    #[test]
    fn what_does_not_depend_on_the_heater_stays() {
        let crosstalk = find("crosstalk").expect("an effect");
        let suited = LAMP.suits(&crosstalk);
        assert_eq!(
            suited.info().parameters[0].high,
            crosstalk.info().parameters[0].high
        );
    }
}
