//! What a host, a calibration or a broken output stage may do to a mirror, and what the protection makes of it.

mod bench;
#[path = "../common/mod.rs"]
mod common;
mod hottest;
mod plant;
mod stuck;
