//! One number that was measured, and what it is of.

/// What is observed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// The displacement.
    Displacement,
    /// The current of an actuator, from 0.
    Current(usize),
}

/// One number that was measured.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// Index of the interval at whose end it was measured.
    pub interval: usize,
    /// What it is of.
    pub channel: Channel,
    /// The number, in um or A.
    pub value: f64,
    /// Its white noise, one standard deviation.
    pub noise: f64,
    /// Index of its experiment in [`Dataset::experiments`](super::Dataset::experiments).
    pub experiment: usize,
    /// Time from its file's start.
    pub t_s: f64,
}
