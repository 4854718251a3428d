//! What a user has written, read into a formula, or what is wrong with it and where.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use exmex::{Express, FlatEx};
use miette::NamedSource;
use serde::Deserialize;

use super::{Expression, Formula, FormulaError, VARIABLES, calls};
use crate::effect::numerals::without_exponents;
use crate::effect::size::{MOST_PARAMETERS, MOST_PARTS, MOST_PARTS_OF_RATES, MOST_STATES, parts};
use crate::effect::{Acts, Info, Parameter, Stage, find};

/// An id stands in the first column of the tables; longer ones push the others out of a terminal. A choice.
const LONGEST_ID: usize = 40;
/// A name that says what an effect does.
const EXAMPLE: &str = "stiffening";

/// What a formula may use besides + - * / ^ and names.
pub(super) const FUNCTIONS: &str = "it may have + - * / ^, the functions abs, signum, sqrt, cbrt, exp, ln, log2, log10, sin, cos, tan, asin, acos, atan, sinh, \
                         cosh, tanh, asinh, acosh, atanh, floor, ceil, round, trunc and fract of one value, min, max and atan2 of two, PI and e";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    id: toml::Spanned<String>,
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

impl Formula {
    /// Reads an effect's text; `name` is what errors call it.
    ///
    /// # Errors
    /// [`FormulaError`], pointing at the place, for a syntax error, an unknown variable, or a formula that changes
    /// something at strength 0.
    pub fn parse(name: &str, text: &str) -> Result<Self, FormulaError> {
        FormulaReader { name, text }.formula()
    }
}

/// An effect's text, and what errors call it.
struct FormulaReader<'a> {
    name: &'a str,
    text: &'a str,
}

impl FormulaReader<'_> {
    fn formula(&self) -> Result<Formula, FormulaError> {
        let stored: Stored = toml::from_str(self.text).map_err(|error| {
            self.wrong(
                error.message(),
                "see `effect new` for an example",
                error.span().unwrap_or(0..0),
            )
        })?;
        self.check_id(&stored)?;
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

    /// A name that can be typed, and that no built-in effect has: what is known of that one would be taken for this one.
    fn check_id(&self, stored: &Stored) -> Result<(), FormulaError> {
        let id = stored.id.get_ref();
        let is_of_a_name = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        let (message, help) =
            if !id.chars().all(is_of_a_name) || !(1..=LONGEST_ID).contains(&id.len()) {
                (
                    "an effect's id is a word of letters, digits, - and _".to_owned(),
                    format!("choose one of at most {LONGEST_ID} of them, as in `my-{EXAMPLE}`"),
                )
            } else if find(id).is_some() {
                (
                    format!("there is a built-in effect `{id}`"),
                    format!("choose another id, as in `my-{id}`"),
                )
            } else {
                return Ok(());
            };
        Err(self.wrong(&message, &help, stored.id.span()))
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
            if p.start == 0.0 {
                let message = format!("{} starts at 0", p.symbol.get_ref());
                return Err(self.wrong(
                    &message,
                    "write its usual size as the start: fits count in it",
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
        let unread = |error: &dyn fmt::Display| {
            let message = format!("this formula cannot be read: {error}");
            let help = format!("write it like x * (1 + c * dT); {FUNCTIONS}");
            self.wrong(&message, &help, text.span())
        };
        let written = calls::between(&without_exponents(text.get_ref()));
        let written = written.map_err(|said| unread(&said))?;
        let compiled = FlatEx::<f64>::parse(&written).map_err(|error| unread(&error))?;
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
        id: stored.id.into_inner().into(),
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
