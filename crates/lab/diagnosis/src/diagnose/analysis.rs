//! What one session's candidates are judged with.

use super::form_error::form_errors;
use crate::candidate::{Candidate, Operating};
use crate::confusions::Channels;
use crate::held_out::{HeldOut, training_noise};
use crate::null_distribution::{CONFIDENCE, LeftOutFamily, NullDistribution};
use crate::null_ensemble::{MEMBERS, NullEnsemble, coordinates};
use crate::quantile::{quantile, sorted};
use crate::report::Rms;
use crate::residual_space::{BaseOnly, ResidualSpace, Session, Training, Vector};
use identification::Unit;
use identification::dataset::{self, Dataset, Observation};
use identification::fit::Fitted;
use identification::heater;
use identification::prediction::{jacobian, predict, standard_deviation, white_noise};
use mirror_model::Runaway;
use mirror_model::effect::{Effect, forms};
use nalgebra::DVector;
use std::sync::{Arc, OnceLock};

/// Everything that one session's candidates are judged with.
pub(super) struct Analysis<'a> {
    pub(super) data: &'a Dataset,
    pub(super) ensemble: &'a NullEnsemble,
    pub(super) null: NullDistribution,
    /// The null ensemble's mirrors, each family in the space of the others.
    pub(super) left_out: Vec<LeftOutFamily>,
    pub(super) fitted: Fitted,
    /// Predictions of the fitted base (um, A).
    pub(super) base: Vec<f64>,
    pub(super) session: ResidualSpace<Session>,
    pub(super) training: ResidualSpace<Training>,
    pub(super) base_only: ResidualSpace<BaseOnly>,
    /// What the base leaves of the session.
    pub(super) residual: Vector<Session>,
    /// What neither base nor discrepancy explains of it.
    pub(super) misfit: f64,
    /// What the base leaves on rows held out, once it was asked for.
    pub(super) held_out: OnceLock<Option<HeldOut>>,
    /// What it leaves of the null ensemble's mirrors (root mean squares), in order, once it was asked for.
    discrepancies: OnceLock<Vec<f64>>,
}

impl<'a> Analysis<'a> {
    /// The analysis, and what is tried in it.
    pub(super) fn new(
        data: &'a Dataset,
        fitted: Fitted,
        ensemble: &'a NullEnsemble,
        effects: &[Arc<dyn Effect>],
    ) -> Result<(Self, Vec<Candidate>), Runaway> {
        let jacobian = jacobian(&fitted.model, data, &fitted.free)?;
        let white = white_noise(data);
        let base = predict(&fitted.model, data)?;
        let forms = form_errors(&fitted.model, data, &base);
        let discrepancy = Arc::new(ensemble.discrepancy(&white).with_forms(&forms));
        let kept = training_noise(data, &white);
        let of_training = Arc::new(ensemble.discrepancy(&kept).with_forms(&forms));
        let session = ResidualSpace::of_all(&jacobian, &discrepancy);
        let mut candidates = candidates(&fitted, data, &base, effects, &session);
        let left_out = LeftOutFamily::all(&jacobian, &discrepancy, &white);
        let at = coordinates(&fitted.model, data);
        let residual = session.residual(&fitted.standardised(data), &at);
        let analysis = Self {
            data,
            ensemble,
            null: NullDistribution::new(&left_out, is_cramped(data), &mut candidates),
            base,
            left_out,
            training: ResidualSpace::of_all(&jacobian, &of_training),
            base_only: ResidualSpace::of_base(&jacobian),
            misfit: residual.norm_squared(),
            residual,
            session,
            fitted,
            held_out: OnceLock::new(),
            discrepancies: OnceLock::new(),
        };
        Ok((analysis, candidates))
    }

    pub(super) fn operating(&self) -> Operating<'_> {
        Operating {
            model: &self.fitted.model,
            data: self.data,
            base: &self.base,
        }
    }

    pub(super) fn channels(&self) -> Channels {
        Channels::of(self.data)
    }

    /// The unit of the session's errors: the displacement's, or where none was measured the currents'.
    pub(super) fn unit(&self) -> Unit {
        if self.data.has_displacement() {
            Unit::Micrometre
        } else {
            Unit::Milliampere
        }
    }

    /// Root mean square of a standardised residual over the readings of a unit.
    pub(super) fn rms(&self, standardised: &DVector<f64>, unit: Unit) -> Rms {
        let rows = standardised.iter().copied();
        rms(rows.zip(&self.data.observations), unit)
    }

    /// What the base leaves.
    pub(super) fn error(&self) -> Rms {
        self.rms(&self.fitted.standardised(self.data), self.unit())
    }

    /// What the base leaves of the median mirror of the null ensemble.
    pub(super) fn discrepancy_rms(&self) -> Rms {
        self.discrepancy_at(0.5)
    }

    /// What it leaves of 95 of 100 at most.
    pub(super) fn large_discrepancy(&self) -> Rms {
        self.discrepancy_at(CONFIDENCE)
    }

    /// What it leaves of such a share of them at most.
    pub(super) fn discrepancy_at(&self, share: f64) -> Rms {
        let unit = self.unit();
        let sizes = self.discrepancies.get_or_init(|| {
            let columns = self.ensemble.residuals().column_iter();
            sorted(columns.map(|column| self.rms(&column.into_owned(), unit).value))
        });
        Rms {
            value: quantile(sizes, share),
            unit,
        }
    }
}

/// Those of these effects that the model has not, with what each would change; in a heater on a bench at the strengths that
/// are plausible there.
fn candidates(
    fitted: &Fitted,
    data: &Dataset,
    base: &[f64],
    effects: &[Arc<dyn Effect>],
    space: &ResidualSpace<Session>,
) -> Vec<Candidate> {
    let heater = heater::heater(&fitted.model, data);
    let unbent = heater.is_some().then(|| heater::unbent(&fitted.model));
    let at = Operating {
        model: unbent.as_ref().unwrap_or(&fitted.model),
        data,
        base,
    };
    let is_present = |effect: &Arc<dyn Effect>| {
        let mut present = fitted.model.effects.iter();
        present.any(|active| active.id() == effect.info().id)
    };
    let suited = |effect: Arc<dyn Effect>| match &heater {
        Some(heater) => heater.suits(&effect),
        None => effect,
    };
    effects
        .iter()
        .filter(|effect| !is_present(effect))
        .map(|effect| {
            let forms = forms(effect).into_iter().map(suited);
            let directions = forms.flat_map(|form| at.directions(&form, space));
            let directions = directions.collect();
            Candidate::new(suited(effect.clone()), directions)
        })
        .collect()
}

/// Whether virtual mirrors tell little of how large scores may be: their residuals span all readings, or they stand for heaters
/// on a bench.
fn is_cramped(data: &Dataset) -> bool {
    data.observations.len() <= MEMBERS || data.is_of_heaters()
}

/// The highest score first.
pub(super) fn best_first(candidates: &mut [Candidate]) {
    candidates.sort_by(|a, b| b.score().total_cmp(&a.score()));
}

/// Root mean square of standardised numbers over the readings of a unit, 0 where there are none.
pub(super) fn rms<'o>(
    standardised: impl Iterator<Item = (f64, &'o Observation)>,
    unit: Unit,
) -> Rms {
    let numbers = standardised.map(|(value, o)| (value * standard_deviation(o), o));
    let value = match unit {
        Unit::Micrometre => dataset::rms(numbers, true).unwrap_or(0.0),
        Unit::Milliampere => 1e3 * dataset::rms(numbers, false).unwrap_or(0.0),
    };
    Rms { value, unit }
}
