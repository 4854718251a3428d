//! A diagnosis in words.

use crate::report::{BeforeAfter, Diagnosis, Ranked, Verdict};
use identification::Estimate;
use mirror_model::effect::{Parameter, find};
use std::fmt;

/// Candidates that are shown: so many at least, and all above their thresholds.
const SHOWN: usize = 6;
/// Candidates with this share of the best score are told of in a sentence.
const WORTH_A_SENTENCE: f64 = 0.4;

impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = self.effects.join(", ");
        match self.verdict {
            Verdict::Named => writeln!(f, "Missing: {list}")?,
            Verdict::Ambiguous => {
                writeln!(f, "Missing: one of {list}; these data cannot tell which")?
            }
            Verdict::Unknown => writeln!(
                f,
                "Something is missing, and none of the known effects explains it"
            )?,
            Verdict::None if self.invisible.len() > self.ranking.len() / 2 => writeln!(
                f,
                "These data cannot tell: most effects would not show in them"
            )?,
            Verdict::None => writeln!(
                f,
                "Nothing is missing: what is left is noise and the model's approximation"
            )?,
        }
        self.errors(f)?;
        self.candidates(f)?;
        if self.verdict == Verdict::None {
            self.limits(f)?;
        }
        Ok(())
    }
}

impl Diagnosis {
    fn errors(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = self.unit;
        let best = self.ranking.first();
        let BeforeAfter { before, after } = self.error_rms_um;
        write!(f, "  error {before:.3} {unit} rms")?;
        match best {
            Some(best) => writeln!(f, ", with {} added {after:.3} {unit}", best.effect)?,
            None => writeln!(f)?,
        }
        if let Some(BeforeAfter { before, after }) = best.and_then(|best| best.current_rms_ma) {
            writeln!(
                f,
                "  of the currents {before:.4} mA rms, then {after:.4} mA"
            )?;
        }
        if let Some(placebo) = best.and_then(|best| best.placebo) {
            writeln!(f, "  {placebo}")?;
        }
        writeln!(
            f,
            "  the model's approximation, which is no missing effect: {:.3} {unit} rms on the median mirror with nothing hidden",
            self.approximation_rms_um
        )?;
        writeln!(
            f,
            "  misfit beyond that approximation: {:.2} times what such mirrors show",
            self.misfit
        )
    }

    fn candidates(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "\n  {:<22} {:>9} {:>9} {:>6} {:>9} {:>9}  size that fits",
            "effect", "score", "needed", "share", "error", "held out"
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
            writeln!(f, "  {}: {}", ranked.effect, ranked.why)?;
        }
        Ok(())
    }

    /// What these data would have shown.
    fn limits(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let limit = |ranked: &Ranked| {
            let effect = find(&ranked.effect)?;
            let strength = &effect.info().parameters[0];
            let limit = size(ranked.detection_limit?, strength);
            Some(format!(
                "{} ({} beyond {limit})",
                ranked.effect, strength.symbol
            ))
        };
        let seen: Vec<String> = self.ranking.iter().filter_map(limit).collect();
        if !seen.is_empty() {
            writeln!(f, "\n  I would have seen {}", seen.join(", "))?;
        }
        if self.invisible.is_empty() {
            return Ok(());
        }
        writeln!(
            f,
            "  invisible in these data, at any size that happens: {}",
            self.invisible.join(", ")
        )
    }
}

/// A size with its unit; parts of a whole in percent.
fn size(value: f64, parameter: &Parameter) -> String {
    if parameter.unit == "1" {
        format!("{} %", digits(100.0 * value))
    } else {
        format!("{} {}", digits(value), parameter.unit)
    }
}

/// Three digits, without an exponent where that is readable.
pub(crate) fn digits(value: f64) -> String {
    let magnitude = value.abs().log10().floor();
    if value == 0.0 {
        "0".into()
    } else if (-4.0..5.0).contains(&magnitude) {
        let decimals = (2.0 - magnitude).max(0.0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.2e}")
    }
}

impl fmt::Display for Ranked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            effect,
            score,
            threshold,
            probability,
            ..
        } = self;
        write!(
            f,
            "{effect:<22} {score:>9.1} {threshold:>9.1} {:>5.0}% {:>9.3} {:>9.3} ",
            100.0 * probability,
            self.error_rms_um.after,
            self.held_out_rms_um
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
    use super::digits;

    #[test]
    fn numbers_have_three_digits() {
        let said: Vec<_> = [0.0, 0.012345, -1.5, 123.456, 99999.0, 1e-7]
            .map(digits)
            .into();
        assert_eq!(said, ["0", "0.0123", "-1.50", "123", "99999", "1.00e-7"]);
    }
}
