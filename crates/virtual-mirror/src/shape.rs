//! The shape of the beams: curvature from the local temperature, slope by summing it along the beam, height by summing
//! the slope's sine.

use crate::config::ShapeConfig;
use crate::lanes::Lanes;
use crate::thermal::Field;

/// How one cell bends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bend {
    /// Length along the beam (m).
    pub(crate) length: f64,
    /// Curvature per kelvin (1/(m K)), positive towards the substrate.
    pub(crate) curvature: Lanes,
    /// How far the cell gives to a bending moment, in any unit: the cells of a half share its clamping by it.
    pub(crate) compliance: f64,
    /// Belongs to the half from the fold to the plate.
    pub(crate) turned: bool,
}

/// A cell ready for use.
#[derive(Clone, Copy, Debug)]
struct Cell {
    length: f64,
    /// Slope that one kelvin adds over the cell (rad/K).
    slope: Lanes,
    /// Part of its half's end slope that clamping takes back over this cell.
    share: f64,
    turned: bool,
    /// Slope of the cold beam at the middle of the cell (rad), positive upwards.
    rest: f64,
}

/// Displacement of each actuator's end and how fast it moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Displacement {
    /// From the cold position, towards the substrate (m).
    pub(crate) value: Lanes,
    /// (m/s)
    pub(crate) rate: Lanes,
}

/// The beams' kinematics.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    cells: Vec<Cell>,
    /// Height of the cold beam's end above its start (m).
    rest_height: f64,
}

impl Shape {
    pub(crate) fn new(bends: Vec<Bend>, config: &ShapeConfig) -> Self {
        let compliance = |turned: bool| -> f64 {
            bends
                .iter()
                .filter(|b| b.turned == turned)
                .map(|b| b.compliance)
                .sum()
        };
        let total = [compliance(false), compliance(true)];
        let cell = |bend: &Bend| Cell {
            length: bend.length,
            slope: bend.curvature * bend.length,
            share: config.clamp * bend.compliance / total[usize::from(bend.turned)],
            turned: bend.turned,
            rest: 0.0,
        };
        let mut shape = Self {
            cells: bends.iter().map(cell).collect(),
            rest_height: 0.0,
        };
        shape.curl(config.rest_height_um * 1e-6);
        shape
    }

    /// Curls the cold beam up to `height` as uniform cooling would: residual stress acts like a temperature.
    fn curl(&mut self, height: f64) {
        let per_kelvin = self.slopes_of_a_kelvin();
        let rise = |kelvin: f64| -> f64 {
            self.cells
                .iter()
                .zip(&per_kelvin)
                .map(|(c, slope)| c.length * (slope * kelvin).sin())
                .sum()
        };
        // The rise grows with the curl up to where the steepest slope stands upright.
        let steepest = per_kelvin
            .iter()
            .fold(0.0f64, |worst, slope| worst.max(slope.abs()));
        let (mut low, mut high) = (0.0, std::f64::consts::FRAC_PI_2 / steepest.max(1e-9));
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if rise(middle) < height {
                low = middle;
            } else {
                high = middle;
            }
        }
        let kelvin = if height > 0.0 { low } else { 0.0 };
        self.rest_height = rise(kelvin);
        for (cell, slope) in self.cells.iter_mut().zip(per_kelvin) {
            cell.rest = slope * kelvin;
        }
    }

    /// Slope at the middle of every cell of the average beam, all of it a kelvin warm.
    fn slopes_of_a_kelvin(&self) -> Vec<f64> {
        let gain = |cell: &Cell| 0.25 * cell.slope.sum();
        let end = |turned| {
            self.cells
                .iter()
                .filter(|c| c.turned == turned)
                .map(gain)
                .sum::<f64>()
        };
        let ends = [end(false), end(true)];
        let mut slope = 0.0;
        let middle = |cell: &Cell| {
            let gain = gain(cell) - ends[usize::from(cell.turned)] * cell.share;
            slope += gain;
            slope - 0.5 * gain
        };
        self.cells.iter().map(middle).collect()
    }

    /// Slopes that the two halves would end with if nothing clamped them.
    #[inline(always)]
    fn free_ends(cells: &[Cell], theta: &[Lanes]) -> [Lanes; 2] {
        let mut ends = [Lanes::ZERO; 2];
        for (cell, theta) in cells.iter().zip(theta) {
            ends[usize::from(cell.turned)] += cell.slope * *theta;
        }
        ends
    }

    /// Displacement of the four beams' ends at temperatures `theta` that change at `rate`.
    pub(crate) fn displacement(&self, theta: &Field, rate: &Field) -> Displacement {
        let n = self.cells.len();
        let (cells, theta, rate) = (&self.cells[..n], &theta.beams()[..n], &rate.beams()[..n]);
        let (ends, end_rates) = (Self::free_ends(cells, theta), Self::free_ends(cells, rate));
        let (mut slope, mut slope_rate) = (Lanes::ZERO, Lanes::ZERO);
        let mut moved = Displacement {
            value: Lanes::splat(self.rest_height),
            rate: Lanes::ZERO,
        };
        for i in 0..n {
            let (cell, half) = (&cells[i], usize::from(cells[i].turned));
            let gain = cell.slope * theta[i] - ends[half] * cell.share;
            let gain_rate = cell.slope * rate[i] - end_rates[half] * cell.share;
            let middle = slope + gain * 0.5 - Lanes::splat(cell.rest);
            let (sin, cos) = middle.sin_cos();
            moved.value += sin * cell.length;
            moved.rate += cos * (slope_rate + gain_rate * 0.5) * cell.length;
            slope += gain;
            slope_rate += gain_rate;
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(rest_height_um: f64, clamp: f64) -> Shape {
        let sign = |i: usize| if i < 10 { 1.0 } else { -1.0 };
        let bend = |i| Bend {
            length: 25e-6,
            curvature: Lanes::splat(12.0 * sign(i)),
            compliance: 1.0,
            turned: false,
        };
        Shape::new(
            (0..20).map(bend).collect(),
            &ShapeConfig {
                rest_height_um,
                clamp,
            },
        )
    }

    fn uniform(kelvin: f64) -> Field {
        let mut field = Field::zero(20);
        field.rows_mut().fill(Lanes::splat(kelvin));
        field
    }

    #[test]
    fn a_flat_s_rises_by_two_arcs() {
        let moved = shape(0.0, 0.0)
            .displacement(&uniform(50.0), &uniform(0.0))
            .value
            .0[2];
        let (curvature, length) = (600.0, 250e-6f64);
        let arcs = 2.0 * (1.0 - (curvature * length).cos()) / curvature;
        approx::assert_relative_eq!(moved, arcs, max_relative = 1e-3);
    }

    #[test]
    fn the_curl_is_at_the_asked_height_and_rest_is_zero() {
        let curled = shape(100.0, 0.5);
        approx::assert_relative_eq!(curled.rest_height, 100e-6, max_relative = 1e-6);
        let moved = curled.displacement(&uniform(0.0), &uniform(0.0)).value.0[0];
        approx::assert_abs_diff_eq!(moved, 0.0, epsilon = 1e-12);
    }

    #[test]
    fn the_rate_is_the_derivative() {
        let shape = shape(150.0, 0.3);
        let at = |kelvin| shape.displacement(&uniform(kelvin), &uniform(1.0));
        let slope = (at(60.01).value.0[1] - at(59.99).value.0[1]) / 0.02;
        approx::assert_relative_eq!(at(60.0).rate.0[1], slope, max_relative = 1e-6);
    }
}
