//! What the forms of the effects that a model has may be off by: nature's are hardly the model's, and what a strong effect's form leaves is
//! no second effect.
//!
//! An effect's change of the readings may be greater or smaller by a smooth function of how far the mirror is driven, of time, and
//! from one actuator to the next, and a part of it may be of another of the effect's forms: a discrepancy of its own, proportional to the
//! change [M. Kennedy and A. O'Hagan, J. R. Stat. Soc. B 63 (2001) 425-464, section 4].

use crate::candidate::{Operating, from_all_starts};
use identification::dataset::{Channel, Dataset, Observation};
use identification::prediction::{predict, standardised};
use mirror_model::effect::{Active, find, forms};
use mirror_model::{ACTUATORS, Model, Runaway};
use nalgebra::{DMatrix, DVector};

/// Prior standard deviation of each term of that function, in parts of the change. Set by the second rounds of `cargo xtask bench
/// diagnose -- --only two`.
const FORM_ERROR: f64 = 0.3;

/// What the forms of a model's effects may be off by: standardised, each column by one standard deviation. `base` are the model's predictions
/// (um, A). Nothing is told of an effect without which the model runs away.
pub(super) fn form_errors(model: &Model, data: &Dataset, base: &[f64]) -> DMatrix<f64> {
    let terms = terms(data, base);
    let mut columns = Vec::new();
    for effect in 0..model.effects.len() {
        let Ok(change) = change_of(model, effect, data, base) else {
            continue;
        };
        columns.extend(
            terms
                .iter()
                .map(|term| change.component_mul(term) * FORM_ERROR),
        );
        let of_others = in_other_forms(&model.effects[effect], Operating { model, data, base });
        let as_large = |other: DVector<f64>| {
            let size = other.norm();
            (size > 0.0).then(|| other * (FORM_ERROR * change.norm() / size))
        };
        columns.extend(of_others.into_iter().filter_map(as_large));
    }
    match &columns[..] {
        [] => DMatrix::zeros(base.len(), 0),
        columns => DMatrix::from_columns(columns),
    }
}

/// What an effect that the model has would change in its other forms, from each start of theirs; without those with which the model runs away.
fn in_other_forms(present: &Active, at: Operating) -> Vec<DVector<f64>> {
    let Some(listed) = find(present.id()) else {
        return Vec::new();
    };
    let mut others = forms(&listed);
    others.retain(|form| form.form() != present.effect.form());
    let starts = others.iter().flat_map(|form| from_all_starts(form, None));
    let others: Vec<Active> = starts.collect();
    parallel::filter_map(&others, |other| at.change(other).ok())
}

/// What an effect that the model has changes in its predictions, standardised.
///
/// # Errors
/// [`Runaway`] if the model has no finite answer without it.
fn change_of(
    model: &Model,
    effect: usize,
    data: &Dataset,
    base: &[f64],
) -> Result<DVector<f64>, Runaway> {
    let mut without = model.clone();
    without.effects.remove(effect);
    let predicted = predict(&without, data)?;
    let change = base
        .iter()
        .zip(predicted)
        .map(|(with, without)| with - without);
    Ok(standardised(change, data))
}

/// The terms of a smooth function, one value a reading: Legendre polynomials of how far the mirror is driven, time, and each actuator's
/// share of the drive's square. All lie between -1 and 1.
fn terms(data: &Dataset, base: &[f64]) -> Vec<DVector<f64>> {
    let rows: Vec<_> = data.observations.iter().zip(base).collect();
    let of = |term: &dyn Fn(&Observation, f64) -> f64| {
        DVector::from_iterator(rows.len(), rows.iter().map(|(o, base)| term(o, **base)))
    };
    let strongest = |o: &Observation| data.drive(o).into_iter().fold(0.0, f64::max);
    let highest_v = data.observations.iter().map(strongest).fold(0.0, f64::max);
    let displacements = rows
        .iter()
        .filter(|(o, _)| o.channel == Channel::Displacement);
    let furthest_um = displacements
        .map(|(_, base)| base.abs())
        .fold(0.0, f64::max);
    let driven = of(&|o, base| match o.channel {
        Channel::Displacement => about_zero(base.abs(), furthest_um),
        Channel::Current(_) => about_zero(strongest(o), highest_v),
    });
    let ends_s: Vec<f64> = data.ends_s().collect();
    let time = of(&|o, _| about_zero(ends_s[o.interval], data.lasts_s()));
    let squared = driven.map(|x| (3.0 * x * x - 1.0) / 2.0);
    let cubed = driven.map(|x| (5.0 * x.powi(3) - 3.0 * x) / 2.0);
    let share = |actuator: usize| {
        of(&|o, _| {
            let squares = data.drive(o).map(|v| v * v);
            part(squares[actuator], squares.iter().sum())
        })
    };
    let shares = (0..ACTUATORS).map(share);
    [driven, squared, cubed, time]
        .into_iter()
        .chain(shares)
        .collect()
}

/// From -1 at nothing to 1 at the most.
fn about_zero(value: f64, most: f64) -> f64 {
    2.0 * part(value, most) - 1.0
}

/// A part of a whole, none of nothing.
fn part(value: f64, whole: f64) -> f64 {
    if whole > 0.0 { value / whole } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_model::Preset;
    use mirror_model::effect::{Active, find};

    /// Two actuators' single drives and all four together, displacement and one current each.
    fn data() -> Dataset {
        Dataset::driven([(2.0, 1.0), (4.0, 1.0)])
            .reading(0, Channel::Displacement, 30.0, 0.02)
            .reading(0, Channel::Current(0), 5e-3, 1e-6)
            .reading(1, Channel::Displacement, 120.0, 0.02)
    }

    #[test]
    fn a_model_without_effects_has_no_form_to_err_in() {
        let model = Model::from(Preset::Paper);
        let base = predict(&model, &data()).unwrap();
        assert_eq!(form_errors(&model, &data(), &base).shape(), (3, 0));
    }

    #[test]
    fn what_a_form_is_off_by_is_a_part_of_what_the_effect_changes() {
        let mut model = Model::from(Preset::Paper);
        model
            .effects
            .push(Active::usual(find("sensor-gain").unwrap()));
        let base = predict(&model, &data()).unwrap();
        let change = change_of(&model, 0, &data(), &base).unwrap();
        let columns = form_errors(&model, &data(), &base);
        for column in columns.column_iter() {
            for (off, change) in column.iter().zip(&change) {
                // Legendre polynomials lie within 1 between -1 and 1.
                assert!(off.abs() <= FORM_ERROR * change.abs() * (1.0 + 1e-12));
            }
        }
        // A sensor's gain changes no current.
        assert_eq!(change[1], 0.0);
        // At the furthest reading every polynomial is 1, and four that are driven alike share it in quarters.
        let furthest: Vec<f64> = columns.row(2).iter().map(|off| off / change[2]).collect();
        let quarter = 0.25 * FORM_ERROR;
        let expected = [
            FORM_ERROR, FORM_ERROR, FORM_ERROR, FORM_ERROR, quarter, quarter, quarter, quarter,
        ];
        for (off, expected) in furthest.iter().zip(expected) {
            assert!((off - expected).abs() < 1e-12, "{furthest:?}");
        }
    }
}
