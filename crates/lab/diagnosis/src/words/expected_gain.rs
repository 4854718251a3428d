//! What a fact of the mirror or a measurement would be worth, in words.

use super::numbers::size;
use crate::report::{ExpectedGain, Right, Shown};
use std::fmt;

impl fmt::Display for ExpectedGain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.what)?;
        if !self.shows.is_empty() {
            let shown: Vec<String> = self.shows.iter().map(Shown::to_string).collect();
            write!(f, " would show {}", shown.join(", "))?;
        }
        if let Some(times) = self.tells_apart {
            let and = if self.shows.is_empty() { "" } else { " and" };
            write!(
                f,
                "{and} would set the suspects {times:.1} times as far apart"
            )?;
        }
        let Right { between, now, then } = &self.right;
        let [now, then] = [now, then].map(|part| 100.0 * part);
        match between {
            Some([one, other]) => write!(
                f,
                "; it decides between {one} and {other} in {then:.0} of 100, this session in {now:.0}"
            ),
            None => write!(
                f,
                "; an effect of usual size is then seen in {then:.0} of 100, in this session in {now:.0}"
            ),
        }
    }
}

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            effect,
            symbol,
            unit,
            now,
            then,
        } = self;
        write!(f, "{effect} ({symbol} beyond {}, ", size(*then, unit))?;
        match now {
            Some(now) => write!(f, "now {})", size(*now, unit)),
            None => write!(f, "now at no plausible size)"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Means;

    #[test]
    fn what_is_gained_is_told() {
        let gain = ExpectedGain {
            means: Means::Fact("leads".into()),
            what: "the resistance of the leads within 2 ohm".into(),
            shows: vec![Shown {
                effect: "creep".into(),
                symbol: "c".into(),
                unit: "1".into(),
                now: Some(0.02),
                then: 0.01,
            }],
            tells_apart: Some(3.0),
            right: Right {
                between: Some(["creep".into(), "hysteresis".into()]),
                now: 0.61,
                then: 0.97,
            },
        };
        let told = "the resistance of the leads within 2 ohm would show creep (c beyond 1.00 %, now 2.00 %) and would set the \
                    suspects 3.0 times as far apart; it decides between creep and hysteresis in 97 of 100, this session in 61";
        assert_eq!(gain.to_string(), told);
        assert!(gain.is_some());
    }
}
