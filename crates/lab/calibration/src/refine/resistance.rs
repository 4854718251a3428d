//! The stage `resistance`, from what the currents show.
//!
//! The core corrects its resistance by what it senses, but only after a while; a line that is right from the start leaves
//! little to correct on the way.

use super::timeline::SensedResistance;

/// An actuator's resistance over its temperature rise: a straight line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    pub(super) cold_ohm: f64,
    pub(super) ohm_per_k: f64,
}

impl Line {
    /// Weighted least squares through readings, each at its temperature rise (K); `None` where they do not show a resistance
    /// that grows with temperature.
    ///
    /// The current's noise is white, so a resistance read at V has a standard deviation in proportion to 1/V, and the weight
    /// V^2.
    pub(super) fn through(readings: impl Iterator<Item = (f64, SensedResistance)>) -> Option<Self> {
        let (mut w, mut x, mut y, mut xx, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (rise, SensedResistance { ohm, volts }) in readings {
            let weight = volts * volts;
            w += weight;
            x += weight * rise;
            y += weight * ohm;
            xx += weight * rise * rise;
            xy += weight * rise * ohm;
        }
        let ohm_per_k = (w * xy - x * y) / (w * xx - x * x);
        let line = Self {
            cold_ohm: (y - ohm_per_k * x) / w,
            ohm_per_k,
        };
        (line.cold_ohm > 0.0 && line.ohm_per_k > 0.0 && line.ohm_per_k.is_finite()).then_some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn through(readings: &[(f64, f64, f64)]) -> Option<Line> {
        let readings = readings.iter();
        Line::through(readings.map(|&(rise, ohm, volts)| (rise, SensedResistance { ohm, volts })))
    }

    #[test]
    fn points_on_a_line_give_it_and_heavier_points_count_more() {
        let exact = through(&[(0.0, 350.0, 1.0), (50.0, 420.0, 2.0), (100.0, 490.0, 3.0)]).unwrap();
        assert!((exact.cold_ohm - 350.0).abs() < 1e-9);
        assert!((exact.ohm_per_k - 1.4).abs() < 1e-12);
        // Two readings at 0 K with weights 1 and 4: their mean is 350 + 10 * 4 / 5.
        let weighted = through(&[(0.0, 350.0, 1.0), (0.0, 360.0, 2.0), (100.0, 498.0, 1.0)]);
        assert!((weighted.unwrap().cold_ohm - 358.0).abs() < 1e-9);
    }

    #[test]
    fn what_does_not_grow_with_temperature_is_no_heater() {
        assert_eq!(through(&[(0.0, 350.0, 1.0), (50.0, 340.0, 1.0)]), None);
        assert_eq!(through(&[(20.0, 350.0, 1.0), (20.0, 351.0, 1.0)]), None);
        assert_eq!(through(&[]), None);
    }
}
