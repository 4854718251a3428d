//! What two runs of the same say differently.

use std::fmt;

use serde::Serialize;
use serde_json::Value;

use super::Inside;

/// Numbers that differ by no more than this part of the larger are the same but for rounding: fits end where a step moves them by
/// no more (`identification`), and print four digits.
const ROUNDING: f64 = 1e-6;

/// Something that two runs say differently.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Difference {
    /// Where it stands in what is carried.
    what: String,
    /// What the page says.
    page: Value,
    /// What came out now.
    now: Value,
}

impl Difference {
    pub(super) fn new(what: String, page: Value, now: Value) -> Self {
        Self { what, page, now }
    }

    /// Whether only the rounding is other.
    pub(crate) fn is_rounding(&self) -> bool {
        match (self.page.as_f64(), self.now.as_f64()) {
            (Some(a), Some(b)) => (a - b).abs() <= ROUNDING * a.abs().max(b.abs()),
            _ => false,
        }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}: {} in the page, {} now",
            self.what, self.page, self.now
        )
    }
}

/// How many numbers and words were compared, and those that differ: of the results and the models.
pub(crate) fn differences(page: &Inside, now: &Inside) -> (usize, Vec<Difference>) {
    let mut found = Compared::default();
    found.compare("", &page.results, &now.results);
    let models = |inside: &Inside| -> Value {
        let models = inside.models.iter().map(|model| {
            let table: Value = toml_words(&model.toml);
            (model.name.clone(), table)
        });
        Value::Object(models.collect())
    };
    found.compare("models", &models(page), &models(now));
    (found.compared, found.differences)
}

/// A model's text, word by word, so that its numbers can be compared as numbers.
fn toml_words(text: &str) -> Value {
    let words = text.split(|c: char| c.is_whitespace() || matches!(c, ',' | '{' | '}' | '[' | ']'));
    let word = |word: &str| match word.parse::<f64>() {
        Ok(number) if number.is_finite() => Value::from(number),
        _ => Value::from(word),
    };
    words.filter(|text| !text.is_empty()).map(word).collect()
}

#[derive(Default)]
struct Compared {
    compared: usize,
    differences: Vec<Difference>,
}

impl Compared {
    fn compare(&mut self, what: &str, page: &Value, now: &Value) {
        let below = |name: &str| match what {
            "" => name.to_owned(),
            _ => format!("{what}.{name}"),
        };
        match (page, now) {
            (Value::Object(a), Value::Object(b)) => {
                for (name, value) in a {
                    self.compare(&below(name), value, b.get(name).unwrap_or(&Value::Null));
                }
                for (name, value) in b.iter().filter(|(name, _)| !a.contains_key(*name)) {
                    self.compare(&below(name), &Value::Null, value);
                }
            }
            (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
                for (index, (a, b)) in a.iter().zip(b).enumerate() {
                    let name = a["effect"].as_str().or(a["experiment"].as_str());
                    let name = name.map_or((index + 1).to_string(), String::from);
                    self.compare(&below(&name), a, b);
                }
            }
            _ => {
                self.compared += 1;
                if page != now {
                    self.differences.push(Difference {
                        what: what.to_owned(),
                        page: page.clone(),
                        now: now.clone(),
                    });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn compared(page: &Value, now: &Value) -> (usize, Vec<Difference>) {
        let mut found = Compared::default();
        found.compare("", page, now);
        (found.compared, found.differences)
    }

    #[test]
    fn what_differs_is_named() {
        let page =
            json!({"verdict": "named", "ranking": [{"effect": "creep", "score": 10.0}], "gone": 1});
        let now =
            json!({"verdict": "none", "ranking": [{"effect": "creep", "score": 10.5}], "new": 2});
        let (count, found) = compared(&page, &now);
        let said: Vec<_> = found.iter().map(Difference::to_string).collect();
        assert_eq!(count, 5);
        assert_eq!(
            said,
            [
                "gone: 1 in the page, null now",
                "ranking.creep.score: 10.0 in the page, 10.5 now",
                "verdict: \"named\" in the page, \"none\" now",
                "new: null in the page, 2 now",
            ]
        );
    }

    #[test]
    fn rounding_is_told_from_a_change() {
        let number = |page: f64, now: f64| compared(&json!(page), &json!(now)).1[0].is_rounding();
        assert!(number(1.0, 1.0 + 1e-12) && !number(1.0, 1.0001));
        assert!(!number(0.0, 1e-9));
        let word = compared(&json!("a"), &json!("b"));
        assert!(!word.1[0].is_rounding());
    }

    #[test]
    fn numbers_in_a_model_are_numbers() {
        let words = toml_words("R0 = { value = 360.5, unit = \"ohm\" }\nx = [1, 2.5e-3]");
        assert!(
            words.as_array().is_some_and(
                |words| words.contains(&json!(360.5)) && words.contains(&json!(0.0025))
            )
        );
    }
}
