//! How the flash is divided.

/// The fault log's part, the first: eight pages of the STM32G474.
pub const LOG_BYTES: usize = 16 * 1024;
/// The calibrations' part, behind it.
pub const CALIBRATION_BYTES: usize = 32 * 1024;
/// All of it, which is every board's.
pub const FLASH_BYTES: usize = LOG_BYTES + CALIBRATION_BYTES;
