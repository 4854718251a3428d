//! How large a user's own effect may be, found out before anything is computed with it.
//!
//! A fit evaluates an effect at every step of every simulation, some million times. A formula of n operators takes
//! 0.15 us + n times 15 to 40 ns (exmex 0.21, 2 GHz), beside about a microsecond of the model's own for a step.

/// The most parts of an effect's formula: they take 1.6 to 3.4 us. `effect add` on `data/hidden/12` took 37 s with 100 terms,
/// 33 s with 10, and more than 68 s with 300.
pub(super) const MOST_PARTS: usize = 100;
/// The most parts of all rates of its states together: in each half of a step they are evaluated twice, and once more for each state. When
/// that was eight times in a step, as it is with two states, the same fit took more than 65 s with 100 terms in a rate, and 23 s with 10.
pub(super) const MOST_PARTS_OF_RATES: usize = 30;
/// The most parameters: a fit simulates the session once more for each, and no session tells more apart.
pub(super) const MOST_PARAMETERS: usize = 8;
/// The most states: each is moved on in every step, whatever its rate.
pub(super) const MOST_STATES: usize = 4;

/// How many operators, opening brackets and functions a formula has; every name but those of `values` counts as a function.
pub(super) fn parts(formula: &str, values: &[String]) -> usize {
    let is_of_a_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
    let words = formula.split(|c| !is_of_a_word(c));
    let functions = words.filter(|word| {
        word.starts_with(|c: char| c.is_alphabetic() || c == '_')
            && !values.iter().any(|value| value == word)
    });
    let signs = formula.chars().filter(|&c| {
        let is_silent = c.is_whitespace() || matches!(c, ')' | ',');
        !is_of_a_word(c) && !is_silent
    });
    functions.count() + signs.count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operators_brackets_and_functions_are_counted() {
        let names = ["x", "q", "dT"].map(String::from);
        for (formula, count) in [
            ("x", 0),
            ("x * (1 + 2.5 * q)", 4),
            ("x + q*exp(-dT/20)", 6),
            ("((x))", 2),
            ("", 0),
        ] {
            assert_eq!(parts(formula, &names), count, "{formula}");
        }
    }
}
