//! A diagnosis in words.

mod candidates;
mod expected_gain;
mod numbers;
mod whereabouts;

pub(crate) use self::numbers::digits;
use self::numbers::size;
use crate::report::{BeforeAfter, Diagnosis, Ranked, Remainder, Rms, Verdict, WORTHWHILE, leading};
use mirror_model::effect::find;
use std::fmt;

impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = self.effects.join(", ");
        let odd = self.odd_file.as_ref();
        let odd = odd.map(|name| format!("`{name}` reads otherwise than the other files"));
        match self.verdict {
            Verdict::Named | Verdict::Ambiguous => {
                let missing = match (self.verdict, &self.remainder) {
                    (Verdict::Ambiguous, _) => {
                        format!("one of {list}; these data cannot tell which")
                    }
                    (_, None) => list.clone(),
                    (_, Some(remainder)) => partly(&list, remainder),
                };
                let odd = odd.map(|odd| format!(", or nothing: {odd}, which explains more"));
                writeln!(f, "Missing: {missing}{}", odd.unwrap_or_default())?
            }
            Verdict::Unknown => match odd {
                None => writeln!(
                    f,
                    "Something is missing, and none of the known effects explains it"
                )?,
                Some(odd) => writeln!(f, "{odd}, which explains what no known effect does")?,
            },
            Verdict::None if self.invisible.len() > self.ranking.len() / 2 => writeln!(
                f,
                "These data cannot tell: most effects would not show in them"
            )?,
            Verdict::None => match odd {
                None => writeln!(
                    f,
                    "Nothing is missing: what is left is noise and the model's discrepancy{}",
                    self.unnamed()
                )?,
                Some(odd) => writeln!(f, "Nothing is missing, but {odd}")?,
            },
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
        if self.remainder.is_some() {
            writeln!(
                f,
                "  for the rest add it, and diagnose again: `host-tool effect add {list} MODEL FILES -o NEW_MODEL`"
            )?;
        }
        self.notes
            .iter()
            .try_for_each(|note| writeln!(f, "  {note}"))
    }
}

impl Diagnosis {
    /// Which effect scores more than its threshold where nothing is named, if one does; a note says why it is not.
    fn unnamed(&self) -> String {
        let above = self.ranking.iter().find(|r| r.is_above());
        above.map_or_else(String::new, |above| {
            format!(
                ", though {} scores more than its threshold and is not named",
                above.effect
            )
        })
    }

    fn errors(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Where nothing is missing, an effect that is added fits noise only, and an error with it would read as a find.
        let best = leading(&self.ranking, &self.effects);
        let best = best.filter(|_| self.verdict != Verdict::None);
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
            let falls = |error: BeforeAfter| error.fall() >= WORTHWHILE;
            let is_for_them = falls(currents) && !falls(self.error_rms);
            let why = match best {
                Some(best) if is_for_them && self.effects.contains(&best.effect) => {
                    ", for which it is named,"
                }
                _ => "",
            };
            writeln!(
                f,
                "  of the currents{why} {before:.4} {unit} rms, then {after:.4} {unit}"
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
        // What scores more than its threshold was seen, be it named or not.
        let unseen = self.ranking.iter().filter(|ranked| !ranked.is_above());
        let seen: Vec<String> = unseen.filter_map(limit).collect();
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

/// A named effect, and what it leaves: from which drive on, or everywhere.
fn partly(effect: &str, remainder: &Remainder) -> String {
    let Rms { value, unit } = remainder.rms;
    let rest = format!("which leaves {value:.3} {unit} rms");
    match remainder.up_to_v {
        _ if !remainder.is_the_lesser_part => format!("{effect}, and something else, {rest}"),
        Some(volts) => {
            let volts = digits(volts);
            format!("mostly {effect}, up to {volts} V; something else above, {rest}")
        }
        None => format!("mostly {effect}; something else besides, {rest}"),
    }
}

#[cfg(test)]
pub(crate) mod tests;
