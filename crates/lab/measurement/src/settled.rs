//! Settled readings, many at each drive: their means, and the noise of those.

use crate::keys::CurrentNoise;
use crate::{Keys, Row};

/// Means of settled readings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settled {
    /// One row a drive.
    pub rows: Vec<Row>,
    /// Noise of such a row's displacement, one standard deviation (um); `None` where no drive was read more than once.
    pub displacement_um: Option<f64>,
    /// The same of its currents.
    pub current: Option<CurrentNoise>,
}

/// Readings of one quantity at one drive: what their mean is, and how noisy it is.
struct Repeated {
    mean: f64,
    /// Variance of the mean.
    variance: f64,
    /// Degrees of freedom of that variance.
    freedom: f64,
}

impl Settled {
    /// Of readings, those at one drive together.
    pub fn of<'r>(drives: impl Iterator<Item = &'r [Row]>) -> Self {
        let (mut rows, mut z, mut currents) = (Vec::new(), Vec::new(), Vec::new());
        for readings in drives {
            rows.push(mean(readings));
            z.extend(repeated(readings, |row| row.z_um));
            for actuator in 0..crate::ACTUATORS {
                currents.extend(repeated(readings, |row| row.current_a[actuator]));
            }
        }
        Self {
            rows,
            displacement_um: spread(&z).filter(|&um| um > 0.0),
            current: current_noise(currents),
        }
    }

    /// The rows, with their noise stated in a file's keys where it is known and not stated already.
    pub fn states_in(self, keys: &mut Keys) -> Vec<Row> {
        if let Some(um) = self
            .displacement_um
            .filter(|_| keys.displacement_noise_um().is_none())
        {
            keys.set("noise_z_nm", &format!("{:.3}", 1e3 * um));
        }
        if let Some(noise) = self.current.filter(|_| keys.current_noise().is_none()) {
            keys.set_current_noise(noise);
        }
        self.rows
    }
}

fn repeated(rows: &[Row], of: impl Fn(&Row) -> Option<f64>) -> Option<Repeated> {
    let values: Vec<f64> = rows.iter().filter_map(of).collect();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (values.len() > 1).then_some(Repeated {
        mean,
        variance: squares / (count - 1.0) / count,
        freedom: count - 1.0,
    })
}

/// The standard deviation of a mean, pooled over drives.
fn spread(repeated: &[Repeated]) -> Option<f64> {
    let freedom: f64 = repeated.iter().map(|r| r.freedom).sum();
    let squares: f64 = repeated.iter().map(|r| r.freedom * r.variance).sum();
    (freedom > 0.0).then(|| (squares / freedom).sqrt())
}

/// What is constant shows in the lower half of the currents, and what is in proportion, beyond that, in the upper one.
fn current_noise(mut currents: Vec<Repeated>) -> Option<CurrentNoise> {
    currents.sort_by(|a, b| a.mean.abs().total_cmp(&b.mean.abs()));
    let (low, high) = currents.split_at(currents.len().div_ceil(2));
    let constant_a = spread(low)?;
    let beyond = high.iter().map(|r| Repeated {
        variance: (r.variance - constant_a.powi(2)) / r.mean.powi(2),
        ..*r
    });
    let ratio = spread(&beyond.collect::<Vec<_>>()).filter(|ratio| *ratio > 0.0);
    let noise = CurrentNoise {
        constant_a,
        ratio: ratio.unwrap_or(0.0),
    };
    (noise.constant_a > 0.0 || noise.ratio > 0.0).then_some(noise)
}

/// The mean of rows, of what each of them has.
pub(crate) fn mean(rows: &[Row]) -> Row {
    let of = |value: &dyn Fn(&Row) -> Option<f64>| {
        let values: Vec<f64> = rows.iter().filter_map(value).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    Row {
        t_s: rows[0].t_s,
        voltage_v: std::array::from_fn(|actuator| {
            of(&|row| Some(row.voltage_v[actuator])).unwrap_or_default()
        }),
        current_a: std::array::from_fn(|actuator| of(&|row| row.current_a[actuator])),
        z_um: of(&|row| row.z_um),
        ambient_c: of(&|row| row.ambient_c),
        ..rows[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two readings that lie this far from their mean, either way.
    fn pair(volts: f64, z_um: f64, off_um: f64, amperes: f64, off_a: f64) -> [Row; 2] {
        [1.0, -1.0].map(|sign| Row {
            voltage_v: [volts; 4],
            z_um: Some(z_um + sign * off_um),
            current_a: [Some(amperes + sign * off_a), None, None, None],
            ..Row::default()
        })
    }

    #[test]
    fn the_spread_of_readings_at_one_drive_is_the_noise_of_their_mean() {
        let rows = [
            pair(0.0, 0.0, 0.3, 0.0, 2e-6),
            pair(1.0, 26.0, 0.3, 1e-3, 2e-6),
            pair(2.0, 90.0, 0.3, 0.1, 5e-4),
            pair(3.0, 160.0, 0.3, 0.2, 1e-3),
        ]
        .concat();
        let settled = Settled::of(rows.chunk_by(|a, b| a.voltage_v == b.voltage_v));
        assert_eq!(settled.rows.len(), 4);
        assert!((settled.rows[2].z_um.unwrap() - 90.0).abs() < 1e-12);
        // Two readings 0.3 to either side of their mean: variance 0.18, of the mean half of it.
        assert!((settled.displacement_um.unwrap() - 0.3).abs() < 1e-12);
        let current = settled.current.unwrap();
        assert!((current.constant_a - 2e-6).abs() < 1e-12);
        // 5 mA in a thousand, less what is constant.
        assert!((current.ratio / 5e-3 - 1.0).abs() < 1e-4, "{current:?}");
    }

    #[test]
    fn single_readings_say_nothing_of_their_noise() {
        let rows = pair(1.0, 26.0, 0.0, 1e-3, 0.0);
        let settled = Settled::of(rows[..1].chunks(1));
        assert_eq!((settled.displacement_um, settled.current), (None, None));
    }
}
