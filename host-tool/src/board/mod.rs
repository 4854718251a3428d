//! A board, wherever it is: found, opened, greeted, asked.

mod find;
mod link;
mod socket;

pub use find::{Found, Place, choose, find};
pub use link::{Board, Samples};
