//! A diagnosis in words.

mod expected_gain;

use crate::report::{BeforeAfter, Diagnosis, Form, Ranked, Remainder, Rms, Verdict};
use crate::whereabouts::{Located, StageConfidence};
use identification::Estimate;
use mirror_model::effect::find;
use std::fmt;

/// Candidates that are shown: so many at least, which a screen has room for, and all above their thresholds.
const SHOWN: usize = 6;
/// Candidates above their thresholds with this share of the best score get a sentence: those that are fitted together with
/// the base.
const WORTH_A_SENTENCE: f64 = 0.4;

impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = self.effects.join(", ");
        match self.verdict {
            Verdict::Named => match &self.remainder {
                None => writeln!(f, "Missing: {list}")?,
                Some(remainder) => writeln!(f, "Missing: {}", mostly(&list, remainder))?,
            },
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
                "Nothing is missing: what is left is noise and the model's discrepancy"
            )?,
        }
        self.errors(f)?;
        self.candidates(f)?;
        if !self.infeasible.is_empty() {
            let ids = self.infeasible.join(", ");
            writeln!(f, "  not tried, since the model runs away with them: {ids}")?;
        }
        if self.verdict == Verdict::None {
            self.limits(f)?;
        }
        self.place(f)?;
        self.notes
            .iter()
            .try_for_each(|note| writeln!(f, "  {note}"))
    }
}

impl Diagnosis {
    fn errors(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let best = self.ranking.first();
        let BeforeAfter {
            before,
            after,
            unit,
        } = self.error_rms;
        write!(f, "  error {before:.3} {unit} rms")?;
        match best {
            Some(best) => writeln!(f, ", with {} added {after:.3} {unit}", best.effect)?,
            None => writeln!(f)?,
        }
        if let Some(currents) = best.and_then(|best| best.current_rms) {
            let BeforeAfter {
                before,
                after,
                unit,
            } = currents;
            writeln!(
                f,
                "  of the currents {before:.4} {unit} rms, then {after:.4} {unit}"
            )?;
        }
        if let Some(best) = best.filter(|best| self.effects.contains(&best.effect)) {
            let BeforeAfter {
                before,
                after,
                unit,
            } = best.held_out_rms;
            writeln!(
                f,
                "  on readings held out of its fit {before:.3} {unit} rms, with it {after:.3} {unit}"
            )?;
        }
        if let Some(null) = best.and_then(|best| best.null_improvement) {
            writeln!(f, "  {null}")?;
        }
        writeln!(
            f,
            "  the model's discrepancy, which is no missing effect: {:.3} {unit} rms in the median mirror of the null ensemble",
            self.discrepancy_rms.value
        )?;
        writeln!(
            f,
            "  misfit beyond that discrepancy: {:.2} times what such mirrors show",
            self.misfit
        )
    }

    fn candidates(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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

    /// Where it is without the list, and what it behaves like.
    fn place(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(found) = &self.whereabouts else {
            return Ok(());
        };
        let likely = found.likely();
        let stages: Vec<String> = likely.iter().map(StageConfidence::to_string).collect();
        let places = found.best_of(&likely);
        let said = places
            .first()
            .map_or(String::new(), |place| format!(": {}", place.place));
        writeln!(
            f,
            "\n  without the list, where it is: {}{said}",
            stages.join(", ")
        )?;
        if self.verdict != Verdict::Unknown {
            return Ok(());
        }
        for Located {
            place,
            score,
            threshold,
            ..
        } in places
        {
            writeln!(
                f,
                "    {place} (score {score:.0}, threshold {threshold:.0})"
            )?;
        }
        let Some(proposal) = &self.proposal else {
            return Ok(());
        };
        let BeforeAfter {
            before,
            after,
            unit,
        } = proposal.error_rms;
        let [held_before, held_after] = [proposal.held_out_rms.before, proposal.held_out_rms.after];
        writeln!(f, "  no known effect; {}", proposal.sentence)?;
        writeln!(
            f,
            "    error {before:.3} {unit} rms, with it {after:.3}; on readings held out {held_before:.3}, with it {held_after:.3}"
        )
    }

    /// What these data would have shown.
    fn limits(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let limit = |ranked: &Ranked| {
            let effect = find(&ranked.effect)?;
            let strength = &effect.info().parameters[0];
            let limit = size(ranked.detection_limit?, &strength.unit);
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
            "  invisible in these data, at any plausible size: {}",
            self.invisible.join(", ")
        )
    }
}

/// An effect that takes most of the error, and where it does not.
fn mostly(effect: &str, remainder: &Remainder) -> String {
    let Rms { value, unit } = remainder.rms;
    match remainder.up_to_v {
        Some(volts) => format!(
            "mostly {effect}, up to {} V; something else above, which leaves {value:.3} {unit} rms",
            digits(volts)
        ),
        None => {
            format!("mostly {effect}; something else besides, which leaves {value:.3} {unit} rms")
        }
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

/// A size with its unit; parts of a whole in percent.
fn size(value: f64, unit: &str) -> String {
    if unit == "1" {
        format!("{} %", digits(100.0 * value))
    } else {
        format!("{} {unit}", digits(value))
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
    use crate::report::ProposedForm;
    use crate::whereabouts::{Driver, Place, Whereabouts};
    use identification::Unit;
    use mirror_model::effect::{Acts, Stage};
    use std::collections::BTreeMap;

    fn error(unit: Unit) -> BeforeAfter {
        BeforeAfter {
            before: 0.4,
            after: 0.2,
            unit,
        }
    }

    fn ranked(effect: &str, score: f64) -> Ranked {
        let value = Estimate {
            value: 0.0267,
            standard_error: Some(0.0027),
            unit: "1".into(),
        };
        Ranked {
            effect: effect.into(),
            form: None,
            score,
            threshold: 48.0,
            null_scores: vec![],
            weight: 1.0,
            detection_limit: Some(0.01),
            held_out_rms: error(Unit::Milliampere),
            error_rms: error(Unit::Milliampere),
            current_rms: None,
            null_improvement: None,
            plausible: true,
            parameters: BTreeMap::from([("c".into(), value)]),
            look_alikes: vec![],
            why: "for a reason".into(),
        }
    }

    fn diagnosis(verdict: Verdict, effects: &[&str]) -> Diagnosis {
        Diagnosis {
            verdict,
            effects: effects.iter().map(|&id| id.into()).collect(),
            discrepancy_rms: Rms {
                value: 0.3,
                unit: Unit::Milliampere,
            },
            remainder: None,
            whereabouts: None,
            proposal: None,
            error_rms: error(Unit::Milliampere),
            misfit: 2.0,
            solver_error: 0.0,
            invisible: vec!["radiation".into()],
            infeasible: vec![],
            ranking: vec![ranked("creep", 100.0), ranked("hysteresis", 30.0)],
            next_measurement: None,
            thinned_rows: 0,
            notes: vec![],
        }
    }

    #[test]
    fn a_diagnosis_begins_with_its_verdict() {
        for (verdict, effects, first) in [
            (Verdict::Named, &["creep"][..], "Missing: creep"),
            (
                Verdict::Ambiguous,
                &["creep", "hysteresis"],
                "Missing: one of creep, hysteresis; these data cannot tell which",
            ),
            (
                Verdict::Unknown,
                &[],
                "Something is missing, and none of the known effects explains it",
            ),
            (
                Verdict::None,
                &[],
                "Nothing is missing: what is left is noise and the model's discrepancy",
            ),
        ] {
            let said = diagnosis(verdict, effects).to_string();
            assert_eq!(said.lines().next(), Some(first));
        }
        let mut blind = diagnosis(Verdict::None, &[]);
        blind.invisible.push("crosstalk".into());
        assert!(blind.to_string().starts_with("These data cannot tell"));
    }

    #[test]
    fn what_takes_most_of_the_error_is_told_with_where_it_does_not() {
        let mut found = diagnosis(Verdict::Named, &["radiation"]);
        found.remainder = Some(Remainder {
            rms: found.discrepancy_rms,
            up_to_v: Some(9.0),
        });
        let said = found.to_string();
        let first = "Missing: mostly radiation, up to 9.00 V; something else above, which leaves 0.300 mA rms";
        assert_eq!(said.lines().next(), Some(first));
    }

    #[test]
    fn what_the_model_runs_away_with_is_told() {
        let mut found = diagnosis(Verdict::None, &[]);
        found.infeasible = vec!["radiation".into()];
        let told = "not tried, since the model runs away with them: radiation";
        assert!(found.to_string().contains(told), "{found}");
    }

    #[test]
    fn where_it_is_is_told_with_what_it_behaves_like() {
        let mut found = diagnosis(Verdict::Unknown, &[]);
        let place = Place {
            acts: Acts::Resistance,
            driver: Driver::Exposure,
        };
        let stage = |stage, confidence| StageConfidence {
            stage,
            score: 1e3,
            confidence,
        };
        found.whereabouts = Some(Whereabouts {
            stages: vec![
                stage(Stage::Resistance, 0.88),
                stage(Stage::Drive, 0.08),
                stage(Stage::Heat, 0.04),
            ],
            places: vec![Located {
                stage: place.stage(),
                place,
                score: 1e3,
                threshold: 64.0,
            }],
        });
        found.proposal = Some(ProposedForm {
            effect: "proposed-resistance".into(),
            text: String::new(),
            sentence: "the resistance x behaves as x * (1 + 2.0e-4 * s)".into(),
            score: 900.0,
            threshold: 70.0,
            error_rms: error(Unit::Milliampere),
            held_out_rms: error(Unit::Milliampere),
        });
        let said = found.to_string();
        let expected = "  without the list, where it is: resistance 88 %, drive 8 %: the resistance varies with how long it was how hot\n    \
                        the resistance varies with how long it was how hot (score 1000, threshold 64)\n  \
                        no known effect; the resistance x behaves as x * (1 + 2.0e-4 * s)\n    \
                        error 0.400 mA rms, with it 0.200; on readings held out 0.400, with it 0.200\n";
        assert!(said.ends_with(expected), "{said}");
        // Of what is named, the places are not listed.
        let named = Diagnosis {
            verdict: Verdict::Named,
            ..found
        };
        assert!(!named.to_string().contains("threshold 64"), "{named}");
    }

    #[test]
    fn errors_carry_their_unit() {
        let said = diagnosis(Verdict::Named, &["creep"]).to_string();
        assert!(
            said.contains("error 0.400 mA rms, with creep added 0.200 mA"),
            "{said}"
        );
        assert!(said.contains("0.300 mA rms in the median mirror"), "{said}");
    }

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

    #[test]
    fn limits_are_told_where_nothing_is_missing() {
        let said = diagnosis(Verdict::None, &[]).to_string();
        assert!(
            said.contains("I would have seen creep (c beyond 1.00 %)"),
            "{said}"
        );
        assert!(
            said.contains("invisible in these data, at any plausible size: radiation"),
            "{said}"
        );
    }

    #[test]
    fn numbers_have_three_digits() {
        let said: Vec<_> = [0.0, 0.012345, -1.5, 123.456, 99999.0, 1e-7]
            .map(digits)
            .into();
        assert_eq!(said, ["0", "0.0123", "-1.50", "123", "99999", "1.00e-7"]);
    }
}
