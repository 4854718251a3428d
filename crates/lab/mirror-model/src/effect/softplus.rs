//! A corner that is rounded.

/// ln(1 + exp(x)), without its overflow: 0 far below 0, and x far above.
pub(super) fn softplus(x: f64) -> f64 {
    x.max(0.0) + (-x.abs()).exp().ln_1p()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_nothing_far_below_and_itself_far_above() {
        assert!(softplus(-50.0) < 1e-20);
        assert_eq!([softplus(1e9), softplus(0.0)], [1e9, 2.0f64.ln()]);
    }
}
