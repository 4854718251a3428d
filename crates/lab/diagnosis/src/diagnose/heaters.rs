//! Effects in a heater on a bench: hundreds of kelvins are far from where slopes tell anything, so each is fitted together
//! with the base. What the base can do as well, as a film's TCR where nothing but the heater is a thermometer, lowers no
//! misfit then.

use super::Bench;
use crate::candidate::{Explanation, refit};
use crate::heater;
use mirror_model::Model;
use mirror_model::effect::Active;
use rayon::prelude::*;

impl Bench<'_> {
    /// The best of the fits of base and effect from several starts.
    pub(super) fn fitted_together(
        &self,
        scanned: &Explanation,
        misfit: f64,
    ) -> Option<Explanation> {
        let base = heater::unbent(&self.fitted.model);
        let usual = Active::usual(scanned.active.effect.clone());
        let starts = heater::starts(&base, &[usual, scanned.active.clone()], self.plan);
        let fits = starts.into_par_iter().filter_map(|mut start: Model| {
            let active = start.effects.pop()?;
            let from = Explanation {
                active,
                ..scanned.clone()
            };
            refit(&from, &start, self.plan, &self.space, misfit)
        });
        let best = fits.max_by(|a, b| a.score.total_cmp(&b.score))?;
        let left = best.refit.as_ref()?.fitted.scaled(self.plan);
        Some(Explanation {
            change: self.space.vector(&(self.fitted.scaled(self.plan) - left)),
            ..best
        })
    }
}
