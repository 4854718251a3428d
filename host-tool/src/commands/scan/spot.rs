//! Where on the plate a sensor's spot seems to be: what tilts make of its readings is no error of the mirror.

use std::fmt;

use measurement::Row;
use serde::Serialize;

use crate::commands::following::mean_and_rms;

/// A spot is told where it leaves less than this part of the error: a quarter of its squares.
const LEFT: f64 = 0.5;
/// Determinants below this part of the product of the squares are of tilts about one axis, or of one line of both.
const ON_A_LINE: f64 = 1e-6;

/// The spot that explains most of what was read beyond what was asked.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct SensorSpot {
    /// From the plate's centre along x and y; 0 along an axis that no tilt tells.
    x_um: f64,
    y_um: f64,
    /// What the error is about its mean beside what this makes of it (root mean square).
    rms_error_um: f64,
}

impl SensorSpot {
    /// Of the rows from `from_s` on, by least squares, where z is read y tan(tilt_x) - x tan(tilt_y) further down; `None` where no tilt was asked
    /// for, or they leave most of the error.
    pub(super) fn of(rows: &[Row], from_s: f64) -> Option<Self> {
        let rows = rows.iter().filter(|row| row.t_s >= from_s);
        let points: Vec<[f64; 3]> = rows.filter_map(point).collect();
        let mean = |of: usize| mean_and_rms(points.iter().map(|point| point[of])).0;
        let means = [mean(0), mean(1), mean(2)];
        let product = |a: usize, b: usize| -> f64 {
            let products = points.iter().map(|p| (p[a] - means[a]) * (p[b] - means[b]));
            products.sum()
        };
        let (xx, yy, xy) = (product(1, 1), product(2, 2), product(1, 2));
        let (ex, ey) = (product(0, 1), product(0, 2));
        let determinant = xx * yy - xy * xy;
        let (x_um, y_um) = if determinant > ON_A_LINE * xx * yy {
            (
                (ex * yy - ey * xy) / determinant,
                (ey * xx - ex * xy) / determinant,
            )
        } else if xx.max(yy) > 0.0 {
            // The nearest to the centre of those that explain it as well.
            let squares = xx + yy;
            (ex / squares, ey / squares)
        } else {
            return None;
        };
        let left = points.iter().map(|[off, x, y]| off - x_um * x - y_um * y);
        let (_, rms_error_um) = mean_and_rms(left);
        let (_, error_um) = mean_and_rms(points.iter().map(|point| point[0]));
        (rms_error_um < LEFT * error_um).then_some(Self {
            x_um,
            y_um,
            rms_error_um,
        })
    }
}

/// How much further down a row was read than asked (um), and by how much a spot a micrometre along x or y is.
fn point(row: &Row) -> Option<[f64; 3]> {
    let off_um = row.z_um? - row.asked_um?;
    let [tilt_x, tilt_y] = [row.asked_tilt_x_deg?, row.asked_tilt_y_deg?].map(f64::to_radians);
    Some([off_um, -tilt_y.tan(), tilt_x.tan()])
}

impl fmt::Display for SensorSpot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "           of which all but {:.3} um is what tilts make of a sensor's spot {:.0} um along x and {:.0} um along y from the plate's centre",
            self.rms_error_um, self.x_um, self.y_um
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a circle of half a degree, or of a line about x, as a sensor over this spot reads a mirror that errs by so much.
    fn rows(along_y: f64, spot_um: [f64; 2], error_um: impl Fn(f64) -> f64) -> Vec<Row> {
        let row = |index: u32| {
            let turn = std::f64::consts::TAU * f64::from(index) / 100.0;
            let (x_deg, y_deg) = (0.5 * turn.cos(), along_y * turn.sin());
            let of_spot =
                spot_um[1] * x_deg.to_radians().tan() - spot_um[0] * y_deg.to_radians().tan();
            Row {
                t_s: f64::from(index),
                z_um: Some(80.0 + of_spot + error_um(turn)),
                asked_um: Some(80.0),
                asked_tilt_x_deg: Some(x_deg),
                asked_tilt_y_deg: Some(y_deg),
                ..Row::default()
            }
        };
        (0..300).map(row).collect()
    }

    #[test]
    fn a_spot_beside_the_centre_is_found() {
        let noise = |turn: f64| 0.02 * (31.0 * turn).sin();
        let spot = SensorSpot::of(&rows(0.5, [300.0, -200.0], noise), 100.0).expect("a spot");
        // Noise of 14 nm rms over 0.0062 rms of tilt, in 200 rows.
        assert!(
            (spot.x_um - 300.0).abs() < 1.0 && (spot.y_um + 200.0).abs() < 1.0,
            "{spot:?}"
        );
        assert!(
            (spot.rms_error_um - 0.02 / 2.0_f64.sqrt()).abs() < 1e-3,
            "{spot:?}"
        );
    }

    #[test]
    fn tilts_about_one_axis_tell_one_place() {
        let spot = SensorSpot::of(&rows(0.0, [300.0, -200.0], |_| 0.0), 0.0).expect("a spot");
        assert!(
            spot.x_um == 0.0 && (spot.y_um + 200.0).abs() < 1e-9,
            "{spot:?}"
        );
    }

    #[test]
    fn an_error_that_is_none_of_the_tilts_tells_no_spot() {
        let rings = |turn: f64| (2.0 * turn).sin();
        assert_eq!(SensorSpot::of(&rows(0.5, [0.0, 0.0], rings), 0.0), None);
        assert_eq!(SensorSpot::of(&rows(0.5, [0.0, 0.0], |_| 0.0), 0.0), None);
        let mut level = rows(0.5, [300.0, 0.0], |_| 0.0);
        for row in &mut level {
            row.asked_tilt_x_deg = None;
        }
        assert_eq!(SensorSpot::of(&level, 0.0), None);
        assert_eq!(SensorSpot::of(&[], 0.0), None);
    }
}
