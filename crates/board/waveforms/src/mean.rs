//! The mean of several quantities over some ticks.

/// Sums `N` quantities until their mean is taken.
#[derive(Clone, Copy, Debug)]
pub struct Mean<const N: usize> {
    sums: [f32; N],
    count: u16,
}

impl<const N: usize> Default for Mean<N> {
    fn default() -> Self {
        Self {
            sums: [0.0; N],
            count: 0,
        }
    }
}

impl<const N: usize> Mean<N> {
    /// Adds one tick's values.
    pub fn add(&mut self, values: [f32; N]) {
        for (sum, value) in self.sums.iter_mut().zip(values) {
            *sum += value;
        }
        self.count = self.count.saturating_add(1);
    }

    /// The mean of what was added since the last one; 0 where nothing was.
    pub fn take(&mut self) -> [f32; N] {
        let share = 1.0 / f32::from(self.count.max(1));
        core::mem::take(self).sums.map(|sum| sum * share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn is_the_mean_to_a_nanometre(
            values in proptest::collection::vec(-200.0_f32..200.0, 1..1000),
        ) {
            let mut mean = Mean::default();
            values.iter().for_each(|value| mean.add([*value, 1.0]));
            let exact = values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64;
            let [found, one] = mean.take();
            prop_assert!((f64::from(found) - exact).abs() < 1e-3, "{found} for {exact}");
            prop_assert!((one - 1.0).abs() < 1e-6);
            prop_assert_eq!(mean.take(), [0.0; 2]);
        }
    }
}
