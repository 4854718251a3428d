//! Solves `(s - J) x = r` for the conduction matrix `J`: four tridiagonal beams at once, the shared bodies by their Schur
//! complement.

use super::{FRAME, Field, Network, PACKAGE, PLATE};
use crate::lanes::Lanes;

/// One row of the factorised beams.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    /// Forward: `y = r pivot + y_previous carry`.
    pivot: Lanes,
    carry: Lanes,
    /// Backward: `x = y + x_next back`.
    back: Lanes,
    /// Response to one kelvin of the frame and of the plate.
    to_frame: Lanes,
    to_plate: Lanes,
}

/// The factorised matrix for one shift `s`.
#[derive(Clone, Debug)]
pub(crate) struct Solver {
    rows: Vec<Row>,
    /// What the ends of the beams feed into frame and plate.
    frame_gain: Lanes,
    plate_gain: Lanes,
    /// Inverse of the Schur complement of the shared bodies.
    lumps: [[f64; 3]; 3],
}

impl Solver {
    pub(crate) fn new(cells: usize) -> Self {
        Self {
            rows: vec![Row::default(); cells],
            frame_gain: Lanes::ZERO,
            plate_gain: Lanes::ZERO,
            lumps: [[0.0; 3]; 3],
        }
    }

    /// Factorises for the shift `s` (1/s).
    pub(crate) fn factorise(&mut self, network: &Network, s: f64) {
        self.factorise_beams(network, s);
        let n = self.rows.len();
        let last = &network.cells[n - 1];
        let from_frame = network.to_frame * network.cells[0].inv_capacity;
        let from_plate = last.to_next * last.inv_capacity;
        self.respond(|row, x| row.to_frame = x, 0, from_frame);
        self.respond(|row, x| row.to_plate = x, n - 1, from_plate);
        self.frame_gain = network.to_frame * network.lumps[FRAME].inv_capacity;
        self.plate_gain = last.to_next * network.lumps[PLATE].inv_capacity;
        self.lumps = invert(self.schur_complement(network, s));
    }

    fn factorise_beams(&mut self, network: &Network, s: f64) {
        let mut inflow = network.to_frame;
        let mut previous = Row::default();
        for (i, (row, cell)) in self.rows.iter_mut().zip(&network.cells).enumerate() {
            let below = if i == 0 {
                Lanes::ZERO
            } else {
                inflow * cell.inv_capacity
            };
            let diagonal =
                Lanes::splat(s) + (inflow + cell.to_next + cell.to_air) * cell.inv_capacity;
            row.pivot = Lanes::splat(1.0) / (diagonal - below * previous.back);
            row.carry = below * row.pivot;
            row.back = cell.to_next * cell.inv_capacity * row.pivot;
            inflow = cell.to_next;
            previous = *row;
        }
        if let Some(last) = self.rows.last_mut() {
            last.back = Lanes::ZERO;
        }
    }

    /// Stores the beams' response to a source in one cell.
    fn respond(&mut self, store: impl Fn(&mut Row, Lanes), at: usize, source: Lanes) {
        let mut response = vec![Lanes::ZERO; self.rows.len()];
        response[at] = source;
        self.sweep(&mut response);
        for (row, x) in self.rows.iter_mut().zip(response) {
            store(row, x);
        }
    }

    fn schur_complement(&self, network: &Network, s: f64) -> [[f64; 3]; 3] {
        let (first, last) = (self.rows[0], self.rows[self.rows.len() - 1]);
        let capacity = |k: usize| network.lumps[k].inv_capacity;
        let room = |k: usize| network.lumps[k].to_room * capacity(k);
        let down = network.frame_to_package;
        let mut m = [[0.0; 3]; 3];
        m[PLATE][PLATE] =
            s + room(PLATE) + self.plate_gain.sum() - (self.plate_gain * last.to_plate).sum();
        m[PLATE][FRAME] = -(self.plate_gain * last.to_frame).sum();
        m[FRAME][FRAME] = s + room(FRAME) + down * capacity(FRAME) + self.frame_gain.sum()
            - (self.frame_gain * first.to_frame).sum();
        m[FRAME][PLATE] = -(self.frame_gain * first.to_plate).sum();
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
            shared[0].0[FRAME] + (self.frame_gain * beams[0]).sum(),
            shared[0].0[PACKAGE],
        ];
        let y = self
            .lumps
            .map(|row| row[0] * source[0] + row[1] * source[1] + row[2] * source[2]);
        shared[0] = Lanes([y[0], y[1], y[2], 0.0]);
        for (x, row) in beams.iter_mut().zip(&self.rows) {
            *x = *x + row.to_frame * y[FRAME] + row.to_plate * y[PLATE];
        }
    }

    /// The beams alone, frame and plate at zero.
    fn sweep(&self, beams: &mut [Lanes]) {
        let mut x = Lanes::ZERO;
        for (beam, row) in beams.iter_mut().zip(&self.rows) {
            x = *beam * row.pivot + x * row.carry;
            *beam = x;
        }
        let mut x = Lanes::ZERO;
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
