//! What a fit found, how well it is known, and what these data cannot tell apart.

use crate::dataset::Dataset;
use crate::estimate::Estimate;
use crate::fit::{Fitted, fit};
use crate::parameter::{BaseParameter, FreeParameter};
use crate::prediction::jacobian;
use mirror_model::{Model, Runaway, Symbol};
use nalgebra::{DMatrix, SymmetricEigen};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;

/// Correlations of at least this size are worth a line: one parameter's error is three times what it would be if the other were
/// known.
const STRONG: f64 = 0.95;
/// A direction whose information is this share of the best known one's is not known at all: forward differences give slopes to
/// some 1e-4, and information is their square.
const UNKNOWN: f64 = 1e-7;
/// Parameters of which so much lies in unknown directions are named: a choice.
const TAKES_PART: f64 = 0.1;
/// A parameter that is not known to this part of itself has no meaningful value.
const MEANINGLESS: f64 = 1.0;

/// A fit, for people and for `--json`.
#[derive(Clone, Debug, Serialize)]
pub struct FitReport {
    /// The fitted parameters. Those that the data do not determine are missing here and named in `inseparable`.
    pub parameters: BTreeMap<String, Estimate>,
    /// Pairs of parameters whose errors go together, with their correlation.
    pub correlations: Vec<(String, String, f64)>,
    /// Sentences on what the data cannot separate.
    pub inseparable: Vec<String>,
    /// Root mean square of what is left of the displacement, if it was measured.
    pub residual_rms_um: Option<f64>,
    /// Root mean square of what is left of the currents, if they were measured.
    pub residual_rms_ma: Option<f64>,
    /// Rows that were left out because they were more than a fit needs.
    pub thinned_rows: usize,
    /// Sentences on what was done to the readings before.
    pub notes: Vec<String>,
}

/// Fits a model to a session and reports. The model comes back with standard errors and provenance.
///
/// # Errors
/// [`Runaway`] if the model has no finite answer.
pub fn fit_and_report(
    model: &Model,
    data: &Dataset,
    files: &[String],
) -> Result<(Model, FitReport), Runaway> {
    report(fit(model, data)?, data, files)
}

/// Reports on a fit. The model comes back with standard errors and provenance.
///
/// # Errors
/// As [`fit_and_report`].
pub fn report(
    mut fitted: Fitted,
    data: &Dataset,
    files: &[String],
) -> Result<(Model, FitReport), Runaway> {
    let covariance = note_errors(&mut fitted, data)?;
    let mut parameters = known_errors(&fitted, &covariance);
    if !data.has_displacement() {
        parameters = as_products(parameters, &fitted.model);
    }
    let report = FitReport {
        parameters,
        correlations: correlations(&fitted, &covariance),
        inseparable: inseparable(&fitted.model, data)?,
        residual_rms_um: fitted.displacement_rms_um(data),
        residual_rms_ma: fitted.current_rms_ma(data),
        thinned_rows: data.thinned_rows,
        notes: data.notes.clone(),
    };
    let from = fitted.model.preset.name();
    let provenance = &mut fitted.model.provenance;
    provenance.files = files.to_vec();
    provenance.residual_rms_um = report.residual_rms_um;
    provenance.note = Some(format!("fitted from {from}"));
    Ok((fitted.model, report))
}

/// Of the coordinates. Scaled up by the reduced chi-square where that is above one, so that a wrong model's errors are not too small.
pub(crate) fn covariance(slopes: &DMatrix<f64>, fitted: &Fitted, data: &Dataset) -> DMatrix<f64> {
    let squares = fitted.cost(data);
    let freedom = data
        .observations
        .len()
        .saturating_sub(fitted.free.len())
        .max(1);
    let scale = (squares / freedom as f64).max(1.0);
    let count = fitted.free.len();
    let mut normal = slopes.tr_mul(slopes);
    for index in 0..count {
        normal[(index, index)] += 1e-12;
    }
    normal
        .try_inverse()
        .unwrap_or_else(|| DMatrix::from_diagonal_element(count, count, f64::INFINITY))
        * scale
}

fn is_held(fitted: &Fitted, index: usize) -> bool {
    fitted.free[index].is_at_its_limit(&fitted.model)
}

/// As if no bound held the parameter.
pub(crate) fn unbounded_error(fitted: &Fitted, covariance: &DMatrix<f64>, index: usize) -> f64 {
    covariance[(index, index)].max(0.0).sqrt() * fitted.free[index].scale(&fitted.model)
}

/// None where a bound holds the parameter.
fn standard_error(fitted: &Fitted, covariance: &DMatrix<f64>, index: usize) -> Option<f64> {
    (!is_held(fitted, index)).then(|| unbounded_error(fitted, covariance, index))
}

/// The fitted parameters that are known to some part of themselves, or that a bound holds.
pub fn known_errors(fitted: &Fitted, covariance: &DMatrix<f64>) -> BTreeMap<String, Estimate> {
    let estimate = |(index, parameter): (usize, &FreeParameter)| {
        let (value, error) = (
            parameter.value(&fitted.model),
            standard_error(fitted, covariance, index),
        );
        let known = error.is_none_or(|error| error < MEANINGLESS * value.abs())
            || matches!(parameter, FreeParameter::Effect(..));
        let estimate = Estimate {
            value,
            standard_error: error,
            unit: parameter.unit(&fitted.model),
        };
        known.then(|| (parameter.name(&fitted.model), estimate))
    };
    fitted
        .free
        .iter()
        .enumerate()
        .filter_map(estimate)
        .collect()
}

/// Voltage and current alone do not tell R_T, only its product with xi.
fn as_products(
    parameters: BTreeMap<String, Estimate>,
    model: &Model,
) -> BTreeMap<String, Estimate> {
    let xi = model.parameters.resistance_coefficient_per_k;
    let product = |(name, estimate): (String, Estimate)| {
        if name.split('.').next() != Some("R_T") {
            return (name, estimate);
        }
        let product = Estimate {
            value: xi * estimate.value,
            standard_error: estimate.standard_error.map(|error| xi * error),
            unit: "1/W".into(),
        };
        (format!("xi*{name}"), product)
    };
    parameters.into_iter().map(product).collect()
}

fn correlations(fitted: &Fitted, covariance: &DMatrix<f64>) -> Vec<(String, String, f64)> {
    let name = |index: usize| fitted.free[index].name(&fitted.model);
    let mut found = Vec::new();
    for i in 0..fitted.free.len() {
        for j in 0..i {
            let correlation = covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt();
            if correlation.abs() >= STRONG {
                found.push((name(j), name(i), correlation));
            }
        }
    }
    found
}

/// Directions in the space of the physical parameters, fitted or not, that change no prediction.
fn inseparable(model: &Model, data: &Dataset) -> Result<Vec<String>, Runaway> {
    let mut symbols = vec![Symbol::ThermalResistance, Symbol::ResistanceCoefficient];
    if data.has_current() {
        symbols.push(Symbol::ColdResistance);
    }
    if data.has_displacement() {
        symbols.extend([
            Symbol::CurvatureCoefficient,
            Symbol::ExpansionDifference,
            Symbol::Thickness,
            Symbol::DeflectionFactor,
        ]);
    }
    let mut shared = model.clone();
    shared.by_actuator.clear();
    let parameters: Vec<_> = symbols
        .iter()
        .map(|&symbol| FreeParameter::Base(BaseParameter::Shared(symbol)))
        .collect();
    let slopes = jacobian(&shared, data, &parameters)?;
    let eigen = SymmetricEigen::new(slopes.tr_mul(&slopes));
    let best = eigen.eigenvalues.max();
    let mut null = DMatrix::zeros(symbols.len(), symbols.len());
    for (index, value) in eigen.eigenvalues.iter().enumerate() {
        if *value < UNKNOWN * best {
            let direction = eigen.eigenvectors.column(index);
            null += direction * direction.transpose();
        }
    }
    let mut sentences = Vec::new();
    for group in groups(&null) {
        let names: Vec<_> = group
            .iter()
            .map(|&index| symbols[index].to_string())
            .collect();
        let unknown = group
            .iter()
            .map(|&index| null[(index, index)])
            .sum::<f64>()
            .round() as usize;
        let known = group.len().saturating_sub(unknown);
        let names = names.join(", ");
        sentences.push(match known {
            0 => format!("nothing here tells {names}"),
            _ => format!(
                "{names} go into these readings as {known} number{} only: changed together, they leave every reading as it is",
                if known == 1 { "" } else { "s" }
            ),
        });
    }
    if !data.has_displacement() {
        sentences.push(
            "voltage and current alone give only the products xi dT and xi R_T; an oven gives xi"
                .into(),
        );
    }
    if !data.has_current() {
        sentences.push("without currents R0, xi and R_T act through one heating only".into());
    }
    Ok(sentences)
}

/// Parameters that the unknown directions tie together.
fn groups(null: &DMatrix<f64>) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for index in (0..null.nrows()).filter(|&index| null[(index, index)] > TAKES_PART) {
        let tied = |group: &Vec<usize>| {
            group
                .iter()
                .any(|&other| null[(index, other)].abs() > 0.5 * TAKES_PART)
        };
        let (mut mine, others): (Vec<_>, Vec<_>) = groups.into_iter().partition(tied);
        mine.push(vec![index]);
        groups = others;
        groups.push(mine.concat());
    }
    groups
}

/// Gives the model its standard errors; returns the covariance of its parameters' coordinates.
///
/// # Errors
/// [`Runaway`] if the model has no finite answer close by.
pub fn note_errors(fitted: &mut Fitted, data: &Dataset) -> Result<DMatrix<f64>, Runaway> {
    let mut slopes = jacobian(&fitted.model, data, &fitted.free)?;
    // What a bound holds has no covariance, and the others' is what it is while that stays.
    for index in (0..fitted.free.len()).filter(|&index| is_held(fitted, index)) {
        slopes.column_mut(index).fill(0.0);
    }
    let covariance = covariance(&slopes, fitted, data);
    fitted.model.standard_errors.clear();
    for index in 0..fitted.free.len() {
        let error = standard_error(fitted, &covariance, index);
        match fitted.free[index] {
            FreeParameter::Base(free) => {
                let Some(error) = error else { continue };
                let largest = fitted
                    .model
                    .standard_errors
                    .entry(free.symbol())
                    .or_insert(0.0);
                *largest = largest.max(error);
            }
            FreeParameter::Effect(effect, parameter) => {
                fitted.model.effects[effect].standard_errors[parameter] = error
            }
        }
    }
    for (symbol, values) in &fitted.model.by_actuator {
        fitted
            .model
            .parameters
            .set(*symbol, values.iter().sum::<f64>() / values.len() as f64);
    }
    Ok(covariance)
}

impl fmt::Display for FitReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, estimate) in &self.parameters {
            writeln!(f, "{}", estimate.line(name, 18))?;
        }
        for (a, b, correlation) in &self.correlations {
            writeln!(f, "  {a} and {b} go together: correlation {correlation:.3}")?;
        }
        for sentence in &self.inseparable {
            writeln!(f, "  {sentence}")?;
        }
        if let Some(rms) = self.residual_rms_um {
            writeln!(f, "  left of the displacement: {rms:.3} um rms")?;
        }
        if let Some(rms) = self.residual_rms_ma {
            writeln!(f, "  left of the currents: {rms:.4} mA rms")?;
        }
        self.notes
            .iter()
            .try_for_each(|note| writeln!(f, "  {note}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::Channel;
    use crate::fit::fit_parameters;
    use mirror_model::Preset;
    use mirror_model::effect::{Active, find};
    use nalgebra::dmatrix;

    #[test]
    fn a_parameter_that_a_bound_holds_has_no_error_and_widens_no_other() {
        const COLD: FreeParameter =
            FreeParameter::Base(BaseParameter::Shared(Symbol::ColdResistance));
        let mut model = Model::from(Preset::Reconciled);
        let gain = find("sensor-gain").expect("an effect");
        model.effects.push(Active::usual(gain));
        let gain = FreeParameter::Effect(0, 0);
        let (_, high) = gain.bounds(&model);
        let mut data = Dataset::driven([(2.0, 1.0), (3.0, 1.0)]);
        for interval in 0..2 {
            data = data
                .reading(interval, Channel::Displacement, 0.0, 0.02)
                .reading(interval, Channel::Current(0), 0.0, 2e-6);
        }
        // The largest gain that the effect may have.
        gain.set(&mut model, high);
        let values = crate::prediction::predict(&model, &data).expect("an answer");
        let data = data.with_values(&values);
        let errors = |free: &[FreeParameter]| {
            let mut fitted = fit_parameters(&model, &data, &values, free).expect("an answer");
            let covariance = note_errors(&mut fitted, &data).expect("an answer");
            (known_errors(&fitted, &covariance), fitted.model)
        };
        let (both, noted) = errors(&[COLD, gain]);
        let (alone, _) = errors(&[COLD]);
        let held = both.get("sensor-gain.e").expect("told");
        assert_eq!(held.standard_error, None);
        assert_eq!(noted.effects[0].standard_errors[0], None);
        assert!(noted.standard_errors[&Symbol::ColdResistance] > 0.0);
        let (with, without) = (both["R0"].standard_error, alone["R0"].standard_error);
        let ratio = with.expect("known") / without.expect("known");
        // Both reduced chi-squares are below one.
        assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
    }

    #[test]
    fn parameters_that_share_an_unknown_direction_are_one_group() {
        // Directions (1, 1, 0, 0) / sqrt 2 and (0, 0, 0, 1) are unknown.
        let null = dmatrix![
            0.5, 0.5, 0.0, 0.0;
            0.5, 0.5, 0.0, 0.0;
            0.0, 0.0, 0.0, 0.0;
            0.0, 0.0, 0.0, 1.0
        ];
        let mut found = groups(&null);
        found.iter_mut().for_each(|group| group.sort_unstable());
        assert_eq!(found, [vec![0, 1], vec![3]]);
    }

    #[test]
    fn thermal_resistances_become_products_with_xi() {
        let model = Model::from(mirror_model::Preset::Paper);
        let xi = model.parameters.resistance_coefficient_per_k;
        let estimate = |value: f64, unit: &str| Estimate {
            value,
            standard_error: Some(0.1 * value),
            unit: unit.into(),
        };
        let parameters = BTreeMap::from([
            ("R0.1".to_string(), estimate(360.0, "ohm")),
            ("R_T.1".to_string(), estimate(5000.0, "K/W")),
        ]);
        let products = as_products(parameters, &model);
        assert_eq!(products["R0.1"], estimate(360.0, "ohm"));
        assert_eq!(products["xi*R_T.1"].value, xi * 5000.0);
        assert_eq!(products["xi*R_T.1"].standard_error, Some(xi * 500.0));
    }
}
