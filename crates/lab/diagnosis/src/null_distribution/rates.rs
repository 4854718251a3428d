//! How sure a name must be.

/// The share of mirrors that lack nothing which stays without a named effect, whichever effect is tried: a family-wise error
/// rate of 5 %.
pub(crate) const CONFIDENCE: f64 = 0.95;
/// No score below this is evidence, however small the null scores are: a real mirror comes from no family. Five standard
/// deviations.
pub(crate) const FLOOR: f64 = 25.0;
/// A quantile of some hundreds of scores is known to a standard deviation or so: an amplitude, the root of a score, must
/// exceed it by the one-sided 95 % quantile of a normal distribution.
pub(crate) const MARGIN: f64 = 1.64;
