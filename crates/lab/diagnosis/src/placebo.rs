//! What adding an effect does to mirrors that have nothing to add: some fall of the error is always there.

use crate::candidate::{Direction, scan};
use crate::fit::trust;
use crate::judge::quantile;
use crate::plan::{Plan, rms};
use crate::space::Space;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::Serialize;
use std::fmt;

/// Of mirrors with nothing hidden, this share stays at or below [`Fall::most`].
const MOST: f64 = 0.95;

/// A fall of the error in parts of itself, over mirrors with nothing hidden.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fall {
    /// The median.
    pub median: f64,
    /// What 95 of 100 do not exceed.
    pub most: f64,
}

/// What the same addition does on mirrors with nothing hidden.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Placebo {
    /// Of the displacement's error, where it was measured.
    pub displacement: Option<Fall>,
    /// Of the currents' error, where they were measured.
    pub currents: Option<Fall>,
}

impl fmt::Display for Placebo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [("", self.displacement), ("of the currents ", self.currents)];
        let said: Vec<String> = parts
            .iter()
            .filter_map(|(of, fall)| {
                let Fall { median, most } = (*fall)?;
                let percent = [median, most].map(|part| 100.0 * part);
                Some(format!(
                    "{of}by {:.0} % in the median, {:.0} % at most in 95 of 100",
                    percent[0], percent[1]
                ))
            })
            .collect();
        let said = said.join("; ");
        write!(
            f,
            "on mirrors with nothing hidden the same addition lowers the error {said}"
        )
    }
}

/// Adds an effect, as these directions describe it, to every virtual mirror with nothing hidden, whose residuals these are
/// in units of trust. `space` is one in which the base is free.
pub(crate) fn placebo(
    directions: &[Direction],
    mirrors: &DMatrix<f64>,
    space: &Space,
    plan: &Plan,
) -> Placebo {
    let errors: Vec<[Errors; 2]> = (0..mirrors.ncols())
        .into_par_iter()
        .map(|mirror| {
            let before = space.vector(&mirrors.column(mirror).into_owned());
            let after = match scan(directions, &before, space) {
                Some(best) => &before - &best.change,
                None => before.clone(),
            };
            [before, after].map(|vector| errors(&space.remainder(&vector), plan))
        })
        .collect();
    let fall = |channel: usize| {
        let falls = errors.iter().filter_map(|[before, after]| {
            Some(1.0 - after[channel]? / before[channel]?.max(f64::MIN_POSITIVE))
        });
        let mut falls: Vec<f64> = falls.collect();
        falls.sort_by(f64::total_cmp);
        (!falls.is_empty()).then(|| Fall {
            median: quantile(&falls, 0.5),
            most: quantile(&falls, MOST),
        })
    };
    Placebo {
        displacement: fall(0),
        currents: fall(1),
    }
}

/// Root mean squares of displacement (um) and currents (A), where they were measured.
pub(crate) type Errors = [Option<f64>; 2];

/// From residuals in units of trust.
pub(crate) fn errors(residual: &DVector<f64>, plan: &Plan) -> Errors {
    [true, false].map(|displacement| {
        let rows = residual.iter().zip(&plan.observations);
        rms(rows.map(|(r, o)| (r * trust(o), o)), displacement)
    })
}
