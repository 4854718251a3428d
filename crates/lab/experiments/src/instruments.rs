//! How exactly the bench reads, where a measurement does not say so itself.

/// Standard deviation of one reading of a position sensor (um): what the paper's vibrometer resolves at 10 kHz.
pub const POSITION_NOISE_UM: f64 = 0.02;

/// Standard deviation of a current reading (A), the part that does not depend on the current. The driver board's converter
/// alone has 0.9 uA (`docs/board.md`: steps of 3.05 uA, 1.2 of them as noise, 16 conversions); twice that leaves room for
/// what a bench picks up.
pub const CURRENT_NOISE_A: f64 = 2e-6;

/// The part of it that is in proportion to the current: what a meter's last digit of five is, a choice.
pub const CURRENT_NOISE_RATIO: f64 = 1e-4;

/// A reading at the end of a dwell is the mean over so long (s), or over a quarter of the dwell: a period of the mains.
pub const MEAN_S: f64 = 0.02;

/// Voltage at which an idle actuator's resistance is sensed (V): 0.1 mW, which heats it by about 0.1 K.
pub const SENSE_BIAS_V: f64 = 0.2;
