//! Which poles a mirror is followed with: those of its calibration, and slow ones where it lacks them, as that of the factory does. These weigh
//! nothing, but another calibration may have them that takes its place.

use crate::calibration::{Heat, Lag, POLES, SLOW_POLES};
use crate::lag::{SlowLag, TURNS};
use crate::units::Second;

/// The weight of what is followed without any: what that adds of 300 K is lost in the rounding of a millikelvin.
const HARDLY: f32 = 1e-13;
/// Times of slow poles that a calibration lacks (s): about those of the frames of the paper's mirror and of the bench's, 4.5 s, and the longest
/// that an identification finds.
const LACKING: [Second; SLOW_POLES] = [Second(4.5), Second(60.0)];

/// The poles of a calibration, the slow ones that it lacks with times of their own.
pub(super) fn followed(heat: &Heat) -> [Lag; POLES] {
    let mut poles = heat.poles();
    let [.., first, second] = &mut poles;
    let [shorter, longer] = LACKING;
    let apart_from = |used: Second| match used.0 * used.0 < shorter.0 * longer.0 {
        true => longer,
        false => shorter,
    };
    match (first.weight == 0.0, second.weight == 0.0) {
        (true, true) => (first.time, second.time) = (shorter, longer),
        (true, false) => first.time = apart_from(second.time),
        (false, true) => second.time = apart_from(first.time),
        (false, false) => {}
    }
    poles
}

/// A lag that has its turn every [`TURNS`] ticks, and is followed though it should weigh nothing.
pub(super) fn slow(lag: Lag) -> SlowLag {
    let weight = if lag.weight > HARDLY {
        lag.weight
    } else {
        HARDLY
    };
    SlowLag::new(&Lag { weight, ..lag }, TURNS)
}
