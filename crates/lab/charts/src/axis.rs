//! From numbers to places on a chart, and which of them are written beside it.

use std::ops::Range;

/// Room beside the outermost points, in parts of their range, so that none lies on the frame.
const ROOM: f64 = 0.04;

/// Numbers along one side of a chart.
pub(crate) struct Axis {
    values: Range<f64>,
    /// Where they begin and end in the drawing.
    places: Range<f64>,
}

impl Axis {
    /// An axis that holds these numbers, with a little room. Those that are not finite are left out.
    pub(crate) fn holding(values: impl Iterator<Item = f64>, places: Range<f64>) -> Self {
        let (low, high) = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            });
        let (low, high) = match () {
            () if low < high => (low, high),
            () if low == high => (
                low.min(0.0),
                high.max(0.0) + f64::from(u8::from(low == 0.0)),
            ),
            () => (0.0, 1.0),
        };
        let room = ROOM * (high - low);
        Self {
            values: low - room..high + room,
            places,
        }
    }

    /// Where a number lies.
    pub(crate) fn place(&self, value: f64) -> f64 {
        let part = (value - self.values.start) / (self.values.end - self.values.start);
        self.places.start + part * (self.places.end - self.places.start)
    }

    /// Round numbers on it, with how they are written: five or so, steps of 1, 2 or 5 times a power of ten.
    pub(crate) fn ticks(&self) -> Vec<(f64, String)> {
        const ABOUT: f64 = 5.0;
        let raw = (self.values.end - self.values.start) / ABOUT;
        let power = 10.0_f64.powf(raw.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0]
            .map(|digit| digit * power)
            .into_iter()
            .find(|step| *step >= raw)
            .unwrap_or(10.0 * power);
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        let first = (self.values.start / step).ceil() as i64;
        let last = (self.values.end / step).floor() as i64;
        (first..=last)
            .map(|index| index as f64 * step)
            .map(|value| (value, written(value, decimals)))
            .collect()
    }
}

/// A number with so many decimals, with a true minus sign, and without one before zero.
fn written(value: f64, decimals: usize) -> String {
    let digits = format!("{:.decimals$}", value.abs());
    let is_zero = digits.chars().all(|c| matches!(c, '0' | '.'));
    if value < 0.0 && !is_zero {
        format!("\u{2212}{digits}")
    } else {
        digits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(values: &[f64]) -> Vec<String> {
        let axis = Axis::holding(values.iter().copied(), 0.0..100.0);
        axis.ticks().into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn ticks_are_round_and_zero_has_no_sign() {
        assert_eq!(ticks(&[0.0, 3.5]), ["0", "1", "2", "3"]);
        assert_eq!(ticks(&[-0.3, 0.2]), ["\u{2212}0.2", "0.0", "0.2"]);
        assert_eq!(ticks(&[0.0, 120.0]), ["0", "50", "100"]);
        assert_eq!(ticks(&[1e-3, 2e-3])[0], "0.0010");
    }

    #[test]
    fn one_value_none_and_rubbish_have_an_axis() {
        for values in [
            &[][..],
            &[0.0],
            &[-2.0, -2.0],
            &[7.0],
            &[f64::NAN, f64::INFINITY],
        ] {
            let axis = Axis::holding(values.iter().copied(), 0.0..100.0);
            assert!(axis.ticks().len() >= 2, "{values:?}");
            assert!(axis.place(0.0).is_finite());
        }
    }

    #[test]
    fn places_are_straight_between_the_ends() {
        let axis = Axis::holding([0.0, 1.0].into_iter(), 0.0..108.0);
        let at = [0.0, 0.5, 1.0].map(|value| (axis.place(value) * 1e6).round() / 1e6);
        assert_eq!(at, [4.0, 54.0, 104.0]);
    }
}
