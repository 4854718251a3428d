//! Where the heat goes: four beams of cells side by side, and the bodies they share.

pub(crate) mod field;
mod network;
mod rosenbrock;
mod solver;

pub(crate) use field::{Drive, Field};
pub(crate) use network::{Cell, LumpNode, Network};
pub(crate) use rosenbrock::Stepper;
