//! The last digit that readings were written or converted with.

/// The least difference between two readings that differ; 0 where none do.
pub(crate) fn last_digit(readings: impl Iterator<Item = f64>) -> f64 {
    let mut readings: Vec<f64> = readings.collect();
    readings.sort_by(f64::total_cmp);
    readings
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .filter(|apart| *apart > 0.0)
        .reduce(f64::min)
        .unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::last_digit;

    #[test]
    fn the_digit_is_the_least_step_between_readings() {
        assert_eq!(last_digit([2.0, 0.5, 0.5, 1.25].into_iter()), 0.75);
        assert_eq!(last_digit([3.0, 3.0].into_iter()), 0.0);
        assert_eq!(last_digit(std::iter::empty()), 0.0);
    }
}
