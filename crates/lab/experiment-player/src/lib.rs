//! Experiments as a board plays them, and its samples as a measurement file's rows.
//!
//! The tool plays them on a board over its link, the closed loop on the control core alone; both read the same ticks and
//! make the same rows of them.
//!
//! - [`pieces`] turns an experiment into waveforms, each with the ticks that are to be sampled;
//! - [`rows`] turns the samples of a piece into rows.

mod piece;
mod rows;
mod waveform;

pub use piece::{Piece, RowKind, pieces};
pub use rows::{Clock, decimal, rows};
pub use waveform::{PlayError, ticks};
