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

use super::numerals::without_exponents;
use super::size::{MOST_PARAMETERS, MOST_PARTS, MOST_PARTS_OF_RATES, MOST_STATES, parts};
use super::{Acts, Effect, Info, Moment, Parameter, Stage, Step};
use exmex::{Express, FlatEx};
use miette::{Diagnostic, NamedSource, SourceSpan};
use serde::Deserialize;
use std::ops::Range;
use std::sync::Arc;
use thiserror::Error;

/// What a formula may use besides its parameters and states.
const VARIABLES: [&str; 9] = ["x", "t", "V", "R", "P", "P_total", "dT", "dT_room", "z"];
/// Where the time is among them.
const TIME: usize = 1;
/// A state is moved on in so many parts of a simulation step at least, since its time constant is not known.
const PARTS: usize = 4;

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

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    id: String,
    #[serde(default)]
    title: String,
    stage: Stage,
    acts: Acts,
    formula: toml::Spanned<String>,
    #[serde(default)]
    shows: String,
    #[serde(default)]
    separates: String,
    #[serde(default)]
    source: String,
    parameters: toml::Spanned<Vec<StoredParameter>>,
    #[serde(default)]
    states: Vec<StoredState>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredParameter {
    symbol: toml::Spanned<String>,
    unit: String,
    start: f64,
    low: f64,
    high: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredState {
    symbol: toml::Spanned<String>,
    rate: toml::Spanned<String>,
}

/// A compiled expression with the place of each of its variables among all the values.
struct Expression {
    compiled: FlatEx<f64>,
    places: Vec<usize>,
}

impl Expression {
    fn eval(&self, values: &[f64]) -> f64 {
        let used: Vec<f64> = self.places.iter().map(|&place| values[place]).collect();
        self.compiled.eval(&used).unwrap_or(f64::NAN)
    }
}

impl Formula {
    /// Reads an effect's text; `name` is what errors call it.
    ///
    /// # Errors
    /// [`FormulaError`], pointing at the place, for a syntax error, an unknown variable, or a formula that changes
    /// something at strength 0.
    pub fn parse(name: &str, text: &str) -> Result<Self, FormulaError> {
        Reader { name, text }.formula()
    }

    fn values(parameters: &[f64], input: f64, state: &[f64], m: &Moment) -> Vec<f64> {
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
        chain
            .iter()
            .chain(parameters)
            .chain(state)
            .copied()
            .collect()
    }
}

impl Effect for Formula {
    fn definition(&self) -> Option<&str> {
        Some(&self.text)
    }

    fn info(&self) -> &Info {
        &self.info
    }

    fn output(&self, parameters: &[f64], input: f64, state: &[f64], moment: &Moment) -> f64 {
        self.output
            .eval(&Self::values(parameters, input, state, moment))
    }

    fn states(&self) -> usize {
        self.rates.len()
    }

    fn is_of_time(&self) -> bool {
        !self.rates.is_empty() || self.output.places.contains(&TIME)
    }

    /// Heun's method.
    fn advance(&self, parameters: &[f64], state: &mut [f64], step: &Step) {
        let h = step.duration_s / PARTS as f64;
        for part in 0..PARTS {
            let input = |at: usize| step.from + (step.to - step.from) * at as f64 / PARTS as f64;
            let rates = |state: &[f64], at: usize| -> Vec<f64> {
                let values = Self::values(parameters, input(at), state, &step.moment);
                self.rates.iter().map(|rate| rate.eval(&values)).collect()
            };
            let first = rates(state, part);
            let guess: Vec<f64> = state.iter().zip(&first).map(|(s, r)| s + h * r).collect();
            let second = rates(&guess, part + 1);
            for ((s, a), b) in state.iter_mut().zip(first).zip(second) {
                *s += 0.5 * h * (a + b);
            }
        }
    }
}

struct Reader<'a> {
    name: &'a str,
    text: &'a str,
}

impl Reader<'_> {
    fn formula(&self) -> Result<Formula, FormulaError> {
        let stored: Stored = toml::from_str(self.text).map_err(|error| {
            self.wrong(
                error.message(),
                "see `effect new` for an example",
                error.span().unwrap_or(0..0),
            )
        })?;
        self.check_counts(&stored)?;
        let names = self.names(&stored)?;
        self.check_parts(&stored, &names)?;
        let output = self.expression(&stored.formula, &names)?;
        let rates = stored
            .states
            .iter()
            .map(|state| self.expression(&state.rate, &names))
            .collect::<Result<_, _>>()?;
        let place = stored.formula.span();
        let formula = Formula {
            output,
            rates,
            info: info(stored),
            text: self.text.to_owned(),
        };
        formula.check_strength().map_err(|message| {
            self.wrong(
                &message,
                "the first parameter is the strength: write the formula so that 0 changes nothing",
                place,
            )
        })?;
        Ok(formula)
    }

    /// Not more parameters and states than a fit can bear.
    fn check_counts(&self, stored: &Stored) -> Result<(), FormulaError> {
        let (parameters, states) = (stored.parameters.get_ref().len(), stored.states.len());
        if parameters > MOST_PARAMETERS {
            return Err(self.wrong(
                &format!("this effect has {parameters} parameters, and at most {MOST_PARAMETERS} are fitted"),
                "write numbers in place of those that measurements cannot tell",
                stored.parameters.span(),
            ));
        }
        match stored.states.get(MOST_STATES) {
            None => Ok(()),
            Some(state) => Err(self.wrong(
                &format!(
                    "this effect has {states} states, and at most {MOST_STATES} are simulated"
                ),
                "describe it as several effects, or with fewer states",
                state.symbol.span(),
            )),
        }
    }

    /// No longer formulas than a fit can bear.
    fn check_parts(&self, stored: &Stored, names: &[String]) -> Result<(), FormulaError> {
        let count = |text: &toml::Spanned<String>| parts(text.get_ref(), names);
        let shorter =
            "a fit would take minutes; write a simpler formula, or describe it as several effects";
        let of_formula = count(&stored.formula);
        if of_formula > MOST_PARTS {
            let message = format!(
                "this formula has {of_formula} operators, functions and brackets, and may have {MOST_PARTS}"
            );
            return Err(self.wrong(&message, shorter, stored.formula.span()));
        }
        let mut of_rates = 0;
        for state in &stored.states {
            of_rates += count(&state.rate);
            if of_rates > MOST_PARTS_OF_RATES {
                let message = format!(
                    "up to this one the rates have {of_rates} operators, functions and brackets, and may have \
                     {MOST_PARTS_OF_RATES} in all"
                );
                return Err(self.wrong(&message, shorter, state.rate.span()));
            }
        }
        Ok(())
    }

    fn names(&self, stored: &Stored) -> Result<Vec<String>, FormulaError> {
        if stored.parameters.get_ref().is_empty() {
            return Err(self.wrong(
                "an effect needs a parameter",
                "the first one is its strength",
                stored.parameters.span(),
            ));
        }
        let mut names: Vec<String> = VARIABLES.map(String::from).to_vec();
        let parameters = stored.parameters.get_ref();
        for p in parameters {
            if !(p.low < p.high
                && (p.low..=p.high).contains(&p.start)
                && p.low.is_finite()
                && p.high.is_finite())
            {
                let message = format!("the range of {} must hold its start", p.symbol.get_ref());
                return Err(self.wrong(
                    &message,
                    "low <= start <= high, low < high",
                    p.symbol.span(),
                ));
            }
        }
        for symbol in parameters
            .iter()
            .map(|p| &p.symbol)
            .chain(stored.states.iter().map(|s| &s.symbol))
        {
            if names.contains(symbol.get_ref()) {
                let message = format!("the symbol '{}' is taken", symbol.get_ref());
                return Err(self.wrong(&message, "choose another", symbol.span()));
            }
            names.push(symbol.get_ref().clone());
        }
        Ok(names)
    }

    fn expression(
        &self,
        text: &toml::Spanned<String>,
        names: &[String],
    ) -> Result<Expression, FormulaError> {
        let compiled =
            FlatEx::<f64>::parse(&without_exponents(text.get_ref())).map_err(|error| {
                self.wrong(
                    &format!("this formula cannot be read: {error}"),
                    "write it like x * (1 + c * dT)",
                    text.span(),
                )
            })?;
        let place = |variable: &String| {
            names
                .iter()
                .position(|name| name == variable)
                .ok_or_else(|| {
                    self.wrong(
                        &format!("the variable '{variable}' is not known"),
                        &format!("known are {}", names.join(", ")),
                        text.span(),
                    )
                })
        };
        let places = compiled
            .var_names()
            .iter()
            .map(place)
            .collect::<Result<_, _>>()?;
        Ok(Expression { compiled, places })
    }

    fn wrong(&self, message: &str, help: &str, place: Range<usize>) -> FormulaError {
        let text = Arc::new(NamedSource::new(self.name, self.text.to_owned()));
        FormulaError {
            message: message.into(),
            help: help.into(),
            text,
            place: place.into(),
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

fn info(stored: Stored) -> Info {
    let parameters: Vec<_> = stored
        .parameters
        .into_inner()
        .into_iter()
        .map(|p| Parameter {
            symbol: p.symbol.into_inner().into(),
            unit: p.unit.into(),
            start: p.start,
            low: p.low,
            high: p.high,
        })
        .collect();
    Info {
        id: stored.id.into(),
        title: stored.title.into(),
        stage: stored.stage,
        acts: stored.acts,
        equation: format!("x' = {}", stored.formula.get_ref()).into(),
        parameters: parameters.into(),
        shows: stored.shows.into(),
        separates: stored.separates.into(),
        source: stored.source.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "id = \"mine\"\nstage = \"shape\"\nacts = \"displacement\"\n";
    const Q: &str =
        "[[parameters]]\nsymbol = \"q\"\nunit = \"1\"\nstart = 0.1\nlow = 0.0\nhigh = 1.0\n";

    fn with(formula: &str) -> Result<Formula, FormulaError> {
        Formula::parse("mine.toml", &format!("{HEAD}formula = \"{formula}\"\n{Q}"))
    }

    #[track_caller]
    fn refuses(formula: &str, message: &str) {
        let error = with(formula).err().expect("it is refused");
        assert!(error.message.contains(message), "{}", error.message);
        assert!(error.place.len() >= formula.len());
    }

    #[test]
    fn a_formula_is_an_effect() {
        let effect = with("x * (1 - q * dT / 100)").unwrap();
        let moment = Moment {
            temperature_rise_k: 50.0,
            ..Moment::default()
        };
        assert_eq!(effect.output(&[0.2], 10.0, &[], &moment), 9.0);
    }

    #[test]
    fn numbers_may_have_exponents() {
        let effect = with("x * (1 + 1e1 * q)").unwrap();
        assert_eq!(effect.output(&[0.2], 10.0, &[], &Moment::default()), 30.0);
    }

    #[test]
    fn a_state_relaxes() {
        let text = format!(
            "{HEAD}formula = \"x + q * s\"\n{Q}[[states]]\nsymbol = \"s\"\nrate = \"(x - s) / 2\"\n"
        );
        let effect = Formula::parse("mine.toml", &text).unwrap();
        let mut state = [0.0];
        for _ in 0..100 {
            effect.advance(
                &[0.1],
                &mut state,
                &Step {
                    from: 1.0,
                    to: 1.0,
                    duration_s: 0.02,
                    moment: Moment::default(),
                },
            );
        }
        assert!((state[0] - (1.0 - (-1.0_f64).exp())).abs() < 1e-5);
    }

    #[test]
    fn what_would_take_minutes_to_fit_is_refused_at_once() {
        // "x * (1 + q * (", and a sign between two terms.
        let sum = |terms: usize| format!("x * (1 + q * ({}))", vec!["dT"; terms].join(" + "));
        let terms = MOST_PARTS - 4;
        assert!(with(&sum(terms)).is_ok());
        refuses(&sum(terms + 1), "has 101 operators, functions and brackets");
        refuses(&sum(100_000), "and may have 100");
        refuses(
            &format!("x + q * {}dT{}", "sin(".repeat(50), ")".repeat(50)),
            "has 102",
        );
        refuses(
            &format!("{}x{}", "(".repeat(100_000), ")".repeat(100_000)),
            "and may have 100",
        );
        refuses(&format!("x + q * {}dT", "-".repeat(99)), "has 101");

        let state = |symbol: usize, rate: &str| {
            format!("[[states]]\nsymbol = \"s{symbol}\"\nrate = \"{rate}\"\n")
        };
        let refuses_rest = |rest: &str, message: &str| {
            let text = format!("{HEAD}formula = \"x + q\"\n{Q}{rest}");
            let error = Formula::parse("mine.toml", &text)
                .err()
                .expect("it is refused");
            assert!(error.message.contains(message), "{}", error.message);
        };
        let states = |count: usize, rate: &str| -> String {
            (0..count).map(|symbol| state(symbol, rate)).collect()
        };
        let sixteen = vec!["dT"; 17].join("+");
        refuses_rest(&states(2, &sixteen), "the rates have 32 operators");
        refuses_rest(&states(5, "0"), "has 5 states");
        let parameters: String = (0..8)
            .map(|i| Q.replace("\"q\"", &format!("\"q{i}\"")))
            .collect();
        refuses_rest(&parameters, "has 9 parameters");
    }

    #[test]
    fn what_is_wrong_is_pointed_at() {
        refuses("x * (1 + ", "cannot be read");
        refuses("x * (1 + c * dT)", "'c' is not known");
        refuses("x / q", "at strength 0 this formula gives inf");
        refuses("2 * x", "turns 0.5 into 1");
        assert!(Formula::parse("mine.toml", "colour = 1").is_err());
        assert!(
            Formula::parse("mine.toml", &format!("{HEAD}formula = \"x\"\n{Q}{Q}")).is_err(),
            "a symbol twice"
        );
    }
}
