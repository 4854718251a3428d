//! Shape and memory, forward and linear in what is sought: a bend of the tables' curve, the weights of play operators of
//! fixed radii, the weights of creep of fixed time constants.

use control_core::calibration::{LAGS, Lag, Memory, PLAYS, Play};
use control_core::{Micrometre, Second};
use nalgebra::{Cholesky, DMatrix, DVector};

use super::course::Moment;
use super::heat::Share;

/// Terms of the bend: what a table's curve is off is smooth.
const BENDS: usize = 11;
/// Radii of the play operators as shares of the range.
const RADII: [f64; PLAYS] = [0.012, 0.03, 0.06, 0.12];
/// Time constants of the creep (s).
const CREEP_S: [f64; LAGS] = [0.3, 1.5, 7.0, 35.0];
const TERMS: usize = BENDS + PLAYS + LAGS;
/// How large the terms are before anything has been measured, one standard deviation: a bend as a share of the range, a
/// weight. What the data do not determine stays small.
const BEND: f64 = 0.05;
const WEIGHT: f64 = 0.02;

/// The linear part of the stages.
#[derive(Clone, Debug)]
pub(super) struct Linear {
    top_um: f64,
    terms: [f64; TERMS],
}

/// The mirror's displacements: before memory, and behind its plays.
pub(super) struct Displaced {
    pub(super) x_um: Vec<f64>,
    y_um: Vec<f64>,
}

impl Displaced {
    /// Without any memory, at these places of the tables.
    pub(super) fn without_memory(places_um: &[f64]) -> Self {
        Self {
            x_um: places_um.to_vec(),
            y_um: places_um.to_vec(),
        }
    }
}

/// What every term adds at every moment, given roughly where the mirror was.
pub(super) struct Memories(Vec<[f64; PLAYS + LAGS]>);

impl Memories {
    pub(super) fn new(
        moments: &[Moment],
        top_um: f64,
        release_s: f64,
        roughly: &Displaced,
    ) -> Self {
        let mut plays = [0.0_f64; PLAYS];
        let mut lags = [0.0; LAGS];
        let mut y_before = 0.0;
        let inputs = moments.iter().zip(roughly.x_um.iter().zip(&roughly.y_um));
        let rows = inputs.map(|(moment, (&x, &y))| {
            let mut row = [0.0; PLAYS + LAGS];
            let keeps = (-moment.step_s / release_s).exp();
            for (k, at) in plays.iter_mut().enumerate() {
                let radius = RADII[k] * top_um;
                *at = (x + (*at - x) * keeps).max(x - radius).min(x + radius);
                row[k] = *at - x;
            }
            for (k, at) in lags.iter_mut().enumerate() {
                if moment.step_s > 0.0 {
                    *at = Share::new(CREEP_S[k], moment.step_s).after(*at, y_before, y);
                }
                row[PLAYS + k] = *at;
            }
            y_before = y;
            row
        });
        Self(rows.collect())
    }
}

/// The bend's terms at a place: each is 0 at rest.
fn bends(share: f64) -> [f64; BENDS] {
    let s = 2.0 * share - 1.0;
    let (mut before, mut now) = (1.0, s);
    std::array::from_fn(|k| {
        let chebyshev = if k == 0 { 1.0 } else { now };
        if k > 0 {
            (before, now) = (now, 2.0 * s * now - before);
        }
        share * chebyshev
    })
}

impl Linear {
    /// The terms that follow what was seen best; `None` where nothing was seen. Plays and creep hold back and go on, never the other
    /// way: a creep that went back would be heat, which the poles are for.
    pub(super) fn fit(
        moments: &[Moment],
        top_um: f64,
        places_um: &[f64],
        memories: &Memories,
    ) -> Option<Self> {
        let mut normal = DMatrix::<f64>::zeros(TERMS, TERMS);
        let mut right = DVector::<f64>::zeros(TERMS);
        for ((moment, &place), row) in moments.iter().zip(places_um).zip(&memories.0) {
            let Some((z, trust)) = moment.seen_um else {
                continue;
            };
            let terms = Self::row(top_um, place, row);
            let left = (z - place) / trust;
            for i in 0..TERMS {
                let a = terms[i] / trust;
                right[i] += a * left;
                for j in 0..=i {
                    normal[(i, j)] += a * terms[j] / trust;
                }
            }
        }
        for i in 0..TERMS {
            let size = if i < BENDS { BEND } else { WEIGHT };
            normal[(i, i)] += size.powi(-2);
            for j in 0..i {
                normal[(j, i)] = normal[(i, j)];
            }
        }
        let mut out = [false; TERMS];
        loop {
            let terms = solve(&normal, &right, &out)?;
            let least = (BENDS..TERMS).min_by(|&a, &b| terms[a].total_cmp(&terms[b]))?;
            if terms[least] >= 0.0 {
                return Some(Self { top_um, terms });
            }
            out[least] = true;
        }
    }

    fn row(top_um: f64, place_um: f64, memory: &[f64; PLAYS + LAGS]) -> [f64; TERMS] {
        let bends = bends(place_um / top_um);
        std::array::from_fn(|k| {
            if k < BENDS {
                top_um * bends[k]
            } else {
                memory[k - BENDS]
            }
        })
    }

    /// Where the mirror would be, moment by moment.
    pub(super) fn predict<'a>(
        &'a self,
        places_um: &'a [f64],
        memories: &'a Memories,
    ) -> impl Iterator<Item = f64> + 'a {
        places_um.iter().zip(&memories.0).map(|(&place, row)| {
            let terms = Self::row(self.top_um, place, row);
            place
                + terms
                    .iter()
                    .zip(&self.terms)
                    .map(|(a, b)| a * b)
                    .sum::<f64>()
        })
    }

    /// The displacement that the shape gives at a place of the tables.
    pub(super) fn bent(&self, place_um: f64) -> f64 {
        let bends = bends(place_um / self.top_um);
        let bend: f64 = bends.iter().zip(&self.terms).map(|(a, b)| a * b).sum();
        place_um + self.top_um * bend
    }

    pub(super) fn displaced(&self, places_um: &[f64], memories: &Memories) -> Displaced {
        let x_um: Vec<f64> = places_um.iter().map(|place| self.bent(*place)).collect();
        let weights = &self.terms[BENDS..BENDS + PLAYS];
        let y_um = x_um
            .iter()
            .zip(&memories.0)
            .map(|(x, row)| x + weights.iter().zip(row).map(|(w, r)| w * r).sum::<f64>())
            .collect();
        Displaced { x_um, y_um }
    }

    pub(super) fn memory(&self, release_s: f64) -> Memory {
        let weight = |k: usize| self.terms[BENDS + k] as f32;
        Memory {
            plays: std::array::from_fn(|k| Play {
                weight: weight(k),
                radius: Micrometre((RADII[k] * self.top_um) as f32),
            }),
            release: Second(release_s as f32),
            creep: std::array::from_fn(|k| Lag {
                weight: weight(PLAYS + k),
                time: Second(CREEP_S[k] as f32),
            }),
        }
    }
}

/// The normal equations without the terms that are out, which are 0.
fn solve(normal: &DMatrix<f64>, right: &DVector<f64>, out: &[bool; TERMS]) -> Option<[f64; TERMS]> {
    let (mut normal, mut right) = (normal.clone(), right.clone());
    for k in (0..TERMS).filter(|&k| out[k]) {
        normal.row_mut(k).fill(0.0);
        normal.column_mut(k).fill(0.0);
        normal[(k, k)] = 1.0;
        right[k] = 0.0;
    }
    let solution = Cholesky::new(normal)?.solve(&right);
    Some(std::array::from_fn(|k| solution[k]))
}
