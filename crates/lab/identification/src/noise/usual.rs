//! The noise of usual instruments, for readings of which no file says it.

use measurement::CurrentNoise;

/// White noise of the displacement where a file does not say `noise_z_nm`, one standard deviation: that of a laser displacement sensor, and of the
/// virtual bench's (`virtual-sessions`).
pub(super) const DISPLACEMENT_UM: f64 = 0.02;
/// Noise of a current: that of a reading of the driver board (`docs/board.md`), constant, and as a part of the reading.
pub(super) const USUAL: CurrentNoise = CurrentNoise {
    constant_a: 2e-6,
    ratio: 1e-4,
};
