//! What an option of `measure` is where it is left out. The command lines that the tool proposes leave it out, too.

pub(crate) const MAX: &str = "3.5V";
pub(crate) const SWEEP_STEPS: u32 = 35;
pub(crate) const SINGLE_STEPS: u32 = 7;
pub(crate) const DWELL: &str = "1s";
pub(crate) const STEP_TO: &str = "2V";
pub(crate) const HOLD: &str = "30s";
pub(crate) const RATE: &str = "5kHz";
pub(crate) const MEAN: &str = "1V";
pub(crate) const AMPLITUDE: &str = "0.5V";
pub(crate) const FREQUENCY: &str = "1Hz";
pub(crate) const CYCLES: u32 = 3;
pub(crate) const REFERENCE_FILE: &str = "reference.csv";
