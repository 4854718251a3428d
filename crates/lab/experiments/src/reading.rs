//! When an experiment is read.

/// After a step each reading waits for a twentieth of the time since the step: 14 readings for each doubling of it, evenly
/// on the logarithmic axis on which thermal poles are told apart.
pub const SLOWING: u16 = 20;

/// When an experiment is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// At the end of every dwell.
    EndOfDwell,
    /// After every step, and then ever more slowly: each reading waits for a [`SLOWING`]th of the time since the step at
    /// least.
    AfterSteps {
        /// Readings a second just after a step (Hz); infinity is as fast as the board can.
        rate_hz: f64,
    },
    /// Evenly, at most so often in a run's whole length.
    Evenly {
        /// How often.
        readings: u32,
    },
}
