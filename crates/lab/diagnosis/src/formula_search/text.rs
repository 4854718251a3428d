//! A drafted formula as the text of an effect file, and in a sentence.

use super::{Draft, Law, STEP};
use crate::whereabouts::{Driver, Place};
use crate::words::digits;
use mirror_model::effect::Acts;
use std::fmt::Write as _;

/// How far a fit may move a strength from where it starts: that many times its size, either way.
const WIDE: f64 = 20.0;
/// How fast a state that keeps the highest temperature follows it (s): faster than drives are held.
const PEAK_S: f64 = 0.2;

/// The lowest threshold, in parts of the driver's range: below it the law without a threshold says the same.
const LOWEST: f64 = 0.02;
/// A drive that is no more than none (V): a tenth of the step of a sweep.
const LEAST_V: f64 = 0.01;

/// A parameter of a formula.
struct Parameter {
    symbol: &'static str,
    unit: String,
    start: f64,
    low: f64,
    high: f64,
}

/// A proposed effect's name.
pub(crate) fn id(place: Place) -> String {
    format!("proposed-{}", place.stage())
}

/// The text of the effect file. Values fitted to it, the strength first, take the place of those it starts from.
pub(crate) fn effect(draft: &Draft, fitted: Option<&[f64]>) -> String {
    let mut parameters = parameters(draft);
    for (parameter, value) in parameters.iter_mut().zip(fitted.into_iter().flatten()) {
        // A strength keeps the range that it was given.
        parameter.start = rounded(*value);
        parameter.low = parameter.low.min(parameter.start);
        parameter.high = parameter.high.max(parameter.start);
    }
    let symbols: Vec<String> = parameters.iter().map(|p| p.symbol.to_owned()).collect();
    let place = draft.place;
    let mut text = format!(
        "id = \"{}\"\ntitle = \"proposed by a diagnosis, no known effect: {place}\"\nstage = \"{}\"\nacts = \"{}\"\nformula = \"{}\"\n",
        id(place),
        place.stage(),
        acts(place.acts),
        formula(draft, &symbols),
    );
    for Parameter {
        symbol,
        unit,
        start,
        low,
        high,
    } in &parameters
    {
        let _ = write!(
            text,
            "\n[[parameters]]\nsymbol = \"{symbol}\"\nunit = \"{unit}\"\nstart = {start:e}\nlow = {low:e}\nhigh = {high:e}\n"
        );
    }
    if let Some(rate) = rate(draft, &symbols) {
        let _ = write!(text, "\n[[states]]\nsymbol = \"s\"\nrate = \"{rate}\"\n");
    }
    text
}

/// What the quantity behaves as, with these values of the parameters.
pub(crate) fn sentence(draft: &Draft, values: &[f64]) -> String {
    let numbers: Vec<String> = values.iter().map(|&value| digits(value)).collect();
    let formula = formula(draft, &numbers);
    let quantity = draft.place.quantity();
    match rate(draft, &numbers) {
        Some(rate) => {
            format!("the {quantity} x behaves as {formula}, where s changes with {rate} a second")
        }
        None => format!("the {quantity} x behaves as {formula}"),
    }
}

fn acts(acts: Acts) -> &'static str {
    match acts {
        Acts::Voltage => "voltage",
        Acts::Resistance => "resistance",
        Acts::Heating => "heating",
        Acts::Temperature => "temperature",
        Acts::Curvature => "curvature",
        Acts::Displacement => "displacement",
        Acts::Motion => "motion",
        Acts::Reading => "reading",
    }
}

fn parameters(draft: &Draft) -> Vec<Parameter> {
    let Draft {
        place,
        law,
        range,
        strength,
        ..
    } = *draft;
    let unit = match (place.adds(), place.acts, law) {
        _ if place.driver == Driver::Exposure => "1/s",
        (false, ..) | (_, _, Law::Fading { .. }) => "1",
        (_, Acts::Voltage, _) => "V",
        (_, Acts::Resistance, _) => "ohm",
        (_, Acts::Heating | Acts::Temperature, _) => "K",
        (_, Acts::Curvature, _) => "1/um",
        (_, Acts::Displacement | Acts::Motion | Acts::Reading, _) => "um",
    };
    let most = WIDE * strength.abs();
    let mut parameters = vec![Parameter {
        symbol: "q",
        unit: unit.into(),
        start: rounded(strength),
        low: -rounded(most),
        high: rounded(most),
    }];
    let of_driver = match place.driver {
        Driver::Voltage => "V",
        Driver::Position => "um",
        Driver::Time => "s",
        Driver::OtherPower => "sqrt(W)",
        _ => "K",
    };
    let mut push = |symbol, unit: &str, start, low, high| {
        parameters.push(Parameter {
            symbol,
            unit: unit.into(),
            start: rounded(start),
            low: rounded(low),
            high: rounded(high),
        });
    };
    match law {
        Law::Linear | Law::Square => {}
        Law::Power { p } => push("p", "1", p, 0.2, 8.0),
        Law::Above { a } | Law::Step { a } => push("a", of_driver, a, LOWEST * range, range),
        Law::PowerAbove { a, p } => {
            push("a", of_driver, a, LOWEST * range, range);
            push("p", "1", p, 0.5, 5.0);
        }
        Law::Exponential { w } => push("w", of_driver, w, 0.02 * range, 2.0 * range),
        Law::Fading { tau_s } => push("tau", "s", tau_s, super::SHORTEST_S, 1e3),
    }
    parameters
}

/// The changed quantity, its parameters called so.
fn formula(draft: &Draft, names: &[String]) -> String {
    let Draft { place, law, .. } = draft;
    let strength = &names[0];
    if let Law::Fading { .. } = law {
        return format!("x + {strength} * (s - x)");
    }
    let driver = match place.driver {
        Driver::Voltage => "V",
        Driver::Temperature => "dT",
        Driver::Position => "z",
        Driver::Time => "t",
        Driver::OtherPower if place.acts.on_the_mirror() => "sqrt(P_total)",
        Driver::OtherPower => "sqrt(max(P_total - P, 0))",
        Driver::Peak | Driver::Exposure | Driver::Lag | Driver::Turning | Driver::Rate => "s",
    };
    let law = match place.driver {
        Driver::Exposure => "s".to_owned(),
        _ => of_driver(draft, driver, names),
    };
    if place.acts == Acts::Voltage && place.adds() {
        // Where nothing is driven nothing is drawn from the supply.
        format!("x + {strength} * {law} * x / (x + {LEAST_V})")
    } else if place.adds() {
        format!("x + {strength} * {law}")
    } else {
        format!("x * (1 + {strength} * {law})")
    }
}

/// The law of a driver.
fn of_driver(draft: &Draft, driver: &str, names: &[String]) -> String {
    let range = digits(draft.range);
    let name = |index: usize| &names[index];
    match draft.law {
        Law::Linear => format!("{driver} / {range}"),
        Law::Square => format!("({driver} / {range})^2"),
        Law::Power { .. } => format!("(max({driver}, 0) / {range})^{}", name(1)),
        Law::Above { .. } => format!("max({driver} - {}, 0) / {range}", name(1)),
        Law::PowerAbove { .. } => {
            format!("(max({driver} - {}, 0) / {range})^{}", name(1), name(2))
        }
        Law::Step { .. } => {
            let width = digits(STEP * draft.range);
            format!("(1 / (1 + exp(({} - {driver}) / {width})))", name(1))
        }
        Law::Exponential { .. } => format!("exp(({driver} - {range}) / {})", name(1)),
        Law::Fading { .. } => "s".to_owned(),
    }
}

/// The rate of the state that it remembers, if it remembers anything.
fn rate(draft: &Draft, names: &[String]) -> Option<String> {
    match draft.place.driver {
        Driver::Lag => Some(format!("(x - s) / {}", names[1])),
        Driver::Peak => Some(format!("max(dT - s, 0) / {PEAK_S}")),
        Driver::Exposure => Some(of_driver(draft, "dT", names)),
        _ => None,
    }
}

/// To four digits, which a file shows.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_model::effect::{Effect, Formula, Moment};

    #[test]
    fn every_draft_is_a_formula_that_can_be_read_and_keeps_its_place() {
        for place in Place::all().filter(|p| !matches!(p.driver, Driver::Turning | Driver::Rate)) {
            let laws = match place.driver {
                Driver::Lag => vec![Law::Fading { tau_s: 1.0 }],
                _ => Law::all(100.0),
            };
            for law in laws {
                let draft = Draft {
                    place,
                    law,
                    range: 100.0,
                    strength: 0.01,
                    score: 0.0,
                };
                let text = effect(&draft, None);
                let formula = Formula::parse("proposed.toml", &text)
                    .unwrap_or_else(|error| panic!("{error}\n{text}"));
                assert_eq!(formula.info().acts, place.acts);
                let remembers =
                    matches!(place.driver, Driver::Lag | Driver::Peak | Driver::Exposure);
                assert_eq!(formula.states(), usize::from(remembers), "{text}");
                let said = sentence(&draft, &[0.5, 60.0, 1.6]);
                assert!(said.contains("0.500"), "{said}");
                // Nothing is divided by zero in a mirror at rest.
                let values: Vec<f64> = formula.info().parameters.iter().map(|p| p.start).collect();
                let at_rest = formula.output(&values, 0.0, &[0.0], &Moment::default());
                assert!(at_rest.is_finite(), "{text}");
            }
        }
    }

    #[test]
    fn fitted_values_are_where_the_file_starts() {
        let draft = Draft {
            place: Place {
                acts: Acts::Curvature,
                driver: Driver::Temperature,
            },
            law: Law::PowerAbove { a: 50.0, p: 2.0 },
            range: 110.0,
            strength: 1e-5,
            score: 0.0,
        };
        let text = effect(&draft, Some(&[2e-5, 61.0, 1.6]));
        let formula = Formula::parse("proposed.toml", &text).unwrap();
        let starts: Vec<f64> = formula.info().parameters.iter().map(|p| p.start).collect();
        assert_eq!(starts, [2e-5, 61.0, 1.6]);
        // A start is what a fit's steps are counted in: none is 0, wherever the fit ended.
        let at_the_ends = effect(&draft, Some(&[2e-5, LOWEST * draft.range, 0.5]));
        let formula = Formula::parse("proposed.toml", &at_the_ends).unwrap();
        assert!(formula.info().parameters.iter().all(|p| p.start != 0.0));
        assert_eq!(
            sentence(&draft, &[2e-5, 61.0, 1.6]),
            "the curvature x behaves as x + 2.00e-5 * (max(dT - 61.0, 0) / 110)^1.60"
        );
    }
}
