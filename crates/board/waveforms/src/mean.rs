//! The mean of several quantities over some ticks.

/// Sums `N` quantities until their mean is taken. What was not read in a tick bears no weight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mean<const N: usize> {
    sums: [f32; N],
    counts: [u16; N],
}

impl<const N: usize> Default for Mean<N> {
    fn default() -> Self {
        Self {
            sums: [0.0; N],
            counts: [0; N],
        }
    }
}

impl<const N: usize> Mean<N> {
    /// Adds one tick's values, `None` for those that were not read.
    pub(crate) fn add(&mut self, values: [Option<f32>; N]) {
        for ((sum, count), value) in self.sums.iter_mut().zip(&mut self.counts).zip(values) {
            if let Some(value) = value {
                *sum += value;
                *count = count.saturating_add(1);
            }
        }
    }

    /// The means of what was added since the last ones; `None` where nothing was.
    pub(crate) fn take(&mut self) -> [Option<f32>; N] {
        let Self { sums, counts } = core::mem::take(self);
        core::array::from_fn(|i| (counts[i] > 0).then(|| sums[i] / f32::from(counts[i])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    proptest! {
        #[test]
        fn is_the_mean_of_what_was_read_to_a_nanometre(
            values in proptest::collection::vec(proptest::option::of(-200.0_f32..200.0), 1..1000),
        ) {
            let mut mean = Mean::default();
            values.iter().for_each(|value| mean.add([*value, Some(1.0), None]));
            let read: Vec<f64> = values.iter().flatten().map(|v| f64::from(*v)).collect();
            let [found, one, none] = mean.take();
            prop_assert_eq!(found.is_some(), !read.is_empty());
            if let Some(found) = found {
                let exact = read.iter().sum::<f64>() / read.len() as f64;
                prop_assert!((f64::from(found) - exact).abs() < 1e-3, "{found} for {exact}");
            }
            prop_assert!((one.expect("read") - 1.0).abs() < 1e-6);
            prop_assert_eq!(none, None);
            prop_assert_eq!(mean.take(), [None; 3]);
        }
    }
}
