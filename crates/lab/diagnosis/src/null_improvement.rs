//! The null distribution of the improvement: what adding an effect does to the errors of mirrors that lack nothing. Some fall
//! of an error is always there.

use crate::candidate::{Direction, Scan};
use crate::quantile::{quantile, sorted};
use crate::residual_space::{BaseOnly, ResidualSpace};
use identification::dataset::{Dataset, rms};
use identification::prediction::standard_deviation;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use std::fmt;

/// The share of mirrors that lack nothing which stays at or below [`Fall::most`].
const MOST: f64 = 0.95;

/// A fall of the error in parts of itself, over mirrors that lack nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fall {
    /// The median.
    pub median: f64,
    /// What 95 of 100 do not exceed.
    pub most: f64,
}

/// By how much an addition lowers the errors of mirrors that lack nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NullImprovement {
    /// Of the displacement's error, where it was measured.
    pub displacement: Option<Fall>,
    /// Of the currents' error, where they were measured.
    pub currents: Option<Fall>,
}

impl fmt::Display for NullImprovement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [("", self.displacement), ("of the currents ", self.currents)];
        let said: Vec<String> = parts
            .iter()
            .filter_map(|(of, fall)| {
                let Fall { median, most } = (*fall)?;
                // A rise that is too small to be told has no sign.
                let percent = [median, most].map(|part| (100.0 * part).round() + 0.0);
                Some(format!(
                    "{of}by {} % in the median, {} % at most in 95 of 100",
                    percent[0], percent[1]
                ))
            })
            .collect();
        let said = said.join("; ");
        write!(
            f,
            "in the null ensemble (mirrors that lack nothing) the same addition lowers the error {said}"
        )
    }
}

/// Adds an effect, as these directions describe it, to every mirror of a null ensemble with these standardised residuals.
/// `space` is the session's.
pub(crate) fn null_improvement(
    directions: &[Direction<BaseOnly>],
    ensemble: &DMatrix<f64>,
    space: &ResidualSpace<BaseOnly>,
    data: &Dataset,
) -> NullImprovement {
    let scan = Scan::new(directions);
    let errors: Vec<[Errors; 2]> = parallel::map(0..ensemble.ncols(), |mirror| {
        let before = space.vector(&ensemble.column(mirror).into_owned());
        let after = match scan.explanation(&before) {
            Some(best) => &before - &best.change,
            None => before.clone(),
        };
        [before, after].map(|vector| Errors::of(&space.remainder(&vector), data))
    });
    let fall = |of: fn(&Errors) -> Option<f64>| {
        let falls = sorted(errors.iter().filter_map(|[before, after]| {
            Some(1.0 - of(after)? / of(before)?.max(f64::MIN_POSITIVE))
        }));
        (!falls.is_empty()).then(|| Fall {
            median: quantile(&falls, 0.5),
            most: quantile(&falls, MOST),
        })
    };
    NullImprovement {
        displacement: fall(|errors| errors.displacement_um),
        currents: fall(|errors| errors.currents_a),
    }
}

/// Root mean squares, where there is anything of the kind.
struct Errors {
    displacement_um: Option<f64>,
    currents_a: Option<f64>,
}

impl Errors {
    /// Of a standardised residual.
    fn of(residual: &DVector<f64>, data: &Dataset) -> Self {
        let over = |displacement| {
            let rows = residual.iter().zip(&data.observations);
            rms(
                rows.map(|(r, o)| (r * standard_deviation(o), o)),
                displacement,
            )
        };
        Self {
            displacement_um: over(true),
            currents_a: over(false),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use identification::dataset::Channel;
    use mirror_model::effect::{Active, find};

    /// Four displacements, each as uncertain.
    fn data() -> Dataset {
        Dataset::driven([(1.0, 1.0); 4]).read_at_each(&[(Channel::Displacement, 0.02)])
    }

    #[test]
    fn an_addition_lowers_an_error_by_what_lies_along_it() {
        // The base is free along the first reading, the effect along the second. A mirror that is off there alone falls to 0, one
        // that is off there and in the third reading alike by 1 - sqrt(1/2), and one that is off in the third not at all.
        let unit = |row: usize| DVector::from_fn(4, |r, _| f64::from(u8::from(r == row)));
        let space = ResidualSpace::of_base(&DMatrix::from_columns(&[unit(0)]));
        let direction = Direction {
            active: Active::usual(find("sensor-offset").unwrap()),
            change: space.vector(&unit(1)),
        };
        let strength = 0.5;
        let ensemble = DMatrix::from_columns(&[
            unit(1) * strength,
            (unit(1) + unit(2)) * strength,
            unit(2) * strength,
        ]);
        let found = null_improvement(&[direction], &ensemble, &space, &data());
        let fall = found.displacement.unwrap();
        // The ridge leaves 1e-9 of what the base takes up.
        assert!(
            (fall.median - (1.0 - 0.5_f64.sqrt())).abs() < 1e-6,
            "{fall:?}"
        );
        // The 95 % quantile lies nine tenths of the way from the median to the largest.
        assert!(
            (fall.most - (0.1 * fall.median + 0.9)).abs() < 1e-3,
            "{fall:?}"
        );
        assert_eq!(found.currents, None);
    }

    #[test]
    fn what_rounds_to_zero_has_no_sign() {
        let fall = Fall {
            median: -0.001,
            most: 0.004,
        };
        let told = NullImprovement {
            displacement: Some(fall),
            currents: None,
        };
        let told = told.to_string();
        assert!(
            told.ends_with("by 0 % in the median, 0 % at most in 95 of 100"),
            "{told}"
        );
    }
}
