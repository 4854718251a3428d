//! How far single members of the ensemble may span the discrepancy.

use nalgebra::DMatrix;

/// No member of the ensemble spans further than so many times the median one: a single mirror that the base fits badly would
/// otherwise explain whatever it shows. Set by `cargo xtask bench diagnose`.
const OUTLIER: f64 = 2.0;

/// The share of its own size by which each residual spans the discrepancy.
pub(super) fn reach(gram: &DMatrix<f64>) -> Vec<f64> {
    let sizes: Vec<f64> = gram.diagonal().iter().map(|square| square.sqrt()).collect();
    let mut sorted = sizes.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let most = |size: f64| (OUTLIER * median / size).min(1.0);
    sizes.into_iter().map(most).collect()
}
