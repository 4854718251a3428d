//! How many bytes a calibration has, in each of the formats that are read.

use super::origin::Label;
use super::stages::{FAST_POLES, LAGS, PLAYS, POLES, SENSED_RISES, SLOW_POLES};
use crate::CHANNELS;
use crate::shape::KNOTS;

/// The version of this layout and of what the numbers mean.
pub(super) const FORMAT: u16 = 13;
/// The one that was tried wholly or not at all.
pub(super) const WITHOUT_TRIED: u16 = 12;
/// The one whose heaters see the others' heat as the bend does.
pub(super) const WITHOUT_CROSSTALK: u16 = 11;
/// The one in which no actuator is slower than the others.
pub(super) const WITHOUT_SLOWER: u16 = 10;
/// The one whose time constants do not grow.
pub(super) const WITHOUT_TIME_GROWTH: u16 = 9;
/// The one without a lag of the beams.
pub(super) const WITHOUT_LAG: u16 = 8;
/// The one without a resonance.
pub(super) const WITHOUT_RESONANCE: u16 = 7;
/// The one without heat that the actuators share.
pub(super) const WITHOUT_SHARED: u16 = 6;
/// The one that does not say what it leaves unknown.
pub(super) const WITHOUT_RESIDUAL: u16 = 5;
/// The one that knows nothing of surroundings.
pub(super) const WITHOUT_SURROUNDINGS: u16 = 4;
/// The one without levers.
pub(super) const WITHOUT_LEVERS: u16 = 3;

pub(super) const MAGIC: [u8; 4] = *b"EMCA";

const ACTUATOR_NUMBERS: usize = 5 + KNOTS;
const SHARED_NUMBERS: usize = 2 * (FAST_POLES + SLOW_POLES + PLAYS + LAGS) + 5;
const LEVER_NUMBERS: usize = 3 * CHANNELS;
const SURROUNDINGS_NUMBERS: usize = CHANNELS * (1 + SENSED_RISES) + 1;
const RESIDUAL_NUMBERS: usize = 4;
const SHARED_PARTS: usize = POLES;
const RESONANCE_NUMBERS: usize = 2;
const LAG_NUMBERS: usize = 1;
const TIME_GROWTH_NUMBERS: usize = 1;
const SLOWER_NUMBERS: usize = CHANNELS;
const CROSSTALK_NUMBERS: usize = 1;
const TRIED_NUMBERS: usize = 1;
pub(super) const HEAD: usize = MAGIC.len() + 2 + 2 * Label::CAPACITY + 8;

/// Bytes of a calibration.
pub const BYTES: usize = BYTES_WITHOUT_TRIED + 4 * TRIED_NUMBERS;
pub(super) const BYTES_WITHOUT_TRIED: usize = BYTES_WITHOUT_CROSSTALK + 4 * CROSSTALK_NUMBERS;
pub(super) const BYTES_WITHOUT_CROSSTALK: usize = BYTES_WITHOUT_SLOWER + 4 * SLOWER_NUMBERS;
pub(super) const BYTES_WITHOUT_SLOWER: usize = BYTES_WITHOUT_TIME_GROWTH + 4 * TIME_GROWTH_NUMBERS;
pub(super) const BYTES_WITHOUT_TIME_GROWTH: usize = BYTES_WITHOUT_LAG + 4 * LAG_NUMBERS;
pub(super) const BYTES_WITHOUT_LAG: usize = BYTES_WITHOUT_RESONANCE + 4 * RESONANCE_NUMBERS;
pub(super) const BYTES_WITHOUT_RESONANCE: usize = BYTES_WITHOUT_SHARED + 4 * SHARED_PARTS;
pub(super) const BYTES_WITHOUT_SHARED: usize = BYTES_WITHOUT_RESIDUAL + 4 * RESIDUAL_NUMBERS;
pub(super) const BYTES_WITHOUT_RESIDUAL: usize =
    BYTES_WITHOUT_SURROUNDINGS + 4 * SURROUNDINGS_NUMBERS;
pub(super) const BYTES_WITHOUT_SURROUNDINGS: usize = BYTES_WITHOUT_LEVERS + 4 * LEVER_NUMBERS;
pub(super) const BYTES_WITHOUT_LEVERS: usize =
    HEAD + 4 * (CHANNELS * ACTUATOR_NUMBERS + SHARED_NUMBERS) + 4;

/// How many bytes a calibration has that begins like this; those of the present format where it is of none.
pub fn record_bytes(bytes: &[u8]) -> usize {
    let format = bytes.get(MAGIC.len()..MAGIC.len() + 2);
    let is_of = |of: u16| format == Some(&of.to_le_bytes());
    if is_of(WITHOUT_LEVERS) {
        BYTES_WITHOUT_LEVERS
    } else if is_of(WITHOUT_SURROUNDINGS) {
        BYTES_WITHOUT_SURROUNDINGS
    } else if is_of(WITHOUT_RESIDUAL) {
        BYTES_WITHOUT_RESIDUAL
    } else if is_of(WITHOUT_SHARED) {
        BYTES_WITHOUT_SHARED
    } else if is_of(WITHOUT_RESONANCE) {
        BYTES_WITHOUT_RESONANCE
    } else if is_of(WITHOUT_LAG) {
        BYTES_WITHOUT_LAG
    } else if is_of(WITHOUT_TIME_GROWTH) {
        BYTES_WITHOUT_TIME_GROWTH
    } else if is_of(WITHOUT_SLOWER) {
        BYTES_WITHOUT_SLOWER
    } else if is_of(WITHOUT_CROSSTALK) {
        BYTES_WITHOUT_CROSSTALK
    } else if is_of(WITHOUT_TRIED) {
        BYTES_WITHOUT_TRIED
    } else {
        BYTES
    }
}
