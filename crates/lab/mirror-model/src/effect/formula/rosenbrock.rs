//! A step of states whose time constants nobody knows: an exponential Rosenbrock method.
//!
//! Of `s' = f(s, u)` the method solves what is linear in the states and in the input exactly, however long the step is beside the time
//! constants, and the rest to second order: the exponential Rosenbrock-Euler method with its term for an input that runs straight (M. Hochbruck,
//! A. Ostermann and J. Schweitzer, SIAM J. Numer. Anal. 47 (2009) 786, eq. 2.7).

use crate::effect::size::MOST_STATES;

/// States, the time within the step, and one.
const MOST: usize = MOST_STATES + 2;
/// A state is moved by this part of its size or of its way, to see what that does to the rates: the square root of what numbers resolve.
const MOVED: f64 = 1.5e-8;
/// And by this at least, in any unit.
const LEAST: f64 = 1e-12;
/// Where a slope is less than this part of a step, its exponential is a parabola: to 1e-11, as far as differences tell the others.
const STRAIGHT: f64 = 1e-5;
/// Terms of the exponential's series; of a matrix whose norm is a half at most they leave 1e-14.
const TERMS: usize = 11;

type Matrix = [[f64; MOST]; MOST];
/// Of each state; of those that there are not, anything.
pub(super) type Rates = [f64; MOST_STATES];

/// Moves states on by `h` seconds. `rates` are theirs with the input at the step's start, or at its end.
pub(super) fn step(state: &mut [f64], h: f64, rates: impl Fn(&[f64], At) -> Rates) {
    let here = rates(state, At::Start);
    let with_input = rates(state, At::End);
    let n = state.len();
    let slopes = |column: usize| -> Rates {
        let mut moved = [0.0; MOST_STATES];
        moved[..n].copy_from_slice(state);
        moved[column] += MOVED * state[column].abs().max((h * here[column]).abs()) + LEAST;
        let by = moved[column] - state[column];
        let there = rates(&moved[..n], At::Start);
        std::array::from_fn(|row| (there[row] - here[row]) / by)
    };
    if n == 1 {
        let [slope, ..] = slopes(0);
        state[0] += alone(h * slope, h * here[0], h * (with_input[0] - here[0]));
        return;
    }
    let columns: Vec<Rates> = (0..n).map(slopes).collect();
    let mut matrix = Matrix::default();
    let rates = here.iter().zip(&with_input);
    for (row, (out, (here, with_input))) in matrix.iter_mut().zip(rates).take(n).enumerate() {
        for (out, column) in out.iter_mut().zip(&columns) {
            *out = h * column[row];
        }
        out[n] = h * (with_input - here);
        out[n + 1] = h * here;
    }
    matrix[n][n + 1] = 1.0;
    let grown = exponential(matrix, n + 2);
    for (row, s) in state.iter_mut().enumerate() {
        *s += grown[row][n + 1];
    }
}

/// By how much a single state changes over a step, with its slope, its rate and what the input adds to that, each times the step.
fn alone(slope: f64, rate: f64, by_input: f64) -> f64 {
    let (mean, lever) = if slope.abs() < STRAIGHT {
        (1.0 + slope / 2.0, 0.5 + slope / 6.0)
    } else {
        let mean = slope.exp_m1() / slope;
        (mean, (mean - 1.0) / slope)
    };
    rate * mean + by_input * lever
}

/// Which of a step's ends an input is taken at.
#[derive(Clone, Copy)]
pub(super) enum At {
    Start,
    End,
}

/// The exponential of the first `n` rows and columns, by scaling and squaring (N. Higham, Functions of Matrices, SIAM 2008, ch. 10).
fn exponential(mut matrix: Matrix, n: usize) -> Matrix {
    let norm = matrix
        .iter()
        .map(|row| row.iter().map(|it| it.abs()).sum::<f64>())
        .fold(0.0, f64::max);
    if !norm.is_finite() {
        return [[f64::NAN; MOST]; MOST];
    }
    let halvings = norm.log2().ceil().max(-1.0) as i32 + 1;
    let scale = 0.5_f64.powi(halvings);
    matrix
        .as_flattened_mut()
        .iter_mut()
        .for_each(|it| *it *= scale);
    let mut sum = identity();
    for term in (1..=TERMS).rev() {
        let factor = 1.0 / term as f64;
        sum = product(&matrix, &sum, n);
        sum.as_flattened_mut()
            .iter_mut()
            .for_each(|it| *it *= factor);
        for (k, row) in sum.iter_mut().enumerate() {
            row[k] += 1.0;
        }
    }
    for _ in 0..halvings {
        sum = product(&sum, &sum, n);
    }
    sum
}

fn identity() -> Matrix {
    let mut one = Matrix::default();
    for (k, row) in one.iter_mut().enumerate() {
        row[k] = 1.0;
    }
    one
}

fn product(a: &Matrix, b: &Matrix, n: usize) -> Matrix {
    let mut c = Matrix::default();
    for i in 0..n {
        for k in 0..n {
            for j in 0..n {
                c[i][j] += a[i][k] * b[k][j];
            }
        }
    }
    c
}

#[cfg(test)]
mod tests {
    use super::*;

    fn each(rates: impl Iterator<Item = f64>) -> Rates {
        let mut each = Rates::default();
        each.iter_mut().zip(rates).for_each(|(to, rate)| *to = rate);
        each
    }

    /// Lags in a row, each following the one before it, the first an input that runs from 1 to 3.
    fn lags(times_s: &[f64], state: &[f64], at: At) -> Rates {
        let input = match at {
            At::Start => 1.0,
            At::End => 3.0,
        };
        let before = |i: usize| if i == 0 { input } else { state[i - 1] };
        let rate = |(i, time_s): (usize, &f64)| (before(i) - state[i]) / time_s;
        each(times_s.iter().enumerate().map(rate))
    }

    /// One step is what a thousand parts of it are: a lag is linear. To what the differences of the rates resolve.
    #[test]
    fn a_linear_lag_is_exact_however_long_the_step() {
        for tau_s in [1e-4, 0.05, 0.2, 2.0, 1e3] {
            let mut state = [0.5];
            step(&mut state, 2.0, |state, at| lags(&[tau_s], state, at));
            // s' = (u - s) / tau, u = 1 + t, from 0.5: u - tau + (0.5 - 1 + tau) exp(-t / tau).
            let exact = 3.0 - tau_s + (tau_s - 0.5) * f64::exp(-2.0 / tau_s);
            assert!(
                (state[0] - exact).abs() < 1e-6,
                "{tau_s}: {} {exact}",
                state[0]
            );
        }
    }

    /// The same for two at once, each of which is alone.
    #[test]
    fn one_state_is_one_of_many() {
        for slope in [-1e4, -3.0, -1e-3, -1e-7, 0.0, 0.5] {
            let mut two = [1.0, 1.0];
            let rates = |s: &[f64], at: At| -> Rates {
                let input = if let At::End = at { 0.75 } else { 0.5 };
                each(s.iter().map(|s| slope * s + input))
            };
            step(&mut two, 1.0, rates);
            let mut one = [1.0];
            step(&mut one, 1.0, rates);
            assert!((one[0] - two[0]).abs() < 1e-6, "{slope}: {one:?} {two:?}");
            assert!((two[1] - two[0]).abs() < 1e-9, "{slope}: {two:?}");
        }
    }

    #[test]
    fn lags_in_a_row_settle_in_one_step_where_all_are_fast() {
        let mut state = [0.0; 3];
        let times_s = [1e-3, 3e-3, 2e-4];
        step(&mut state, 1.0, |state, at| lags(&times_s, state, at));
        // Each is late by the lags up to it, in which the input passes 2 a second.
        let late_s = [1e-3, 4e-3, 4.2e-3];
        for (s, late_s) in state.iter().zip(late_s) {
            assert!((s - (3.0 - 2.0 * late_s)).abs() < 1e-6, "{state:?}");
        }
    }

    /// s' = -s^2 from 1 is 1 / (1 + t).
    #[test]
    fn what_is_not_linear_is_followed_to_second_order() {
        let off = |parts: usize| {
            let mut state = [1.0];
            for _ in 0..parts {
                step(&mut state, 1.0 / parts as f64, |s, _| {
                    [-s[0] * s[0]; MOST_STATES]
                });
            }
            (state[0] - 0.5).abs()
        };
        let ratio = off(8) / off(16);
        assert!((3.0..5.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn rates_without_a_value_leave_states_without_one() {
        let mut state = [1.0];
        step(&mut state, 1.0, |_, _| [f64::NAN; MOST_STATES]);
        assert!(state[0].is_nan());
    }
}
