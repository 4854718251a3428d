//! What was tried, in words.

use super::numbers::digits;
use crate::report::{Diagnosis, Form, Ranked};
use identification::Estimate;
use std::fmt;

/// Candidates that are shown: so many at least, which a screen has room for, and all above their thresholds.
const SHOWN: usize = 6;
/// Candidates above their thresholds with this share of the best score get a sentence: those that are fitted together with
/// the base.
const WORTH_A_SENTENCE: f64 = 0.4;

impl Diagnosis {
    /// The candidates as a table, and a sentence each of those that matter.
    pub(super) fn candidates(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "\n  {:<22} {:>9} {:>9} {:>6} {:>9} {:>9}  size that fits",
            "effect", "score", "threshold", "weight", "error", "held out"
        )?;
        let remarkable = self
            .ranking
            .iter()
            .filter(|r| r.score > r.threshold)
            .count();
        let shown = || self.ranking.iter().take(remarkable.max(SHOWN));
        for ranked in shown() {
            writeln!(f, "  {ranked}")?;
        }
        let best = self.ranking.first().map_or(0.0, |best| best.score);
        let told = |ranked: &&Ranked| {
            let close = ranked.score > ranked.threshold.max(WORTH_A_SENTENCE * best);
            close || self.effects.contains(&ranked.effect)
        };
        for ranked in shown().filter(told) {
            let form = ranked.form.as_ref().map_or(String::new(), said_of_form);
            writeln!(f, "  {}: {form}{}", ranked.effect, ranked.why)?;
        }
        Ok(())
    }
}

/// "its form is air, which these data do not tell from linear; "
fn said_of_form(form: &Form) -> String {
    let Form {
        name,
        alike,
        inverted,
    } = form;
    let told = match &alike[..] {
        [] => String::new(),
        alike => format!(", which these data do not tell from {}", alike.join(", ")),
    };
    let inverted = inverted.as_ref().map_or_else(String::new, |inverted| {
        format!(" (the board inverts {inverted} only, which fits clearly less)")
    });
    format!("its form is {name}{told}{inverted}; ")
}

impl fmt::Display for Ranked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            effect,
            score,
            threshold,
            weight,
            ..
        } = self;
        write!(
            f,
            "{effect:<22} {score:>9.1} {threshold:>9.1} {:>5.0}% {:>9.3} {:>9.3} ",
            100.0 * weight,
            self.error_rms.after,
            self.held_out_rms.after
        )?;
        for (
            symbol,
            Estimate {
                value,
                standard_error,
                unit,
            },
        ) in &self.parameters
        {
            write!(f, " {symbol} {}", digits(*value))?;
            if let Some(error) = standard_error {
                write!(f, " +- {}", digits(*error))?;
            }
            if unit != "1" {
                write!(f, " {unit}")?;
            }
        }
        if !self.plausible {
            write!(f, ", at the end of what is plausible")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_form_is_told_with_those_like_it_and_with_the_one_that_the_board_inverts() {
        let said = |name: &str, alike: &[&str], inverted: Option<&str>| {
            said_of_form(&Form {
                name: name.into(),
                alike: alike.iter().map(|&form| form.into()).collect(),
                inverted: inverted.map(Into::into),
            })
        };
        assert_eq!(said("pole", &[], None), "its form is pole; ");
        assert_eq!(
            said("dahl", &["bouc-wen"], Some("play")),
            "its form is dahl, which these data do not tell from bouc-wen (the board inverts play only, which fits clearly less); "
        );
    }
}
