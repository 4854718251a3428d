//! Noise of the meters at a heater on a bench, which may be any: read off what no smooth curve of the voltage can follow.

use super::smooth::{along_drive, is_even};
use super::usual::USUAL;
use measurement::held::{DIFFERENCE, MEDIAN_OF_NORMAL};
use measurement::{ACTUATORS, CurrentNoise, Row, Session};

/// No meter is better than this part of its reading, and this part of its highest one: a five-digit bench multimeter.
const FINEST_RATIO: f64 = 1e-4;
const FINEST_CONSTANT: f64 = 1e-5;
/// Fewer differences than this have no middle one.
const ENOUGH: usize = 3;
/// A spread is known to this over the root of the count of differences, which overlap, at 95 %; and what is noise must
/// not look like physics.
const UNSURE: f64 = 2.5;
/// Beyond so many standard deviations a difference is a jump, and no noise (the three-sigma rule).
const JUMP: f64 = 3.0;

/// Voltages have so many decimals at most where a hand-held meter rounded them.
const DECIMALS: i32 = 3;
/// Rounding scatters the lowest quarter of a sweep by this part of what it could, or more, if it is at work: at one in a hundred
/// of such sweeps of twenty rows less.
const AT_WORK: f64 = 0.5;
/// A number has been rounded to a digit that it is a multiple of up to this part of it.
const MULTIPLE: f64 = 1e-6;

/// A deviation from a smooth curve, one standard deviation of the readings' noise each (A), the current there, and its slope (A/V)
/// where the voltage moves.
struct Deviation {
    size_a: f64,
    current_a: f64,
    slope: f64,
}

impl Deviation {
    /// What of it is not what the voltage may be off by.
    fn beyond(self, rounding_v: f64) -> Self {
        let squares = self.size_a.powi(2) - (self.slope * rounding_v).powi(2);
        Self {
            size_a: squares.max(0.0).sqrt(),
            ..self
        }
    }
}

/// All of an actuator, by current.
fn deviations(session: &Session, actuator: usize) -> Vec<Deviation> {
    let rows = session
        .files
        .iter()
        .flat_map(|(_, file)| file.rows.windows(DIFFERENCE.len()));
    let mut deviations: Vec<Deviation> =
        rows.filter_map(|rows| deviation(rows, actuator)).collect();
    deviations.sort_by(|a, b| a.current_a.total_cmp(&b.current_a));
    deviations
}

/// What the voltages of a session may be off by because they were rounded to their last digit (V); 0 where the currents follow
/// them better than they would.
pub(super) fn rounding_v(session: &Session) -> f64 {
    let rows = session.files.iter().flat_map(|(_, file)| &file.rows);
    let volts: Vec<f64> = rows.flat_map(|row| row.voltage_v).collect();
    let is_multiple = |digit: &f64| {
        let off = |v: &f64| (v / digit - (v / digit).round()).abs();
        volts.iter().all(|v| off(v) < MULTIPLE)
    };
    let digits = (0..=DECIMALS).map(|decimals| 0.1_f64.powi(decimals));
    let Some(digit) = digits.into_iter().find(is_multiple) else {
        return 0.0;
    };
    // A rounded number lies anywhere within a digit: a rectangular distribution (JCGM 100:2008, 4.3.7).
    let rounding_v = digit / 12f64.sqrt();
    let scatters = |actuator: usize| {
        let found = deviations(session, actuator);
        let mut swept: Vec<f64> = found
            .iter()
            .take(found.len().div_ceil(4))
            .filter(|d| d.slope > 0.0)
            .map(|d| d.size_a / (d.slope * rounding_v))
            .collect();
        swept.sort_by(f64::total_cmp);
        swept.len() >= ENOUGH && swept[swept.len() / 2] > AT_WORK * MEDIAN_OF_NORMAL
    };
    if (0..ACTUATORS).any(scatters) {
        rounding_v
    } else {
        0.0
    }
}

/// Noise of an actuator's current, beside what the voltages may be off by. What is constant shows at low currents, what is in
/// proportion at high ones. No low reading is believed more than the lower half of them shows.
pub(super) fn current(session: &Session, actuator: usize, rounding_v: f64) -> CurrentNoise {
    let deviations: Vec<Deviation> = deviations(session, actuator)
        .into_iter()
        .map(|deviation| deviation.beyond(rounding_v))
        .collect();
    if deviations.len() < ENOUGH {
        return USUAL;
    }
    let highest_a = deviations[deviations.len() - 1].current_a;
    let (low, high) = deviations.split_at(deviations.len() / 2);
    let ratio = spread(high, |d| d.size_a / d.current_a).max(FINEST_RATIO);
    let constant_a = spread(low, |d| d.size_a).max(FINEST_CONSTANT * highest_a);
    let unsure = 1.0 + UNSURE / (deviations.len() as f64).sqrt();
    CurrentNoise {
        constant_a: unsure * constant_a,
        ratio: unsure * ratio,
    }
}

/// Their root mean square, without jumps.
fn spread(deviations: &[Deviation], of: impl Fn(&Deviation) -> f64) -> f64 {
    let mut sizes: Vec<f64> = deviations.iter().map(of).collect();
    sizes.sort_by(f64::total_cmp);
    let Some(median) = sizes.get(sizes.len() / 2) else {
        return 0.0;
    };
    let most = JUMP * median / MEDIAN_OF_NORMAL;
    let squares: Vec<f64> = sizes
        .iter()
        .filter(|s| **s <= most)
        .map(|s| s * s)
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// How far rows of a rising or falling drive lie off the best cubic of the voltage, or rows of a held one off the best cubic
/// of time.
fn deviation(rows: &[Row], actuator: usize) -> Option<Deviation> {
    let volts: Vec<f64> = rows.iter().map(|row| row.voltage_v[actuator]).collect();
    let weights = match volts.iter().all(|v| *v == volts[0]) {
        true => is_even(rows).then(|| DIFFERENCE.to_vec())?,
        false => along_drive(&volts)?,
    };
    let gain = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
    let mut off = 0.0;
    for (row, weight) in rows.iter().zip(&weights) {
        off += weight * row.current_a[actuator]?;
    }
    let current_a = rows[rows.len() / 2].current_a[actuator]?;
    let [low, high] = [0, rows.len() - 1].map(|end| rows[end].current_a[actuator]);
    let moved_v = volts[volts.len() - 1] - volts[0];
    let slope = match (high? - low?) / moved_v {
        slope if slope.is_finite() => slope,
        _ => 0.0,
    };
    (current_a > 0.0).then_some(Deviation {
        size_a: off.abs() / gain,
        current_a,
        slope,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use measurement::MeasurementFile;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// A sweep of a heater that is no straight line, with this noise.
    fn sweep(rows: usize, constant_a: f64, ratio: f64) -> Session {
        rounded_sweep(rows, constant_a, ratio, |volts| volts)
    }

    /// The same whose voltages were read so.
    fn rounded_sweep(
        rows: usize,
        constant_a: f64,
        ratio: f64,
        rounded: impl Fn(f64) -> f64,
    ) -> Session {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let row = |index: usize| {
            let volts = 5.0 * ((index + 1) as f64 / rows as f64).powf(1.2);
            let current = 0.3 * (volts / 5.0).powf(0.6);
            let read = current * (1.0 + ratio * normal()) + constant_a * normal();
            Row {
                t_s: index as f64,
                voltage_v: [rounded(volts); 4],
                current_a: [Some(read); 4],
                ..Row::default()
            }
        };
        let file = MeasurementFile {
            rows: (0..rows).map(row).collect(),
            ..MeasurementFile::default()
        };
        Session {
            files: vec![("sweep.csv".into(), file)],
        }
    }

    #[test]
    fn noise_is_known_whether_constant_or_in_proportion() {
        let constant = current(&sweep(200, 1e-3, 0.0), 0, 0.0);
        assert!(
            (0.7..1.6).contains(&(constant.at(0.05) / 1e-3)),
            "{constant:?}"
        );
        let in_proportion = current(&sweep(200, 0.0, 3e-3), 0, 0.0);
        let ratio = in_proportion.at(0.05) / (3e-3 * 0.05);
        assert!((0.8..2.0).contains(&(in_proportion.at(0.3) / (3e-3 * 0.3))));
        assert!((0.8..4.0).contains(&ratio), "{in_proportion:?}");
    }

    #[test]
    fn twenty_rows_tell_good_meters_from_poor_ones() {
        let (good, poor) = (
            current(&sweep(20, 0.0, 1e-4), 0, 0.0),
            current(&sweep(20, 0.0, 3e-3), 0, 0.0),
        );
        assert!(poor.at(0.2) > 3.0 * good.at(0.2), "{good:?} {poor:?}");
    }

    #[test]
    fn rounded_voltages_are_told_from_exact_ones() {
        let coarse = |volts: f64| (20.0 * volts).round() / 20.0;
        // A digit of 0.01 V, of which 0.05 V is a multiple.
        let sigma_v = 0.01 / 12f64.sqrt();
        let read = rounded_sweep(40, 0.0, 1e-4, coarse);
        assert!((rounding_v(&read) - sigma_v).abs() < 1e-12);
        let exact = rounded_sweep(40, 0.0, 1e-4, |volts| volts);
        assert_eq!(rounding_v(&exact), 0.0);
        // Set to a digit, and not read off: the currents follow.
        let mut set = sweep(40, 0.0, 1e-4);
        for (index, row) in set.files[0].1.rows.iter_mut().enumerate() {
            let volts = 0.1 * (index + 1) as f64;
            row.voltage_v = [volts; 4];
            row.current_a = [Some(0.3 * (volts / 5.0).powf(0.6)); 4];
        }
        assert_eq!(rounding_v(&set), 0.0);
    }

    #[test]
    fn weights_of_even_places_are_those_of_a_difference() {
        let weights = along_drive(&[1.0, 2.0, 3.0, 4.0, 5.0]).expect("a rising drive");
        for (weight, difference) in weights.iter().zip(DIFFERENCE) {
            assert!((weight / weights[0] - difference).abs() < 1e-9);
        }
    }
}
