//! A session against a model that a person changes: curves and errors by experiment and by stage.
//!
//! - [`Curves`]: what was measured and what a model says of it, point by point;
//! - [`View`]: those drawn, with their errors as they are printed;
//! - [`catalogue()`]: the effects that can be switched on, with the ranges of their parameters;
//! - [`Desk`]: a session on which models are tried, by requests and answers in JSON. The tool's report page has it as
//!   WebAssembly (`lab-view-wasm`), so that what the page says is what the tool says.

mod catalogue;
mod curves;
mod desk;
mod view;

pub use catalogue::{Entry, catalogue};
pub use curves::{Curve, Curves};
pub use desk::{Chosen, Desk, MeasuredText, Opening, Request};
pub use view::{ExperimentView, StageView, View};
