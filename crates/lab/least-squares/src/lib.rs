//! Least squares within bounds.
//!
//! - [`minimise`] fits nonlinear parameters: Levenberg and Marquardt's damped Gauss-Newton steps, each of them the exact
//!   solution of a bounded linear problem. What cannot be computed at a trial point only rejects the step;
//! - [`bounded`] and [`nonnegative`] solve linear problems within bounds by active sets;
//! - [`forward_differences`] and [`central_differences`] make Jacobians that stay inside the bounds.
//!
//! `docs/theory/least-squares.md` derives the methods, and tells what they were compared with.

mod bounds;
mod differences;
mod linear;
mod linear_model;
mod minimise;
mod problem;
mod solution;

pub use bounds::Bounds;
pub use differences::{DifferenceStep, central_differences, forward_differences};
pub use linear::{bounded, nonnegative, normal_factor};
pub use minimise::{JacobianUpdates, Options, minimise};
pub use problem::{Prior, Problem};
pub use solution::{MinimiseError, Solution, Termination};
