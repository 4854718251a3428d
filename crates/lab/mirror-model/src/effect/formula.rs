//! A user's own effect, written as formulas in TOML.
//!
//! ```toml
//! id = "my-stiffening"
//! title = "the beams stiffen as they bend"
//! stage = "shape"
//! acts = "displacement"
//! formula = "x * (1 - q * x)"
//! shows = "z falls behind towards the top, at equal R"
//!
//! [[parameters]]
//! symbol = "q"
//! unit = "1/um"
//! start = 1e-4
//! low = -1e-2
//! high = 1e-2
//! ```
//!
//! `x` is the quantity without the effect. Also known: `t` (s), `V` (V), `R` (ohm), `P` and `P_total` (W), `dT` (K), `dT_room`,
//! what of it an oven or another room adds (K), `z` (um), the effect's parameters and its states. A state has `symbol` and
//! `rate`, the formula of its change a second, and starts at 0. The first parameter is the strength: at 0 the formula must give `x` back.

mod calls;
mod read;
mod rosenbrock;

use std::sync::Arc;

use exmex::{Express, FlatEx};
use miette::{Diagnostic, NamedSource, SourceSpan};
use thiserror::Error;

use super::size::{MOST_PARAMETERS, MOST_STATES};
use super::{Effect, Info, Moment, Step};
use rosenbrock::At;

/// What a formula may use besides its parameters and states.
const VARIABLES: [&str; 9] = ["x", "t", "V", "R", "P", "P_total", "dT", "dT_room", "z"];
/// Where the time is among them, and the power of all actuators.
const TIME: usize = 1;
const TOTAL_POWER: usize = 5;
/// All that a formula may look at.
const MOST_VALUES: usize = VARIABLES.len() + MOST_PARAMETERS + MOST_STATES;
/// A state is moved on in so many parts of a simulation step: what of its rate is not linear is followed in them.
const PARTS: usize = 2;

/// A user's own effect.
pub struct Formula {
    info: Info,
    text: String,
    output: Expression,
    rates: Vec<Expression>,
}

/// Why a formula is not usable.
#[derive(Debug, Error, Diagnostic)]
#[error("{message}")]
#[diagnostic(help("{help}"))]
pub struct FormulaError {
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub help: String,
    #[source_code]
    text: Arc<NamedSource<String>>,
    #[label("here")]
    place: SourceSpan,
}

/// A compiled expression with the place of each of its variables among all the values.
struct Expression {
    compiled: FlatEx<f64>,
    places: Vec<usize>,
}

impl Expression {
    fn eval(&self, values: &[f64; MOST_VALUES]) -> f64 {
        let mut used = [0.0; MOST_VALUES];
        for (used, &place) in used.iter_mut().zip(&self.places) {
            *used = values[place];
        }
        let used = &used[..self.places.len()];
        self.compiled.eval(used).unwrap_or(f64::NAN)
    }
}

impl Formula {
    fn values(parameters: &[f64], input: f64, state: &[f64], m: &Moment) -> [f64; MOST_VALUES] {
        let chain = [
            input,
            m.t_s,
            m.voltage_v,
            m.resistance_ohm,
            m.power_w,
            m.total_power_w,
            m.temperature_rise_k,
            m.ambient_k,
            m.z_um,
        ];
        let mut values = [0.0; MOST_VALUES];
        let all = chain.iter().chain(parameters).chain(state);
        values
            .iter_mut()
            .zip(all)
            .for_each(|(value, of)| *value = *of);
        values
    }
}

impl Effect for Formula {
    fn definition(&self) -> Option<&str> {
        Some(&self.text)
    }

    fn info(&self) -> &Info {
        &self.info
    }

    fn looks_at_displacement(&self) -> bool {
        true
    }

    fn output(&self, parameters: &[f64], input: f64, state: &[f64], moment: &Moment) -> f64 {
        self.output
            .eval(&Self::values(parameters, input, state, moment))
    }

    fn states(&self) -> usize {
        self.rates.len()
    }

    fn looks_at_other_actuators(&self) -> bool {
        let mut expressions = self.rates.iter().chain([&self.output]);
        expressions.any(|expression| expression.places.contains(&TOTAL_POWER))
    }

    fn is_of_time(&self) -> bool {
        !self.rates.is_empty() || self.output.places.contains(&TIME)
    }

    fn advance(&self, parameters: &[f64], state: &mut [f64], step: &Step) {
        let input = |at: usize| step.from + (step.to - step.from) * at as f64 / PARTS as f64;
        for part in 0..PARTS {
            rosenbrock::step(state, step.duration_s / PARTS as f64, |state, at| {
                let input = match at {
                    At::Start => input(part),
                    At::End => input(part + 1),
                };
                let values = Self::values(parameters, input, state, &step.moment);
                let rate = |of: usize| self.rates.get(of).map_or(0.0, |rate| rate.eval(&values));
                std::array::from_fn(rate)
            });
        }
    }
}

impl Formula {
    fn check_strength(&self) -> Result<(), String> {
        let mut parameters: Vec<f64> = self.info.parameters.iter().map(|p| p.start).collect();
        parameters[0] = 0.0;
        let m = Moment {
            voltage_v: 1.0,
            resistance_ohm: 380.0,
            power_w: 2e-3,
            temperature_rise_k: 15.0,
            z_um: 26.0,
            ..Moment::default()
        };
        for input in [0.5, 20.0] {
            let given = self.output(&parameters, input, &vec![0.0; self.rates.len()], &m);
            if !given.is_finite() {
                return Err(format!("at strength 0 this formula gives {given}"));
            }
            if (given - input).abs() > 1e-9 * input {
                return Err(format!(
                    "at strength 0 this formula turns {input} into {given}"
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
