//! A box that parameters stay in.

use nalgebra::DVector;

/// The lowest and the highest value of every parameter; infinite where there is none, equal where a parameter is fixed.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    low: DVector<f64>,
    high: DVector<f64>,
}

impl Bounds {
    /// A box from one `(low, high)` a parameter.
    ///
    /// # Panics
    /// If a bound is not a number, or a low one is above its high one.
    pub fn new(ranges: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (low, high): (Vec<_>, Vec<_>) = ranges.into_iter().unzip();
        let ordered = low.iter().zip(&high).all(|(low, high)| low <= high);
        assert!(
            ordered,
            "a low bound is above its high one: {low:?} {high:?}"
        );
        Self {
            low: DVector::from_vec(low),
            high: DVector::from_vec(high),
        }
    }

    /// No bounds on so many parameters.
    pub fn none(count: usize) -> Self {
        Self::new(vec![(f64::NEG_INFINITY, f64::INFINITY); count])
    }

    /// How many parameters there are.
    pub fn len(&self) -> usize {
        self.low.len()
    }

    /// Whether there are no parameters.
    pub fn is_empty(&self) -> bool {
        self.low.is_empty()
    }

    /// The lowest value of a parameter.
    pub fn low(&self, index: usize) -> f64 {
        self.low[index]
    }

    /// The highest value of a parameter.
    pub fn high(&self, index: usize) -> f64 {
        self.high[index]
    }

    /// The closest point of the box.
    pub fn clamp(&self, point: &DVector<f64>) -> DVector<f64> {
        DVector::from_fn(point.len(), |i, _| {
            point[i].clamp(self.low[i], self.high[i])
        })
    }

    /// The steps from a point of the box, each at most `longest`, that stay in it.
    pub(crate) fn steps_from(&self, point: &DVector<f64>, longest: f64) -> Self {
        Self::new((0..self.len()).map(|i| {
            (
                (self.low[i] - point[i]).clamp(-longest, 0.0),
                (self.high[i] - point[i]).clamp(0.0, longest),
            )
        }))
    }

    /// Whether a point of the box is at the end of a parameter's range that a descent along `-gradient` would cross.
    pub(crate) fn blocks(
        &self,
        point: &DVector<f64>,
        gradient: &DVector<f64>,
        index: usize,
    ) -> bool {
        let at_low = point[index] <= self.low[index] && gradient[index] >= 0.0;
        let at_high = point[index] >= self.high[index] && gradient[index] <= 0.0;
        at_low || at_high
    }
}
