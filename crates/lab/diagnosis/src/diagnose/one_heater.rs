//! Effects in a single heater on a bench: hundreds of kelvins are far from where slopes tell anything, so each is fitted
//! together with the base. What the base can do as well, as a film's TCR where nothing but the heater is a thermometer,
//! lowers no misfit then.

use super::analysis::Analysis;
use crate::candidate::{Candidate, Explanation, Refit, refit};
use crate::residual_space::Session;
use identification::heater;
use mirror_model::Model;
use mirror_model::effect::{Active, forms};
use rayon::prelude::*;

impl Analysis<'_> {
    /// The best of the fits of base and effect from several starts, whether or not slopes at the base see the effect.
    pub(super) fn fitted_together(
        &self,
        candidate: &Candidate,
    ) -> Option<(Explanation<Session>, Refit)> {
        let base = heater::unbent(&self.fitted.model);
        let scanned = candidate.explanation.iter().map(|e| e.active.clone());
        let usual = candidate.directions.iter().map(|d| d.active.clone());
        let actives: Vec<Active> = scanned.chain(usual).collect();
        let starts: Vec<Model> = forms(&candidate.effect)
            .iter()
            .flat_map(|form| {
                let of_form = |active: &&Active| active.effect.form() == form.form();
                let of_form: Vec<Active> = actives.iter().filter(of_form).cloned().collect();
                heater::starts(&base, &of_form, self.data)
            })
            .collect();
        let fits = starts.into_par_iter().filter_map(|mut start: Model| {
            let from = start.effects.pop()?;
            refit(&from, &start, self.data, &self.session, self.misfit)
        });
        let left = |refit: &Refit| refit.fitted.cost(self.data);
        let (found, mut refit) = fits.min_by(|(_, a), (_, b)| left(a).total_cmp(&left(b)))?;
        heater::bend_as(&mut refit.fitted.model, &self.fitted.model);
        let change = self.fitted.standardised(self.data) - refit.fitted.standardised(self.data);
        Some((found.explanation(self.session.vector(&change)), refit))
    }
}
