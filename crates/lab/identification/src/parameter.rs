//! What a fit may change: parameters of the base and of effects, each with a coordinate that the fit sees.

use crate::dataset::Dataset;
use mirror_model::{ACTUATORS, Model, Symbol};

/// A base parameter that is fitted as a logarithm must be positive: this is the least of any unit that it takes.
const LEAST: f64 = 1e-12;
/// A time constant below this is over within a control tick of 100 us, whatever it is (s).
const SHORTEST_S: f64 = 1e-6;
/// The longest middle time constant (s). Beams and plate follow within that (`docs/theory/model.md`); what is slower is the chip or
/// the films, and an effect of its own.
const LONGEST_MIDDLE_S: f64 = 0.3;
/// A thermal pole's share of the rise: above 0, where its time constant would not show, and below 1, where the fast pole's
/// would not.
const WEIGHTS: (f64, f64) = (1e-4, 0.8);
/// A value this close to the end of its range, as a share of the range and of itself, is at the end.
const AT_THE_END: f64 = 1e-3;

/// A parameter of eqs. 3-9 or of the thermal poles: one that the actuators share, or one actuator's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BaseParameter {
    /// The same in all actuators.
    Shared(Symbol),
    /// One actuator's, counted from 0.
    Own(Symbol, usize),
}

impl BaseParameter {
    /// An actuator's own parameter, or that of the one heater which all actuators of these data stand for.
    pub fn of_actuator(symbol: Symbol, actuator: usize, data: &Dataset) -> Self {
        if data.is_one_heater() {
            Self::Shared(symbol)
        } else {
            Self::Own(symbol, actuator)
        }
    }

    /// Its name for people: `R0`, or `R0.1` for the first actuator's.
    pub fn name(self) -> String {
        match self {
            Self::Shared(symbol) => symbol.to_string(),
            Self::Own(symbol, actuator) => format!("{symbol}.{}", actuator + 1),
        }
    }

    /// Its symbol.
    pub fn symbol(self) -> Symbol {
        match self {
            Self::Shared(symbol) | Self::Own(symbol, _) => symbol,
        }
    }

    /// Its value in a model, in the unit of its symbol.
    pub fn get(self, model: &Model) -> f64 {
        match self {
            Self::Shared(symbol) => model.parameters.get(symbol),
            Self::Own(symbol, actuator) => model.actuator(actuator).parameters.get(symbol),
        }
    }

    /// Changes it in a model. What actuators have of their own keeps its ratio to what they share.
    pub fn set(self, model: &mut Model, value: f64) {
        match self {
            Self::Shared(symbol) => {
                let before = model.parameters.get(symbol);
                model.parameters.set(symbol, value);
                if let Some(own) = model.by_actuator.get_mut(&symbol) {
                    let kept = |own: f64| {
                        if before == 0.0 {
                            value
                        } else {
                            own * (value / before)
                        }
                    };
                    *own = own.map(kept);
                }
            }
            Self::Own(symbol, actuator) => {
                let shared = model.parameters.get(symbol);
                model
                    .by_actuator
                    .entry(symbol)
                    .or_insert([shared; ACTUATORS])[actuator] = value;
            }
        }
    }

    /// Lowest and highest value that a fit may reach.
    pub fn range(self) -> (f64, f64) {
        let (low, high) = self.symbol().entry().range;
        match self.symbol() {
            Symbol::FastTime | Symbol::SlowTime => (SHORTEST_S, high),
            Symbol::MiddleTime => (SHORTEST_S, LONGEST_MIDDLE_S),
            Symbol::MiddleWeight | Symbol::SlowWeight => WEIGHTS,
            _ => (low.max(LEAST), high),
        }
    }
}

/// How far these parameters of a model are off what was measured of them apart from the session: the sum of squares, each in
/// its standard deviation.
pub fn misfit_of_measured(
    model: &Model,
    parameters: impl IntoIterator<Item = FreeParameter>,
) -> f64 {
    let off = parameters.into_iter().filter_map(|parameter| {
        let (mean, deviation) = parameter.measured(model)?;
        Some(((parameter.coordinate(model) - mean) / deviation).powi(2))
    });
    off.sum()
}

/// A number that is fitted: a parameter of the base, or of an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FreeParameter {
    /// A base parameter. Its coordinate is its logarithm.
    Base(BaseParameter),
    /// Parameter `.1` of the model's effect `.0`. Its coordinate is its value in units of its usual size.
    Effect(usize, usize),
}

impl FreeParameter {
    /// Its name for people: `R0.1`, or `creep.tau`.
    pub fn name(self, model: &Model) -> String {
        match self {
            Self::Base(base) => base.name(),
            Self::Effect(effect, index) => {
                let active = &model.effects[effect];
                let symbol = &active.effect.info().parameters[index].symbol;
                format!("{}.{symbol}", active.id())
            }
        }
    }

    /// Its unit.
    pub fn unit(self, model: &Model) -> String {
        match self {
            Self::Base(base) => base.symbol().entry().unit.into(),
            Self::Effect(effect, index) => model.effects[effect].effect.info().parameters[index]
                .unit
                .to_string(),
        }
    }

    /// Its value in its unit.
    pub fn value(self, model: &Model) -> f64 {
        match self {
            Self::Base(base) => base.get(model),
            Self::Effect(effect, index) => model.effects[effect].values[index],
        }
    }

    /// How much its value changes with its coordinate, in its unit.
    pub fn scale(self, model: &Model) -> f64 {
        match self {
            Self::Base(base) => base.get(model),
            Self::Effect(effect, index) => model.effects[effect].effect.info().parameters[index]
                .start
                .abs(),
        }
    }

    /// Lowest and highest value that a fit may reach, in its unit.
    pub fn range(self, model: &Model) -> (f64, f64) {
        match self {
            Self::Base(base) => base.range(),
            Self::Effect(effect, index) => {
                let parameter = &model.effects[effect].effect.info().parameters[index];
                (parameter.low, parameter.high)
            }
        }
    }

    /// Whether a fit has driven it to an end of its range.
    pub fn is_at_its_limit(self, model: &Model) -> bool {
        let value = self.value(model);
        let (low, high) = self.range(model);
        let room = AT_THE_END * (high - low);
        value <= low + room.min(AT_THE_END * value.abs()) || value >= high - room
    }

    /// Where the fit sees it: the logarithm of a base parameter, an effect's value in units of its usual size.
    pub fn coordinate(self, model: &Model) -> f64 {
        self.coordinate_of(self.value(model), model)
    }

    /// Lowest and highest coordinate.
    pub fn bounds(self, model: &Model) -> (f64, f64) {
        let (low, high) = self.range(model);
        (
            self.coordinate_of(low, model),
            self.coordinate_of(high, model),
        )
    }

    fn coordinate_of(self, value: f64, model: &Model) -> f64 {
        match self {
            Self::Base(_) => value.ln(),
            Self::Effect(..) => value / self.scale(model),
        }
    }

    /// What was measured of it apart from the session: its coordinate and the standard deviation of that, to first order.
    pub fn measured(self, model: &Model) -> Option<(f64, f64)> {
        let Self::Base(base) = self else { return None };
        let measured = model.measured.get(&base.symbol())?;
        Some((measured.value.ln(), measured.error / measured.value))
    }

    /// Gives it the value of a coordinate, or the nearest one in its range.
    pub fn set(self, model: &mut Model, coordinate: f64) {
        let (low, high) = self.range(model);
        match self {
            Self::Base(base) => base.set(model, coordinate.exp().clamp(low, high)),
            Self::Effect(effect, index) => {
                let value = coordinate * self.scale(model);
                model.effects[effect].values[index] = value.clamp(low, high);
            }
        }
    }

    /// Moves it by a step of its coordinate, within its range.
    pub fn shift(self, model: &mut Model, step: f64) {
        let at = self.coordinate(model);
        self.set(model, at + step);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_model::Preset;
    use mirror_model::effect::{Active, find};

    fn with_creep() -> Model {
        let mut model = Model::from(Preset::Reconciled);
        let creep = find("creep").expect("an effect");
        model.effects.push(Active::usual(creep));
        model
    }

    #[test]
    fn a_base_parameter_moves_by_a_factor_and_an_effect_s_by_its_usual_size() {
        let mut model = with_creep();
        let cold = FreeParameter::Base(BaseParameter::Own(Symbol::ColdResistance, 2));
        let before = cold.value(&model);
        cold.shift(&mut model, 2f64.ln());
        assert!((cold.value(&model) / before - 2.0).abs() < 1e-12);
        let first = BaseParameter::Own(Symbol::ColdResistance, 0);
        assert_eq!(first.get(&model), before, "another actuator's stays");
        let strength = FreeParameter::Effect(0, 0);
        let usual = strength.value(&model);
        assert_eq!(strength.coordinate(&model), 1.0);
        strength.shift(&mut model, 0.5);
        assert!((strength.value(&model) / usual - 1.5).abs() < 1e-12);
    }

    #[test]
    fn what_actuators_have_of_their_own_follows_what_they_share() {
        let mut model = Model::from(Preset::Paper);
        let shared = BaseParameter::Shared(Symbol::ThermalResistance);
        let own = BaseParameter::Own(Symbol::ThermalResistance, 2);
        let before = shared.get(&model);
        own.set(&mut model, 1.1 * before);
        shared.set(&mut model, 0.5 * before);
        // One rounding each.
        assert!((own.get(&model) / before - 0.55).abs() < 1e-12);
        let first = BaseParameter::Own(Symbol::ThermalResistance, 0);
        assert!((first.get(&model) / before - 0.5).abs() < 1e-12);
    }

    #[test]
    fn no_step_leaves_the_range() {
        let mut model = with_creep();
        for parameter in [
            FreeParameter::Base(BaseParameter::Shared(Symbol::MiddleTime)),
            FreeParameter::Effect(0, 1),
        ] {
            let (low, high) = parameter.range(&model);
            parameter.set(&mut model, 1e3);
            assert_eq!(parameter.value(&model), high);
            assert!(parameter.is_at_its_limit(&model));
            parameter.set(&mut model, -1e3);
            assert_eq!(parameter.value(&model), low);
            assert!(parameter.is_at_its_limit(&model));
            let (first, last) = parameter.bounds(&model);
            parameter.set(&mut model, 0.5 * (first + last));
            assert!(!parameter.is_at_its_limit(&model), "{parameter:?}");
        }
    }

    #[test]
    fn names_are_symbols_with_the_actuator_counted_from_1_or_the_effect() {
        let model = with_creep();
        let cold = FreeParameter::Base(BaseParameter::Own(Symbol::ColdResistance, 2));
        assert_eq!(
            (cold.name(&model).as_str(), cold.unit(&model).as_str()),
            ("R0.3", "ohm")
        );
        let strength = FreeParameter::Effect(0, 0).name(&model);
        assert!(strength.starts_with("creep."), "{strength}");
    }
}
