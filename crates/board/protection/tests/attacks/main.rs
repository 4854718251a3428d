//! What a host, a calibration or a broken output stage may do to a mirror, and what the protection makes of it.

mod bench;
mod hottest;
mod plant;
mod stuck;
