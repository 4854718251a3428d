//! Solves `(s - J) x = r` for the matrix `J` of conduction and losses: four tridiagonal beams at once, the shared bodies
//! by their Schur complement.

use super::field::{FRAME, Field, PACKAGE, PLATE};
use super::network::{Cell, Network};
use crate::per_actuator::PerActuator;

/// What the factorisation keeps of one cell.
#[derive(Clone, Copy, Debug, Default)]
struct Factors {
    /// Forward: `y = r pivot + y_previous carry`.
    pivot: PerActuator,
    carry: PerActuator,
    /// Backward: `x = y + x_next back`.
    back: PerActuator,
    /// Response to one kelvin of the frame and of the plate.
    to_frame: PerActuator,
    to_plate: PerActuator,
    /// What the cell feeds into the frame.
    frame_gain: PerActuator,
}

/// What the matrix is taken at; the method keeps its order when they have moved on since.
#[derive(Clone, Debug)]
pub(crate) struct Point<'a> {
    pub(crate) theta: &'a Field,
    /// Square of the current (A2).
    pub(crate) heating: PerActuator,
}

/// The factorised matrix for one shift `s`.
#[derive(Clone, Debug)]
pub(crate) struct Solver {
    rows: Vec<Factors>,
    /// What the ends of the beams feed into the plate.
    plate_gain: PerActuator,
    /// Whether cells beyond the first feed the frame.
    warms_frame: bool,
    /// Inverse of the Schur complement of the shared bodies.
    lumps: [[f64; 3]; 3],
}

impl Solver {
    pub(crate) fn new(cells: usize) -> Self {
        Self {
            rows: vec![Factors::default(); cells],
            plate_gain: PerActuator::ZERO,
            warms_frame: false,
            lumps: [[0.0; 3]; 3],
        }
    }

    /// Factorises for the shift `s` (1/s).
    pub(crate) fn factorise(&mut self, network: &Network, s: f64, at: &Point) {
        self.factorise_beams(network, s, at);
        let n = self.rows.len();
        let last = &network.cells[n - 1];
        let mut source = vec![PerActuator::ZERO; n];
        source[n - 1] = last.to_next * last.inv_capacity;
        self.respond(source, |row, x| row.to_plate = x);

        let from_air = |cell: &Cell| cell.to_air * network.air_to_frame;
        let mut source: Vec<PerActuator> = network.cells.iter().map(from_air).collect();
        source[0] += network.to_frame;
        for ((row, source), cell) in self.rows.iter_mut().zip(&mut source).zip(&network.cells) {
            row.frame_gain = *source * network.lumps[FRAME].inv_capacity;
            *source = *source * cell.inv_capacity;
        }
        self.respond(source, |row, x| row.to_frame = x);
        self.warms_frame = network.air_to_frame != 0.0;
        self.plate_gain = last.to_next * network.lumps[PLATE].inv_capacity;
        self.lumps = invert(self.schur_complement(network, s));
    }

    fn factorise_beams(&mut self, network: &Network, s: f64, at: &Point) {
        let mut inflow = network.to_frame;
        let mut previous = Factors::default();
        let cells = network.cells.iter().zip(at.theta.beams());
        for (i, (row, (cell, theta))) in self.rows.iter_mut().zip(cells).enumerate() {
            let restoring = network.restoring(cell, *theta, at.heating);
            let below = if i == 0 {
                PerActuator::ZERO
            } else {
                inflow * cell.inv_capacity
            };
            let diagonal =
                PerActuator::splat(s) + (inflow + cell.to_next + restoring) * cell.inv_capacity;
            row.pivot = PerActuator::splat(1.0) / (diagonal - below * previous.back);
            row.carry = below * row.pivot;
            row.back = cell.to_next * cell.inv_capacity * row.pivot;
            inflow = cell.to_next;
            previous = *row;
        }
        if let Some(last) = self.rows.last_mut() {
            last.back = PerActuator::ZERO;
        }
    }

    /// Stores the beams' response to a source.
    fn respond(&mut self, mut source: Vec<PerActuator>, store: impl Fn(&mut Factors, PerActuator)) {
        self.sweep(&mut source);
        for (row, x) in self.rows.iter_mut().zip(source) {
            store(row, x);
        }
    }

    fn schur_complement(&self, network: &Network, s: f64) -> [[f64; 3]; 3] {
        let last = self.rows[self.rows.len() - 1];
        let into_frame = |part: &dyn Fn(&Factors) -> PerActuator| -> f64 {
            self.rows
                .iter()
                .map(|row| (row.frame_gain * part(row)).sum())
                .sum()
        };
        let capacity = |k: usize| network.lumps[k].inv_capacity;
        let room = |k: usize| network.lumps[k].to_room * capacity(k);
        let air: f64 = network.cells.iter().map(|cell| cell.to_air.sum()).sum();
        let around = network.to_frame.sum() + network.air_to_frame * network.air_to_frame * air;
        let down = network.frame_to_package;
        let mut m = [[0.0; 3]; 3];
        m[PLATE][PLATE] =
            s + room(PLATE) + self.plate_gain.sum() - (self.plate_gain * last.to_plate).sum();
        m[PLATE][FRAME] = -(self.plate_gain * last.to_frame).sum();
        m[FRAME][FRAME] =
            s + room(FRAME) + (down + around) * capacity(FRAME) - into_frame(&|row| row.to_frame);
        m[FRAME][PLATE] = -into_frame(&|row| row.to_plate);
        m[FRAME][PACKAGE] = -down * capacity(FRAME);
        m[PACKAGE][PACKAGE] = s + room(PACKAGE) + down * capacity(PACKAGE);
        m[PACKAGE][FRAME] = -down * capacity(PACKAGE);
        m
    }

    /// Solves in place.
    pub(crate) fn solve(&self, x: &mut Field) {
        let n = self.rows.len();
        let (beams, shared) = x.rows_mut().split_at_mut(n);
        self.sweep(beams);
        let source = [
            shared[0].0[PLATE] + (self.plate_gain * beams[n - 1]).sum(),
            shared[0].0[FRAME] + self.frame_inflow(beams),
            shared[0].0[PACKAGE],
        ];
        let y = self
            .lumps
            .map(|row| row[0] * source[0] + row[1] * source[1] + row[2] * source[2]);
        shared[0] = PerActuator([y[0], y[1], y[2], 0.0]);
        for (x, row) in beams.iter_mut().zip(&self.rows) {
            *x = *x + row.to_frame * y[FRAME] + row.to_plate * y[PLATE];
        }
    }

    fn frame_inflow(&self, beams: &[PerActuator]) -> f64 {
        let fed = if self.warms_frame { beams.len() } else { 1 };
        let gain = |sum, (row, x): (&Factors, &PerActuator)| sum + row.frame_gain * *x;
        self.rows
            .iter()
            .zip(&beams[..fed])
            .fold(PerActuator::ZERO, gain)
            .sum()
    }

    /// The beams alone, frame and plate at zero.
    fn sweep(&self, beams: &mut [PerActuator]) {
        let mut x = PerActuator::ZERO;
        for (beam, row) in beams.iter_mut().zip(&self.rows) {
            x = *beam * row.pivot + x * row.carry;
            *beam = x;
        }
        let mut x = PerActuator::ZERO;
        for (beam, row) in beams.iter_mut().zip(&self.rows).rev() {
            x = *beam + x * row.back;
            *beam = x;
        }
    }
}

/// Inverse by cofactors; the complement is diagonally dominant.
fn invert(m: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let minor = |r: usize, c: usize| {
        let (a, b) = ((r + 1) % 3, (r + 2) % 3);
        let (d, e) = ((c + 1) % 3, (c + 2) % 3);
        m[a][d] * m[b][e] - m[a][e] * m[b][d]
    };
    let determinant: f64 = (0..3).map(|c| m[0][c] * minor(0, c)).sum();
    std::array::from_fn(|r| std::array::from_fn(|c| minor(c, r) / determinant))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MirrorConfig;
    use crate::build::Build;

    /// Frame, package and warm air, but no law that is not linear.
    fn linear_paper() -> MirrorConfig {
        let mut config = MirrorConfig::paper();
        config.effects = Default::default();
        config
    }

    #[test]
    fn the_solution_solves_the_heat_balance_it_was_made_from() {
        let network = Build::new(&linear_paper()).network;
        let cells = network.cells.len();
        let mut source = Field::zero(cells);
        for (i, row) in source.rows_mut().iter_mut().enumerate() {
            let wave = |actuator: usize| (0.7 * i as f64 + actuator as f64).sin();
            *row = PerActuator([
                wave(0),
                wave(1),
                wave(2),
                if i == cells { 0.0 } else { wave(3) },
            ]);
        }
        let cold = Field::zero(cells);
        for s in [1e-2, 10.0, 1e5] {
            let mut solver = Solver::new(cells);
            solver.factorise(
                &network,
                s,
                &Point {
                    theta: &cold,
                    heating: PerActuator::ZERO,
                },
            );
            let mut x = source.clone();
            solver.solve(&mut x);
            let mut rate = Field::zero(cells);
            network.rate(&x, PerActuator::ZERO, &mut rate);
            for ((x, rate), source) in x.rows().iter().zip(rate.rows()).zip(source.rows()) {
                for actuator in 0..4 {
                    let left = s * x.0[actuator] - rate.0[actuator];
                    // Rounding of terms of 1e5 and more, of which the difference is of order 1.
                    approx::assert_abs_diff_eq!(left, source.0[actuator], epsilon = 1e-7);
                }
            }
        }
    }
}
