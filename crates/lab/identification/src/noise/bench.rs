//! Noise of the meters at a heater on a bench, which may be any: read off what no smooth curve of the voltage can follow.

use super::{Current, DIFFERENCE, MEDIAN_OF_NORMAL, is_even};
use measurement::{Row, Session};

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

/// A deviation from a smooth curve, one standard deviation of the readings' noise each (A), and the current there.
struct Deviation {
    size_a: f64,
    current_a: f64,
}

/// Noise of an actuator's current. What is constant shows at low currents, what is in proportion at high ones. No low reading
/// is believed more than the lower half of them shows.
pub(super) fn current(session: &Session, actuator: usize) -> Current {
    let mut deviations: Vec<Deviation> = session
        .files
        .iter()
        .flat_map(|(_, file)| file.rows.windows(DIFFERENCE.len()))
        .filter_map(|rows| deviation(rows, actuator))
        .collect();
    if deviations.len() < ENOUGH {
        return Current::USUAL;
    }
    deviations.sort_by(|a, b| a.current_a.total_cmp(&b.current_a));
    let highest_a = deviations[deviations.len() - 1].current_a;
    let (low, high) = deviations.split_at(deviations.len() / 2);
    let ratio = spread(high, |d| d.size_a / d.current_a).max(FINEST_RATIO);
    let constant_a = spread(low, |d| d.size_a).max(FINEST_CONSTANT * highest_a);
    let unsure = 1.0 + UNSURE / (deviations.len() as f64).sqrt();
    Current {
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
    let weights = if volts.iter().all(|v| *v == volts[0]) {
        is_even(rows).then(|| DIFFERENCE.to_vec())?
    } else if volts.is_sorted_by(|a, b| a < b) || volts.is_sorted_by(|a, b| a > b) {
        divided_difference(&volts)
    } else {
        return None;
    };
    let gain = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
    let mut off = 0.0;
    for (row, weight) in rows.iter().zip(&weights) {
        off += weight * row.current_a[actuator]?;
    }
    let current_a = rows[rows.len() / 2].current_a[actuator]?;
    (current_a > 0.0).then_some(Deviation {
        size_a: off.abs() / gain,
        current_a,
    })
}

/// The weights of the highest divided difference at these places.
fn divided_difference(places: &[f64]) -> Vec<f64> {
    let scale = places[places.len() - 1] - places[0];
    let weight = |(index, at): (usize, &f64)| {
        let others = places
            .iter()
            .enumerate()
            .filter(|&(other, _)| other != index);
        1.0 / others
            .map(|(_, other)| (at - other) / scale)
            .product::<f64>()
    };
    places.iter().enumerate().map(weight).collect()
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
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let row = |index: usize| {
            let volts = 5.0 * ((index + 1) as f64 / rows as f64).powf(1.2);
            let current = 0.3 * (volts / 5.0).powf(0.6);
            let read = current * (1.0 + ratio * normal()) + constant_a * normal();
            Row {
                t_s: index as f64,
                voltage_v: [volts; 4],
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
        let constant = current(&sweep(200, 1e-3, 0.0), 0);
        assert!(
            (0.7..1.6).contains(&(constant.at(0.05) / 1e-3)),
            "{constant:?}"
        );
        let in_proportion = current(&sweep(200, 0.0, 3e-3), 0);
        let ratio = in_proportion.at(0.05) / (3e-3 * 0.05);
        assert!((0.8..2.0).contains(&(in_proportion.at(0.3) / (3e-3 * 0.3))));
        assert!((0.8..4.0).contains(&ratio), "{in_proportion:?}");
    }

    #[test]
    fn twenty_rows_tell_good_meters_from_poor_ones() {
        let (good, poor) = (
            current(&sweep(20, 0.0, 1e-4), 0),
            current(&sweep(20, 0.0, 3e-3), 0),
        );
        assert!(poor.at(0.2) > 3.0 * good.at(0.2), "{good:?} {poor:?}");
    }

    #[test]
    fn weights_of_even_places_are_those_of_a_difference() {
        let weights = divided_difference(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        for (weight, difference) in weights.iter().zip(DIFFERENCE) {
            assert!((weight / weights[0] - difference).abs() < 1e-9);
        }
    }
}
