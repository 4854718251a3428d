//! Where a lag would be that followed what others followed: between those of about its time.

use libm::logf;

/// A place between two lags, on a logarithmic scale of their times.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Between {
    slower: usize,
    quicker: usize,
    /// Part of the way from the slower one to the quicker.
    part: f32,
}

impl Between {
    /// The nearest slower and the nearest quicker of several lags, by their rates; twice the same where there is none on one side. One whose rate
    /// is no number is passed over.
    pub(crate) fn of_rate<const N: usize>(rate: f32, among: &[f32; N]) -> Self {
        let (mut slower, mut quicker) = (None, None);
        for (i, other) in among.iter().copied().enumerate() {
            if other <= rate && slower.is_none_or(|(_, best)| other > best) {
                slower = Some((i, other));
            }
            if other >= rate && quicker.is_none_or(|(_, best)| other < best) {
                quicker = Some((i, other));
            }
        }
        let (slow, quick) = (slower.or(quicker), quicker.or(slower));
        let (Some((slower, slow)), Some((quicker, quick))) = (slow, quick) else {
            return Self::default();
        };
        let part = match quick > slow && slow > 0.0 {
            true => logf(rate / slow) / logf(quick / slow),
            false => 0.0,
        };
        Self {
            slower,
            quicker,
            part,
        }
    }

    /// Where a lag there would be, if the others are here.
    pub(crate) fn among<const N: usize>(&self, values: &[f32; N]) -> f32 {
        let [slower, quicker] = [self.slower, self.quicker].map(|lag| values[lag % N]);
        slower + self.part * (quicker - slower)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_as_far_as_its_time_on_a_logarithmic_scale() {
        let rates = [1e-2, 1e-4, f32::NAN, 1.0];
        let at = |rate| Between::of_rate(rate, &rates).among(&[20.0, 40.0, 7.0, 0.0]);
        let found = [1e-2, 1e-3, 1e-4, 1e-5, 0.1, 1.0].map(at);
        let expected = [20.0, 30.0, 40.0, 40.0, 10.0, 0.0];
        for (found, expected) in found.into_iter().zip(expected) {
            // Two logarithms of f32, of 40.
            assert!((found - expected).abs() < 1e-4, "{found} for {expected}");
        }
    }
}
