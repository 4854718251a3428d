//! A smooth curve through points that rise.

/// Part of its range from which a function is continued, twice: a choice.
const LAST: f64 = 0.15;

/// Cubic pieces through points that rise in both coordinates; the curve rises wherever its points do.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    x: Vec<f64>,
    y: Vec<f64>,
    slope: Vec<f64>,
}

impl Curve {
    /// Through these points. Slopes are those of the parabola through a point and its neighbours, held
    /// to what keeps a piece monotone (Fritsch and Carlson 1980).
    ///
    /// # Errors
    /// The index of the first point that does not lie above and to the right of the one before it.
    pub(crate) fn new(x: Vec<f64>, y: Vec<f64>) -> Result<Self, usize> {
        let rises = |v: &[f64], i: usize| v[i] > v[i - 1] && v[i].is_finite();
        if let Some(i) = (1..x.len()).find(|&i| !(rises(&x, i) && rises(&y, i))) {
            return Err(i);
        }
        let last = x.len() - 1;
        let chord = |i: usize| (y[i + 1] - y[i]) / (x[i + 1] - x[i]);
        let parabola = |i: usize| {
            let (left, right) = (x[i] - x[i - 1], x[i + 1] - x[i]);
            (chord(i - 1) * right + chord(i) * left) / (left + right)
        };
        let slope = (0..=last)
            .map(|i| match i {
                _ if last == 1 => chord(0),
                0 => (2.0 * chord(0) - parabola(1)).clamp(0.0, 3.0 * chord(0)),
                _ if i == last => {
                    (2.0 * chord(i - 1) - parabola(i - 1)).clamp(0.0, 3.0 * chord(i - 1))
                }
                _ => parabola(i).min(3.0 * chord(i - 1).min(chord(i))),
            })
            .collect();
        Ok(Self { x, y, slope })
    }

    /// Where its points end.
    pub(crate) fn end(&self) -> f64 {
        self.x[self.x.len() - 1]
    }

    /// Its value; beyond its ends it goes on straight. NaN where `x` is.
    pub(crate) fn at(&self, x: f64) -> f64 {
        let last = self.x.len() - 1;
        if x <= self.x[0] {
            return self.y[0] + self.slope[0] * (x - self.x[0]);
        }
        if x >= self.x[last] {
            return self.y[last] + self.slope[last] * (x - self.x[last]);
        }
        let Some(i) = self.x.partition_point(|knot| *knot <= x).checked_sub(1) else {
            return x;
        };
        let h = self.x[i + 1] - self.x[i];
        let t = (x - self.x[i]) / h;
        let rest = 1.0 - t;
        rest * rest * ((1.0 + 2.0 * t) * self.y[i] + t * h * self.slope[i])
            + t * t * ((1.0 + 2.0 * rest) * self.y[i + 1] - rest * h * self.slope[i + 1])
    }
}

/// What a function does beyond its end, by the parabola through its last part, which its end alone, as noise has it, does not turn.
pub(crate) fn beyond(of: impl Fn(f64) -> f64, end: f64, x: f64) -> f64 {
    if x <= end {
        return of(x);
    }
    let step = LAST * end;
    let [last, before, first] = [0.0, 1.0, 2.0].map(|steps| of(end - steps * step));
    let steps = (x - end) / step;
    // Newton's backward differences.
    last + steps * (last - before) + 0.5 * steps * (steps + 1.0) * (last - 2.0 * before + first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn follows_a_smooth_curve_closely() {
        let x: Vec<f64> = (0..=64).map(|i| f64::from(i) / 64.0).collect();
        let y = x.iter().map(|x| x + 0.3 * x * x).collect();
        let curve = Curve::new(x, y).expect("rising");
        for i in 0..=1000 {
            let x = f64::from(i) / 1000.0;
            // A share of the range: 1e-6 of 174 um are 0.2 nm, a fiftieth of what a table may be off by (docs/requirements.md).
            assert!((curve.at(x) - (x + 0.3 * x * x)).abs() < 1e-6, "{x}");
        }
    }

    /// A fit may try a heater whose loss falls until it runs away.
    #[test]
    fn what_is_no_number_has_no_value() {
        let curve = Curve::new(vec![0.0, 1.0], vec![0.0, 2.0]).expect("rising");
        assert!(curve.at(f64::NAN).is_nan());
    }

    #[test]
    fn names_the_point_that_falls() {
        assert_eq!(
            Curve::new(vec![0.0, 1.0, 2.0], vec![0.0, 2.0, 1.0]).err(),
            Some(2)
        );
        assert_eq!(
            Curve::new(vec![0.0, f64::NAN], vec![0.0, 2.0]).err(),
            Some(1)
        );
    }

    proptest! {
        #[test]
        fn rises_where_its_points_do(
            steps in proptest::collection::vec((0.01..10.0_f64, 0.01..10.0_f64), 2..20),
            a in 0.0..1.0_f64,
            b in 0.0..1.0_f64,
        ) {
            let sum = |part: fn(&(f64, f64)) -> f64| {
                steps.iter().scan(0.0, |at, step| { *at += part(step); Some(*at) }).collect::<Vec<_>>()
            };
            let (x, y) = (sum(|s| s.0), sum(|s| s.1));
            let (first, span) = (x[0], x[x.len() - 1] - x[0]);
            let curve = Curve::new(x, y).expect("rising");
            let at = |part: f64| curve.at(first + part * span);
            prop_assert!(at(a.min(b)) <= at(a.max(b)) + 1e-9);
        }
    }
}
