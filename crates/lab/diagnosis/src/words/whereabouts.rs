//! Where something is missing and what it behaves like, in words.

use crate::report::{BeforeAfter, Diagnosis, Verdict};
use crate::whereabouts::{Located, StageConfidence};
use std::fmt;

impl Diagnosis {
    /// Where it is without the list, and what it behaves like.
    pub(super) fn place(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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
        )?;
        if let Some(currents) = proposal.current_rms {
            writeln!(
                f,
                "    of the currents {:.4} {} rms, with it {:.4}",
                currents.before, currents.unit, currents.after
            )?;
        }
        if likely.iter().all(|likely| likely.stage != proposal.stage) {
            writeln!(
                f,
                "    it acts elsewhere ({}) than where something is missing: no formula that was tried there explains as much, so take it for a description, not for the effect",
                proposal.stage
            )?;
        }
        Ok(())
    }
}
