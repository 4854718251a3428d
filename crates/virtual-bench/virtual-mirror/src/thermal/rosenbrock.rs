//! One step in time: ROS34PW2, a third-order, L-stable Rosenbrock method that keeps its order when the matrix is only the
//! linear conduction, not the full derivative (J. Rang and L. Angermann, BIT 45 (2005) 761).

use super::field::{Drive, Field};
use super::network::Network;
use super::solver::{Point, Solver};
use crate::per_actuator::PerActuator;

type Tableau = [[f64; 4]; 4];

const GAMMA: f64 = 4.358_665_215_084_59e-1;
const A: Tableau = [
    [0.0; 4],
    [8.717_330_430_169_18e-1, 0.0, 0.0, 0.0],
    [
        8.445_706_001_536_942e-1,
        -1.129_906_423_648_418_5e-1,
        0.0,
        0.0,
    ],
    [0.0, 0.0, 1.0, 0.0],
];
const G: Tableau = [
    [GAMMA, 0.0, 0.0, 0.0],
    [-8.717_330_430_169_18e-1, GAMMA, 0.0, 0.0],
    [
        -9.033_805_701_304_408e-1,
        5.418_067_238_809_532_6e-2,
        GAMMA,
        0.0,
    ],
    [B[0], B[1], 5.452_602_553_351_021e-1, GAMMA],
];
const B: [f64; 4] = [
    2.421_238_070_609_534_6e-1,
    -1.223_250_583_904_514_7,
    1.545_260_255_335_102,
    GAMMA,
];
/// Weights of the second-order solution that the error is measured against.
const B_LOW: [f64; 4] = [
    3.781_090_314_581_937e-1,
    -9.604_229_221_242_318e-2,
    0.5,
    2.179_326_607_542_295e-1,
];

/// The tableau in the variables that need no product with the matrix (Hairer and Wanner, Solving ODEs II, IV.7).
const G_INVERSE: Tableau = invert_lower(G);
const STAGE: Tableau = multiply(A, G_INVERSE);
const ERROR: [f64; 4] = {
    let mut difference = [[0.0; 4]; 4];
    let mut j = 0;
    while j < 4 {
        difference[0][j] = B[j] - B_LOW[j];
        j += 1;
    }
    multiply(difference, G_INVERSE)[0]
};
/// When within the step each stage stands.
const TIME: [f64; 4] = [0.0, A[1][0], A[2][0] + A[2][1], 1.0];

const fn invert_lower(m: Tableau) -> Tableau {
    let mut inverse = [[0.0; 4]; 4];
    let mut column = 0;
    while column < 4 {
        let mut row = column;
        while row < 4 {
            let mut sum = if row == column { 1.0 } else { 0.0 };
            let mut k = column;
            while k < row {
                sum -= m[row][k] * inverse[k][column];
                k += 1;
            }
            inverse[row][column] = sum / m[row][row];
            row += 1;
        }
        column += 1;
    }
    inverse
}

const fn multiply(a: Tableau, b: Tableau) -> Tableau {
    let mut product = [[0.0; 4]; 4];
    let mut n = 0;
    while n < 64 {
        product[n / 16][n % 4] += a[n / 16][n / 4 % 4] * b[n / 4 % 4][n % 4];
        n += 1;
    }
    product
}

/// How far drive (V2) and temperature (K) may move until the matrix is taken anew: a tenth of its diagonal.
const STALE_V2: f64 = 3.0;
const STALE_K: f64 = 20.0;

/// What a factorisation was made for.
#[derive(Clone, Copy, Debug, Default)]
struct Basis {
    step: f64,
    volts_squared: PerActuator,
    /// Temperature halfway along the beams.
    theta: PerActuator,
}

impl Basis {
    fn serves(&self, other: &Self) -> bool {
        let moved = |a: PerActuator, b: PerActuator| (a - b).abs().largest();
        self.step == other.step
            && moved(self.volts_squared, other.volts_squared) < STALE_V2
            && moved(self.theta, other.theta) < STALE_K
    }
}

/// Takes steps, keeping the factorisation while it serves.
#[derive(Clone, Debug)]
pub(crate) struct Stepper {
    solver: Solver,
    basis: Basis,
    stages: [Field; 4],
    rate: Field,
}

impl Stepper {
    pub(crate) fn new(cells: usize) -> Self {
        let zero = Field::zero(cells);
        Self {
            solver: Solver::new(cells),
            basis: Basis::default(),
            stages: [zero.clone(), zero.clone(), zero.clone(), zero.clone()],
            rate: zero,
        }
    }

    /// Takes a step of `h` seconds from `from`, where the rate of change is `rate`, into `to`; returns the estimated
    /// error of the second-order solution (K).
    pub(crate) fn step(
        &mut self,
        network: &Network,
        drive: &Drive,
        h: f64,
        (from, rate): (&Field, &Field),
        to: &mut Field,
    ) -> f64 {
        self.factorise(network, drive, h, from);
        let Self {
            solver,
            stages: [u1, u2, u3, u4],
            rate: slope,
            ..
        } = self;
        let back = |i: usize, j: usize| -G_INVERSE[i][j] / h;

        u1.rows_mut().copy_from_slice(rate.rows());
        solver.solve(u1);

        to.combine(from, [(STAGE[1][0], u1)]);
        network.rate(to, drive.at(TIME[1]), slope);
        u2.combine(slope, [(back(1, 0), u1)]);
        solver.solve(u2);

        to.combine(from, [(STAGE[2][0], u1), (STAGE[2][1], u2)]);
        network.rate(to, drive.at(TIME[2]), slope);
        u3.combine(slope, [(back(2, 0), u1), (back(2, 1), u2)]);
        solver.solve(u3);

        to.combine(
            from,
            [(STAGE[3][0], u1), (STAGE[3][1], u2), (STAGE[3][2], u3)],
        );
        network.rate(to, drive.at(TIME[3]), slope);
        u4.combine(
            slope,
            [(back(3, 0), u1), (back(3, 1), u2), (back(3, 2), u3)],
        );
        solver.solve(u4);

        // The method is stiffly accurate: the last stage's argument plus the last stage is the solution.
        let rows = to
            .rows_mut()
            .iter_mut()
            .zip(u1.rows())
            .zip(u2.rows().iter().zip(u3.rows()))
            .zip(u4.rows());
        let mut worst = PerActuator::ZERO;
        for (((to, u1), (u2, u3)), u4) in rows {
            *to += *u4;
            worst = worst
                .max((*u1 * ERROR[0] + *u2 * ERROR[1] + *u3 * ERROR[2] + *u4 * ERROR[3]).abs());
        }
        worst.largest()
    }

    fn factorise(&mut self, network: &Network, drive: &Drive, h: f64, from: &Field) {
        let volts = drive.at(0.5);
        let theta = from.beams()[from.beams().len() / 2];
        let basis = Basis {
            step: h,
            volts_squared: volts * volts,
            theta,
        };
        if !self.basis.serves(&basis) {
            let current = volts / network.resistance(from);
            let at = Point {
                theta: from,
                heating: current * current,
            };
            self.solver.factorise(network, 1.0 / (GAMMA * h), &at);
            self.basis = basis;
        }
    }
}
