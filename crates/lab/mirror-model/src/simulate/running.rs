//! The effects of a model while it runs.

use crate::ACTUATORS;
use crate::effect::{Active, Acts, Moment, Step};

/// What lies between power and temperature: effects on it are part of where the two agree.
const ON_THE_WAY: [Acts; 4] = [
    Acts::Voltage,
    Acts::Resistance,
    Acts::Heating,
    Acts::Temperature,
];

/// An effect with its states and last inputs, by actuator; one of each where it acts on the whole mirror.
pub(super) struct Running<'a> {
    pub(super) active: &'a Active,
    pub(super) acts: Acts,
    pub(super) states: Vec<Vec<f64>>,
    pub(super) inputs: Vec<f64>,
}

impl<'a> Running<'a> {
    pub(super) fn new(active: &'a Active) -> Self {
        let count = if active.effect.info().acts.on_the_mirror() {
            1
        } else {
            ACTUATORS
        };
        let states = vec![vec![0.0; active.effect.states()]; count];
        Self {
            active,
            acts: active.effect.info().acts,
            states,
            inputs: vec![f64::NAN; count],
        }
    }

    /// Puts every other actuator's states and inputs where the first one's are.
    pub(super) fn follow_the_first(&mut self) {
        let (states, input) = (self.states[0].clone(), self.inputs[0]);
        self.states.fill(states);
        self.inputs.fill(input);
    }

    /// Whether it lies on the way from power to temperature, and back.
    pub(super) fn is_on_the_way(&self) -> bool {
        ON_THE_WAY.contains(&self.acts)
    }

    /// Whether it depends on the displacements that the mirror came along, or remembers them.
    pub(super) fn sees_the_way(&self) -> bool {
        let effect = &self.active.effect;
        effect.looks_at_displacement() || effect.states() > 0 && !self.is_on_the_way()
    }
}

/// The quantity with every effect that acts on it, one after the other.
pub(super) fn change(
    effects: &[Running],
    acts: Acts,
    actuator: usize,
    plain: f64,
    moment: &Moment,
) -> f64 {
    effects
        .iter()
        .filter(|running| running.acts == acts)
        .fold(plain, |value, r| {
            r.active
                .effect
                .output(&r.active.values, value, &r.states[actuator], moment)
        })
}

/// Moves the states of the effects on these quantities on by `h`. A first call, with `h` = 0, only notes the input.
pub(super) fn advance(
    effects: &mut [Running],
    acts: &[Acts],
    actuator: usize,
    plain: f64,
    moment: &Moment,
    h: f64,
) {
    let mut value = plain;
    for r in effects
        .iter_mut()
        .filter(|running| acts.contains(&running.acts))
    {
        let (effect, values) = (&r.active.effect, &r.active.values);
        if h > 0.0 && effect.states() > 0 {
            let from = if r.inputs[actuator].is_nan() {
                value
            } else {
                r.inputs[actuator]
            };
            effect.advance(
                values,
                &mut r.states[actuator],
                &Step {
                    from,
                    to: value,
                    duration_s: h,
                    moment: *moment,
                },
            );
        }
        r.inputs[actuator] = value;
        value = effect.output(values, value, &r.states[actuator], moment);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::find;

    #[test]
    fn only_what_remembers_a_displacement_or_looks_at_it_sees_the_way() {
        for (id, sees) in [
            ("creep", true),
            ("resonance", true),
            ("gap-heat-loss", true),
            ("sensor-gain", false),
            ("thermal-lag", false),
            ("radiation", false),
        ] {
            let active = Active::usual(find(id).expect("built in"));
            assert_eq!(Running::new(&active).sees_the_way(), sees, "{id}");
        }
    }
}
