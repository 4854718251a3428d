//! Quantiles of samples.

/// What is so many standard errors away from zero is told from it: 95 % of a normal distribution.
pub(crate) const TOLD: f64 = 2.0;

/// The value that this share of sorted values stays below: linear between the order statistics, definition 7 of R. Hyndman and
/// Y. Fan, "Sample quantiles in statistical packages", Am. Stat. 50 (1996) 361-365.
///
/// # Panics
/// Where there are no values.
pub(crate) fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = share * (sorted.len() - 1) as f64;
    let (below, part) = (at.floor() as usize, at.fract());
    sorted[below] + part * (sorted[(below + 1).min(sorted.len() - 1)] - sorted[below])
}

/// The values in ascending order.
pub(crate) fn sorted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values
}

/// The part of normal numbers that is less than so many standard deviations above their mean.
pub(crate) fn below(deviations: f64) -> f64 {
    0.5 * libm::erfc(-deviations * std::f64::consts::FRAC_1_SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_are_below() {
        for (deviations, part) in [(0.0, 0.5), (1.644_853_627, 0.95), (-1.0, 0.158_655_254)] {
            assert!((below(deviations) - part).abs() < 1e-9, "{deviations}");
        }
    }

    #[test]
    fn quantiles_are_those_of_definition_7() {
        // R: quantile(c(4, 1, 3, 2), c(0, 0.25, 0.5, 0.95, 1), type = 7).
        let values = sorted([4.0, 1.0, 3.0, 2.0]);
        for (share, value) in [
            (0.0, 1.0),
            (0.25, 1.75),
            (0.5, 2.5),
            (0.95, 3.85),
            (1.0, 4.0),
        ] {
            assert!((quantile(&values, share) - value).abs() < 1e-12, "{share}");
        }
        assert_eq!(quantile(&[7.0], 0.95), 7.0);
    }
}
