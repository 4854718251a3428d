//! What a fact of the mirror would be worth that its model file does not state: the session is looked at with the null ensemble
//! of a mirror of which it is known.

use super::Analysis;
use crate::candidate::Candidate;
use crate::null_ensemble::NullEnsemble;
use crate::null_ensemble::unknowns::{Unknown, unknowns};
use crate::report::{Shown, Worth};
use mirror_model::Runaway;
use mirror_model::effect::Effect;
use std::path::Path;
use std::sync::Arc;

/// The part to which the strength falls that shows an effect, where knowing a fact is said to show it better.
const HALF: f64 = 0.5;

impl Analysis<'_> {
    /// The worth of everything that could still be stated of the mirror, the most first. `named` are the effects that the
    /// session suspects, of these `candidates`; `cache` is as in [`diagnose`](crate::diagnose()).
    pub(super) fn worth_of_facts(
        &self,
        effects: &[Arc<dyn Effect>],
        candidates: &[Candidate],
        named: &[String],
        cache: Option<&Path>,
    ) -> Result<Vec<Worth>, Runaway> {
        // A heater on a bench is no mirror: of what is stated only its leads count, and no usual means tells those.
        if self.data.is_of_heaters() {
            return Ok(Vec::new());
        }
        let worth = |unknown: Unknown| {
            let ensemble = NullEnsemble::new(self.data, &unknown.device, cache)?;
            let (known, then) = Analysis::new(self.data, self.fitted.clone(), &ensemble, effects)?;
            Ok(Worth {
                key: unknown.key.to_owned(),
                what: unknown.what,
                shows: shown(candidates, &then),
                tells_apart: self.tells_apart(&known, candidates, named),
            })
        };
        let unknowns = unknowns(&self.fitted.model.device).into_iter();
        let mut worths: Vec<Worth> = unknowns.map(worth).collect::<Result<_, Runaway>>()?;
        worths.sort_by(|a, b| b.rank().total_cmp(&a.rank()));
        Ok(worths)
    }

    /// How many times as large the least difference between suspects is to an analysis that knows more of the mirror.
    fn tells_apart(
        &self,
        known: &Analysis<'_>,
        candidates: &[Candidate],
        named: &[String],
    ) -> Option<f64> {
        let suspects = candidates
            .iter()
            .filter(|c| named.iter().any(|id| id == c.id()));
        let changes: Vec<_> = suspects
            .filter_map(|suspect| Some(&suspect.explanation.as_ref()?.change))
            .collect();
        let pairs = changes.iter().enumerate().flat_map(|(index, one)| {
            let others = changes[index + 1..].iter();
            others.map(move |other| *one - *other)
        });
        let (now, then) = pairs
            .map(|difference| {
                let standardised = self.session.standardised(&difference);
                let then = known.session.vector(&standardised).norm_squared();
                (difference.norm_squared(), then)
            })
            .reduce(|least, pair| (least.0.min(pair.0), least.1.min(pair.1)))?;
        Some((then / now.max(f64::MIN_POSITIVE)).sqrt())
    }
}

/// Effects that are not seen at their usual strength now, and then are, or at [`HALF`] of the strength that it takes now.
fn shown(now: &[Candidate], then: &[Candidate]) -> Vec<Shown> {
    let shown = now.iter().filter_map(|now| {
        let then = then.iter().find(|then| then.id() == now.id())?;
        let strength = &now.effect.info().parameters[0];
        let usual = strength.start.abs();
        let (was, limit) = (now.detection_limit(), then.detection_limit()?);
        let before = was.unwrap_or(f64::INFINITY);
        let is_shown = before > usual && limit <= usual.max(HALF * before);
        is_shown.then(|| Shown {
            effect: now.id().to_owned(),
            symbol: strength.symbol.to_string(),
            unit: strength.unit.to_string(),
            now: was,
            then: limit,
        })
    });
    shown.collect()
}
