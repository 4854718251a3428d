//! NIST's reference sets of nonlinear regression, all 27 from both starts.
//!
//! `cargo test -p least-squares --test strd -- --nocapture` prints the table.

use least_squares::{
    Bounds, DifferenceStep, Options, Problem, Solution, central_differences, minimise,
};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::PI;
use std::path::Path;

/// A model's prediction at predictors `x` with parameters `b`.
type Model = fn(b: &[f64], x: &[f64]) -> f64;

fn gaussians(b: &[f64], x: &[f64]) -> f64 {
    let bell =
        |height: f64, centre: f64, width: f64| height * (-((x[0] - centre) / width).powi(2)).exp();
    b[0] * (-b[1] * x[0]).exp() + bell(b[2], b[3], b[4]) + bell(b[5], b[6], b[7])
}

fn exponentials(b: &[f64], x: &[f64]) -> f64 {
    b.chunks(2).map(|b| b[0] * (-b[1] * x[0]).exp()).sum()
}

fn chwirut(b: &[f64], x: &[f64]) -> f64 {
    (-b[0] * x[0]).exp() / (b[1] + b[2] * x[0])
}

fn cubics(b: &[f64], x: &[f64]) -> f64 {
    let x = x[0];
    (b[0] + x * (b[1] + x * (b[2] + x * b[3]))) / (1.0 + x * (b[4] + x * (b[5] + x * b[6])))
}

fn quadratics(b: &[f64], x: &[f64]) -> f64 {
    let x = x[0];
    (b[0] + x * (b[1] + x * b[2])) / (1.0 + x * (b[3] + x * b[4]))
}

fn enso(b: &[f64], x: &[f64]) -> f64 {
    let wave = |cosine: f64, sine: f64, period: f64| {
        let phase = 2.0 * PI * x[0] / period;
        cosine * phase.cos() + sine * phase.sin()
    };
    b[0] + wave(b[1], b[2], 12.0) + wave(b[4], b[5], b[3]) + wave(b[7], b[8], b[6])
}

/// The sets from the lowest level of difficulty to the highest, as NIST orders them.
const SETS: [(&str, Model); 27] = [
    ("Misra1a", |b, x| b[0] * (1.0 - (-b[1] * x[0]).exp())),
    ("Chwirut2", chwirut),
    ("Chwirut1", chwirut),
    ("Lanczos3", exponentials),
    ("Gauss1", gaussians),
    ("Gauss2", gaussians),
    ("DanWood", |b, x| b[0] * x[0].powf(b[1])),
    ("Misra1b", |b, x| {
        b[0] * (1.0 - (1.0 + b[1] * x[0] / 2.0).powi(-2))
    }),
    ("Kirby2", quadratics),
    ("Hahn1", cubics),
    ("Nelson", |b, x| b[0] - b[1] * x[0] * (-b[2] * x[1]).exp()),
    ("MGH17", |b, x| {
        b[0] + b[1] * (-x[0] * b[3]).exp() + b[2] * (-x[0] * b[4]).exp()
    }),
    ("Lanczos1", exponentials),
    ("Lanczos2", exponentials),
    ("Gauss3", gaussians),
    ("Misra1c", |b, x| {
        b[0] * (1.0 - (1.0 + 2.0 * b[1] * x[0]).powf(-0.5))
    }),
    ("Misra1d", |b, x| b[0] * b[1] * x[0] / (1.0 + b[1] * x[0])),
    ("Roszman1", |b, x| {
        b[0] - b[1] * x[0] - (b[2] / (x[0] - b[3])).atan() / PI
    }),
    ("ENSO", enso),
    ("MGH09", |b, x| {
        b[0] * (x[0] * x[0] + x[0] * b[1]) / (x[0] * x[0] + x[0] * b[2] + b[3])
    }),
    ("Thurber", cubics),
    ("BoxBOD", |b, x| b[0] * (1.0 - (-b[1] * x[0]).exp())),
    ("Rat42", |b, x| b[0] / (1.0 + (b[1] - b[2] * x[0]).exp())),
    ("MGH10", |b, x| b[0] * (b[1] / (x[0] + b[2])).exp()),
    ("Eckerle4", |b, x| {
        b[0] / b[1] * (-0.5 * ((x[0] - b[2]) / b[1]).powi(2)).exp()
    }),
    ("Rat43", |b, x| {
        b[0] / (1.0 + (b[1] - b[2] * x[0]).exp()).powf(1.0 / b[3])
    }),
    ("Bennett5", |b, x| b[0] * (b[1] + x[0]).powf(-1.0 / b[2])),
];

/// A set, read from NIST's file.
struct Set {
    model: Model,
    starts: [Vec<f64>; 2],
    certified: Vec<f64>,
    standard_deviations: Vec<f64>,
    sum_of_squares: f64,
    y: Vec<f64>,
    x: Vec<Vec<f64>>,
}

impl Set {
    fn read(name: &'static str, model: Model) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/strd");
        let text = std::fs::read_to_string(folder.join(format!("{name}.dat"))).unwrap();
        let numbers = |line: &str| -> Vec<f64> {
            line.split_whitespace()
                .filter_map(|word| word.parse().ok())
                .collect()
        };
        let lines: Vec<_> = text.lines().collect();
        let parameters: Vec<_> = lines
            .iter()
            .filter(|line| line.trim_start().starts_with('b') && line.contains(" ="))
            .map(|line| numbers(line))
            .filter(|row| row.len() == 4)
            .collect();
        let column = |k: usize| parameters.iter().map(|row| row[k]).collect::<Vec<_>>();
        let sum = lines
            .iter()
            .find(|line| line.starts_with("Residual Sum of Squares:"));
        let heading = lines
            .iter()
            .rposition(|line| line.starts_with("Data:"))
            .unwrap();
        let rows = lines[heading + 1..].iter().map(|line| numbers(line));
        let rows: Vec<_> = rows.filter(|row| !row.is_empty()).collect();
        Self {
            model,
            starts: [column(0), column(1)],
            certified: column(2),
            standard_deviations: column(3),
            sum_of_squares: numbers(sum.unwrap())[0],
            // Nelson's model is of the logarithm.
            y: rows
                .iter()
                .map(|row| {
                    if name == "Nelson" {
                        row[0].ln()
                    } else {
                        row[0]
                    }
                })
                .collect(),
            x: rows.iter().map(|row| row[1..].to_vec()).collect(),
        }
    }

    /// Fitted as tightly as central differences allow.
    fn fit(&self, start: usize) -> Solution {
        let options = Options {
            cost_tolerance: 1e-14,
            step_tolerance: 1e-12,
            gradient_tolerance: 1e-13,
            max_evaluations: 5000,
            ..Options::default()
        };
        minimise(
            self,
            &DVector::from_column_slice(&self.starts[start]),
            &options,
        )
        .unwrap()
    }
}

impl Problem for Set {
    fn residuals(&self, b: &DVector<f64>) -> Option<DVector<f64>> {
        let rows = self.x.iter().zip(&self.y);
        let rows = rows.map(|(x, y)| (self.model)(b.as_slice(), x) - y);
        Some(DVector::from_iterator(self.y.len(), rows))
    }

    fn jacobian(
        &self,
        b: &DVector<f64>,
        here: &DVector<f64>,
        bounds: &Bounds,
    ) -> Option<DMatrix<f64>> {
        let step = DifferenceStep::CENTRAL;
        central_differences(|at| self.residuals(at), b, here, bounds, step)
    }
}

/// Significant digits that a number shares with a certified one (NIST's log relative error), at most the 11 that NIST gives.
fn digits(found: f64, certified: f64) -> f64 {
    let digits = -((found - certified) / certified).abs().log10();
    if digits.is_nan() {
        0.0
    } else {
        digits.clamp(0.0, 11.0)
    }
}

fn least_digits<'a>(found: impl IntoIterator<Item = &'a f64>, certified: &[f64]) -> f64 {
    let digits = found
        .into_iter()
        .zip(certified)
        .map(|(f, c)| digits(*f, *c));
    digits.fold(f64::INFINITY, f64::min)
}

#[test]
fn all_sets_give_their_certified_values_from_both_starts() {
    println!("set       start  digits of b   of sd   of the sum  evaluations  jacobians  end");
    let mut short = Vec::new();
    let mut evaluations = 0;
    for (name, model) in SETS {
        let set = Set::read(name, model);
        for start in 0..2 {
            let fit = set.fit(start);
            let b = least_digits(&fit.parameters, &set.certified);
            let sd = fit.standard_errors().map_or(0.0, |errors| {
                least_digits(&errors, &set.standard_deviations)
            });
            let sum = digits(fit.cost, set.sum_of_squares);
            println!(
                "{name:9} {:5} {b:12.1} {sd:7.1} {sum:12.1} {:12} {:10}  {:?}",
                start + 1,
                fit.evaluations,
                fit.jacobians,
                fit.termination
            );
            evaluations += fit.evaluations;
            if b < 6.0 || !fit.termination.is_converged() {
                short.push((name, start + 1));
            }
        }
    }
    println!("{evaluations} evaluations in all");
    assert_eq!(short, [], "fewer than 6 digits, or not converged");
}
