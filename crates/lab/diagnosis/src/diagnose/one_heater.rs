//! Effects in a single heater on a bench: hundreds of kelvins are far from where slopes tell anything, so each is fitted
//! together with the base. What the base can do as well, as a film's TCR where nothing but the heater is a thermometer,
//! lowers no misfit then.

use super::Analysis;
use crate::candidate::{Explanation, Refit, refit};
use crate::residual_space::Session;
use identification::heater;
use mirror_model::Model;
use mirror_model::effect::Active;
use rayon::prelude::*;

impl Analysis<'_> {
    /// The best of the fits of base and effect from several starts.
    pub(super) fn fitted_together(
        &self,
        scanned: &Explanation<Session>,
    ) -> Option<(Explanation<Session>, Refit)> {
        let base = heater::unbent(&self.fitted.model);
        let usual = Active::usual(scanned.active.effect.clone());
        let starts = heater::starts(&base, &[usual, scanned.active.clone()], self.data);
        let fits = starts.into_par_iter().filter_map(|mut start: Model| {
            let active = start.effects.pop()?;
            let from = Explanation {
                active,
                ..scanned.clone()
            };
            refit(&from, &start, self.data, &self.session, self.misfit)
        });
        let (mut best, refit) = fits.max_by(|(a, _), (b, _)| a.score.total_cmp(&b.score))?;
        let change = self.fitted.standardised(self.data) - refit.fitted.standardised(self.data);
        best.change = self.session.vector(&change);
        Some((best, refit))
    }
}
