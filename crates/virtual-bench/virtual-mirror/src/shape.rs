//! The shape of the beams: curvature from the local temperature, slope by summing it along the beam, height by summing
//! the slope's sine.

use crate::config::ShapeConfig;
use crate::effects::Effects;
use crate::effects::structure::expansion;
use crate::per_actuator::PerActuator;
use crate::thermal::Field;

/// How one cell bends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bend {
    /// Length along the beam (m).
    pub(crate) length: f64,
    /// Curvature per kelvin (1/(m K)), positive towards the substrate.
    pub(crate) curvature: PerActuator,
    /// Curvature by residual strains, positive towards the substrate (1/m): at rest the beam has a multiple of it, the other way.
    pub(crate) residual: PerActuator,
    /// How far the cell gives to a bending moment, in any unit: the cells of a half share its clamping by it.
    pub(crate) compliance: f64,
    /// Belongs to the half from the fold to the plate.
    pub(crate) turned: bool,
}

/// A cell ready for use.
#[derive(Clone, Copy, Debug)]
struct BendingCell {
    length: f64,
    /// Slope that one kelvin adds over the cell (rad/K).
    slope: PerActuator,
    /// Part of its half's end slope that clamping takes back over this cell.
    share: f64,
    /// Slope of the cold beam at the middle of the cell (rad), positive upwards.
    rest: f64,
}

/// Where the four beams' ends are, and what each cell's temperature does to them.
#[derive(Clone, Debug)]
pub(crate) struct Displacement {
    /// From the cold position, towards the substrate (m).
    pub(crate) value: PerActuator,
    /// Its derivative by the temperature of every cell (m/K).
    gradient: Vec<PerActuator>,
    /// Expansion of every cell, in kelvins of the linear law, and its derivative by temperature.
    strain: Vec<PerActuator>,
    by_kelvin: Vec<PerActuator>,
}

impl Displacement {
    pub(crate) fn none(cells: usize) -> Self {
        let zero = vec![PerActuator::ZERO; cells];
        Self {
            value: PerActuator::ZERO,
            gradient: zero.clone(),
            strain: zero.clone(),
            by_kelvin: zero,
        }
    }

    /// How fast the ends move (m/s) when the temperatures change at `rate`.
    pub(crate) fn rate(&self, rate: &Field) -> PerActuator {
        self.gradient
            .iter()
            .zip(rate.beams())
            .fold(PerActuator::ZERO, |sum, (g, r)| sum + *g * *r)
    }
}

/// The beams' kinematics.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    cells: Vec<BendingCell>,
    /// Number of cells up to the fold.
    fold: usize,
    /// Height of the cold beam's end above its start (m).
    rest_height: f64,
    /// How expansion departs from linear.
    expansion: [f64; 2],
    /// Plastic strain left in the films of every cell (K of expansion).
    pub(crate) plastic: Vec<PerActuator>,
}

impl Shape {
    pub(crate) fn new(bends: Vec<Bend>, config: &ShapeConfig, effects: &Effects) -> Self {
        let fold = bends.iter().position(|b| b.turned).unwrap_or(bends.len());
        let compliance = |half: &[Bend]| -> f64 { half.iter().map(|b| b.compliance).sum() };
        let residual: Vec<_> = bends.iter().map(|b| b.residual * b.length).collect();
        let total = [compliance(&bends[..fold]), compliance(&bends[fold..])];
        let cell = |bend: &Bend| BendingCell {
            length: bend.length,
            slope: bend.curvature * bend.length,
            share: config.clamp * bend.compliance / total[usize::from(bend.turned)],
            rest: 0.0,
        };
        let mut shape = Self {
            cells: bends.iter().map(cell).collect(),
            plastic: vec![PerActuator::ZERO; bends.len()],
            fold,
            rest_height: 0.0,
            expansion: expansion(effects),
        };
        shape.curl(config.rest_height_um * 1e-6, &residual);
        shape
    }

    /// Curls the cold beam up to `height` by residual strains, which let to themselves would add the slopes `residual` (rad) over the cells.
    fn curl(&mut self, height: f64, residual: &[PerActuator]) {
        let slopes = self.middle_slopes(residual);
        let rise = |times: f64| -> f64 {
            let rise = |(c, slope): (&BendingCell, &f64)| c.length * (slope * times).sin();
            self.cells.iter().zip(&slopes).map(rise).sum()
        };
        // The rise grows with the curl up to where the steepest slope stands upright.
        let steepest = slopes
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
        let times = if height > 0.0 { low } else { 0.0 };
        self.rest_height = rise(times);
        for (cell, slope) in self.cells.iter_mut().zip(slopes) {
            cell.rest = slope * times;
        }
    }

    /// Slope at the middle of every cell of the average beam, whose cells add these slopes while nothing clamps them.
    fn middle_slopes(&self, added: &[PerActuator]) -> Vec<f64> {
        let average = |each: PerActuator| 0.25 * each.sum();
        let (out, back) = added.split_at(self.fold);
        let end = |half: &[PerActuator]| half.iter().fold(PerActuator::ZERO, |sum, &s| sum + s);
        let ends = [end(out), end(back)].map(average);
        let mut slope = 0.0;
        let middle = |(i, (cell, &added)): (usize, (&BendingCell, &PerActuator))| {
            let gain = average(added) - ends[usize::from(i >= self.fold)] * cell.share;
            slope += gain;
            slope - 0.5 * gain
        };
        self.cells
            .iter()
            .zip(added)
            .enumerate()
            .map(middle)
            .collect()
    }

    /// Slopes that the two halves would end with if nothing clamped them.
    fn free_ends(&self, theta: &[PerActuator]) -> [PerActuator; 2] {
        let end = |cells: &[BendingCell], theta: &[PerActuator]| {
            cells
                .iter()
                .zip(theta)
                .fold(PerActuator::ZERO, |sum, (cell, theta)| {
                    sum + cell.slope * *theta
                })
        };
        let ((out, back), (out_theta, back_theta)) =
            (self.cells.split_at(self.fold), theta.split_at(self.fold));
        [end(out, out_theta), end(back, back_theta)]
    }

    /// Expansion of a cell, in kelvins of the linear law, and its derivative.
    #[inline(always)]
    fn expand(&self, theta: PerActuator) -> (PerActuator, PerActuator) {
        let (one, [p, q]) = (PerActuator::splat(1.0), self.expansion);
        let bend = theta * (PerActuator::splat(p) + theta * q);
        (
            theta * (one + bend),
            one + bend + theta * (PerActuator::splat(p) + theta * (2.0 * q)),
        )
    }

    /// Displacement of the four beams' ends at temperatures `theta` (K above ambient), the room `ambient` (K) warmer
    /// than at first.
    pub(crate) fn displace(&self, theta: &Field, ambient: f64, moved: &mut Displacement) {
        for (i, theta) in theta.beams().iter().enumerate() {
            let (strain, by_kelvin) = self.expand(*theta + PerActuator::splat(ambient));
            moved.strain[i] = strain - self.plastic[i];
            moved.by_kelvin[i] = by_kelvin;
        }
        let ends = self.free_ends(&moved.strain);
        let mut slope = PerActuator::ZERO;
        let mut drop = PerActuator::splat(self.rest_height);
        for (half, range) in [0..self.fold, self.fold..self.cells.len()]
            .into_iter()
            .enumerate()
        {
            let gradient = moved.gradient[range.clone()].iter_mut();
            let strained = self.cells[range.clone()].iter().zip(&moved.strain[range]);
            for ((cell, strain), along) in strained.zip(gradient) {
                let gain = cell.slope * *strain - ends[half] * cell.share;
                let (sin, cos) = (slope + gain * 0.5 - PerActuator::splat(cell.rest)).sin_cos();
                drop += sin * cell.length;
                *along = cos * cell.length;
                slope += gain;
            }
        }
        moved.value = drop;
        self.turn_into_gradient(moved);
    }

    /// From how much each cell's own slope moves the end to how much its temperature does: slope added in one cell
    /// tilts all that follow, and clamping takes its part back from the whole half.
    fn turn_into_gradient(&self, moved: &mut Displacement) {
        let mut beyond = PerActuator::ZERO;
        for range in [self.fold..self.cells.len(), 0..self.fold] {
            let cells = &self.cells[range.clone()];
            let (along, by_kelvin) = (&mut moved.gradient[range.clone()], &moved.by_kelvin[range]);
            let mut taken_back = PerActuator::ZERO;
            for (cell, along) in cells.iter().zip(along.iter_mut()).rev() {
                let lever = beyond + *along * 0.5;
                beyond += *along;
                taken_back += lever * cell.share;
                *along = lever;
            }
            for ((cell, by_kelvin), along) in cells.iter().zip(by_kelvin).zip(along) {
                *along = cell.slope * *by_kelvin * (*along - taken_back);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Effect;

    fn shape(rest_height_um: f64, clamp: f64) -> Shape {
        let bend = |i| {
            let curvature = PerActuator::splat(if i / 5 % 2 == 1 {
                -12.0
            } else {
                12.0 + 0.1 * f64::from(i)
            });
            Bend {
                length: 25e-6,
                curvature,
                residual: curvature,
                compliance: 1.0 + 0.02 * f64::from(i),
                turned: i >= 10,
            }
        };
        let mut effects = Effects::default();
        effects.set(Effect::ExpansionTemperature, 1.0);
        Shape::new(
            (0..20).map(bend).collect(),
            &ShapeConfig {
                rest_height_um,
                clamp,
            },
            &effects,
        )
    }

    fn uniform(kelvin: f64) -> Field {
        let mut field = Field::zero(20);
        field.rows_mut().fill(PerActuator::splat(kelvin));
        field
    }

    fn displaced(shape: &Shape, theta: &Field) -> Displacement {
        let mut moved = Displacement::none(20);
        shape.displace(theta, 0.0, &mut moved);
        moved
    }

    #[test]
    fn a_flat_s_rises_by_two_arcs() {
        let bend = |i| Bend {
            length: 25e-6,
            curvature: PerActuator::splat(if i < 10 { 12.0 } else { -12.0 }),
            residual: PerActuator::ZERO,
            compliance: 1.0,
            turned: false,
        };
        let shape = Shape::new(
            (0..20).map(bend).collect(),
            &ShapeConfig::default(),
            &Effects::default(),
        );
        let (curvature, length) = (600.0, 250e-6f64);
        let arcs = 2.0 * (1.0 - (curvature * length).cos()) / curvature;
        // Twenty straight pieces in the place of two arcs: each turns by 0.015 rad, the square of which is 2e-4.
        approx::assert_relative_eq!(
            displaced(&shape, &uniform(50.0)).value.0[2],
            arcs,
            max_relative = 1e-3
        );
    }

    #[test]
    fn the_curl_is_at_the_asked_height_and_rest_is_zero() {
        let curled = shape(20.0, 0.5);
        approx::assert_relative_eq!(curled.rest_height, 20e-6, max_relative = 1e-9);
        approx::assert_abs_diff_eq!(
            displaced(&curled, &uniform(0.0)).value.0[0],
            0.0,
            epsilon = 1e-12
        );
    }

    #[test]
    fn residual_strains_choose_the_shape_at_rest_and_not_the_height() {
        let end = |residual: [f64; 2]| {
            let bend = |i| Bend {
                length: 25e-6,
                curvature: PerActuator::splat(if i < 10 { 12.0 } else { -12.0 }),
                residual: PerActuator::splat(residual[usize::from(i >= 10)]),
                compliance: 1.0,
                turned: false,
            };
            let config = ShapeConfig {
                rest_height_um: 100.0,
                clamp: 0.0,
            };
            let shape = Shape::new((0..20).map(bend).collect(), &config, &Effects::default());
            approx::assert_relative_eq!(shape.rest_height, 100e-6, max_relative = 1e-9);
            shape.cells[19].rest
        };
        // The S is 0.4 rad steep in its middle, and a twentieth of that in the middle of its last cell. Where only its first arc is curled, it ends as
        // steep as that: 100 um / 375 um. Sines are up to 3 % less than their angles.
        approx::assert_relative_eq!(end([12.0, -12.0]), 0.02, max_relative = 0.03);
        approx::assert_relative_eq!(end([12.0, 0.0]), 0.267, max_relative = 0.03);
    }

    #[test]
    fn the_gradient_is_the_derivative() {
        let shape = shape(20.0, 0.3);
        let theta = |nudge: f64, at: usize| {
            let mut field = uniform(60.0);
            field.rows_mut()[at] += PerActuator::splat(nudge);
            displaced(&shape, &field)
        };
        for cell in 0..20 {
            let slope = (theta(0.01, cell).value.0[1] - theta(-0.01, cell).value.0[1]) / 0.02;
            // What a central difference over 0.02 K leaves.
            approx::assert_relative_eq!(
                theta(0.0, cell).gradient[cell].0[1],
                slope,
                max_relative = 1e-6
            );
        }
    }
}
