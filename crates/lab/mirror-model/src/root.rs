//! Roots of increasing functions.

/// Where an increasing `f` passes zero between `low` and `high`, to the last bits of f64.
///
/// Chandrupatla's method: inverse quadratic interpolation where three points allow it, bisection where they do not. It
/// needs no derivative and cannot leave the bracket. `f(low) <= 0 <= f(high)` must hold.
pub(crate) fn increasing_root(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut a, mut b) = (high, low);
    let (mut fa, mut fb) = (f(a), f(b));
    let mut step = 0.5;
    for _ in 0..200 {
        let x = a + step * (b - a);
        let fx = f(x);
        let (c, fc);
        if (fx >= 0.0) == (fa >= 0.0) {
            (c, fc) = (a, fa);
        } else {
            (c, fc) = (b, fb);
            (b, fb) = (a, fa);
        }
        (a, fa) = (x, fx);
        let best = if fa.abs() < fb.abs() { a } else { b };
        let tolerance = 2.0 * f64::EPSILON * best.abs() + f64::MIN_POSITIVE;
        let relative = tolerance / (b - a).abs();
        if relative > 0.5 || fa == 0.0 || fb == 0.0 {
            return best;
        }
        let xi = (a - b) / (c - b);
        let phi = (fa - fb) / (fc - fb);
        let interpolates = phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi;
        step = if interpolates {
            fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        } else {
            0.5
        }
        .clamp(relative, 1.0 - relative);
    }
    if fa.abs() < fb.abs() { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn ends_of_the_bracket_are_roots_too() {
        assert_eq!(increasing_root(0.0, 1.0, |x| x), 0.0);
        assert_eq!(increasing_root(0.0, 1.0, |x| x - 1.0), 1.0);
    }

    proptest! {
        #[test]
        fn finds_the_root_of_a_steep_or_flat_curve(root in 0.0..100.0_f64, steepness in 0.1..9.0_f64) {
            let f = |x: f64| x.powf(steepness) - root.powf(steepness);
            let found = increasing_root(0.0, 101.0, f);
            prop_assert!((found - root).abs() <= 1e-9 * (1.0 + root), "{found} for {root}");
        }
    }
}
