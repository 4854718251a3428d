//! Numbers as they are told: three digits, with their unit.

/// A size with its unit; parts of a whole in percent.
pub(super) fn size(value: f64, unit: &str) -> String {
    if unit == "1" {
        format!("{} %", digits(100.0 * value))
    } else {
        format!("{} {unit}", digits(value))
    }
}

/// Three digits, without an exponent where that is readable.
pub(crate) fn digits(value: f64) -> String {
    let magnitude = value.abs().log10().floor();
    if value == 0.0 {
        "0".into()
    } else if (-4.0..5.0).contains(&magnitude) {
        let decimals = (2.0 - magnitude).max(0.0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.2e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let said: Vec<_> = [0.0, 0.012345, -1.5, 123.456, 99999.0, 1e-7]
            .map(digits)
            .into();
        assert_eq!(said, ["0", "0.0123", "-1.50", "123", "99999", "1.00e-7"]);
    }
}
