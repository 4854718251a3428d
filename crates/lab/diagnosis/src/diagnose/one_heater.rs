//! Effects in a single heater on a bench: hundreds of kelvins are far from where slopes tell anything, so each is fitted
//! together with the base. What the base can do as well, as a film's TCR where nothing but the heater is a thermometer,
//! lowers no misfit then.

use super::analysis::Analysis;
use crate::candidate::{Candidate, Explanation, Refit};
use crate::residual_space::Session;
use identification::fit::Precision;
use identification::heater;
use mirror_model::Model;
use mirror_model::effect::{Active, forms};

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
        let fits = parallel::filter_map(starts, |mut start: Model| {
            let from = start.effects.pop()?;
            self.refitted(&from, &[start], Precision::Fine)
        });
        let left = |refit: &Refit| refit.fitted.cost(self.data);
        let fits = fits.into_iter();
        let (found, mut refit) = fits.min_by(|(_, a), (_, b)| left(a).total_cmp(&left(b)))?;
        heater::bend_as(&mut refit.fitted.model, &self.fitted.model);
        let change = self.fitted.standardised(self.data) - refit.fitted.standardised(self.data);
        Some((found.explanation(self.session.vector(&change)), refit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::null_ensemble::NullEnsemble;
    use identification::dataset::Dataset;
    use identification::fit::fit;
    use mirror_model::effect::find;
    use mirror_model::{Preset, Symbol};

    const COLD_OHM: f64 = 2.0;
    const TCR_PER_K: f64 = 4e-3;
    const ROOM_K: f64 = 295.0;

    /// A heater's steady readings from its heat balance: it conducts `watt_per_kelvin`, radiates `k` (W/K^4), and its resistance is a
    /// straight line.
    fn session(watt_per_kelvin: f64, k: f64) -> Dataset {
        let point = |step: i32| {
            let rise_k = 60.0 * f64::from(step);
            let radiated_w = k * ((ROOM_K + rise_k).powi(4) - ROOM_K.powi(4));
            let watt = watt_per_kelvin * rise_k + radiated_w;
            (watt, COLD_OHM * (1.0 + TCR_PER_K * rise_k))
        };
        let points: Vec<_> = (1..=20).map(point).collect();
        let mut data = Dataset::of_a_heater(&points, 1e-6);
        data.is_steady = true;
        data
    }

    fn model() -> Model {
        let mut model = Model::from(Preset::Paper);
        model.parameters.set(Symbol::ColdResistance, COLD_OHM);
        model
            .parameters
            .set(Symbol::ResistanceCoefficient, TCR_PER_K);
        model
    }

    #[test]
    fn what_a_heater_radiates_is_found_though_it_is_most_of_what_it_loses() {
        // At 1200 K, where it is hottest, it radiates 0.9 W, and conducts 0.6 W.
        let (watt_per_kelvin, k) = (5e-4, 1.8e-13);
        let data = session(watt_per_kelvin, k);
        let fitted = fit(&model(), &data).expect("an answer");
        let ensemble = NullEnsemble::new(&data, &fitted.model.device, None).expect("an ensemble");
        let radiation = find("radiation").expect("an effect");
        let (analysis, candidates) =
            Analysis::new(&data, fitted, &ensemble, &[radiation]).expect("an answer");
        let (found, refit) = analysis.fitted_together(&candidates[0]).expect("a fit");
        // The rises are the model's own, so its strength is that of the heat balance, to where fits end.
        assert!(
            (found.active.values[0] / k - 1.0).abs() < 1e-2,
            "{:?}",
            found.active
        );
        let left = refit.fitted.cost(&data);
        assert!(left < 1e-3 * analysis.fitted.cost(&data), "{left}");
    }

    #[test]
    fn a_heater_that_only_conducts_radiates_nothing() {
        let data = session(1e-3, 0.0);
        let fitted = fit(&model(), &data).expect("an answer");
        let ensemble = NullEnsemble::new(&data, &fitted.model.device, None).expect("an ensemble");
        let radiation = find("radiation").expect("an effect");
        let (analysis, candidates) =
            Analysis::new(&data, fitted, &ensemble, &[radiation]).expect("an answer");
        let found = analysis.fitted_together(&candidates[0]);
        let score = found.map_or(0.0, |(found, _)| found.score);
        // The base leaves nothing but where its fit ends, and a parameter costs 6.
        assert!(score < 0.0, "{score}");
    }
}
