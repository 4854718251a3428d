//! The positions that refine a calibration best: far jumps all over the range for heat and creep, near ones for the plays.

/// Far jumps, each followed by a near one.
const FAR: usize = 30;
/// Part of the range from one far place to the next, up and down: the golden section visits all of it evenly.
const STRIDE: f64 = 0.618_033_988_75;
/// Where it begins.
const BEGIN: f64 = 0.5;
/// Near jumps, as shares of the range, in turn.
const NEAR: [f64; 6] = [0.02, -0.03, 0.06, -0.1, 0.15, -0.05];

/// How long each is held (s).
pub const JUMP_S: f64 = 2.0;

/// Positions one after the other, as shares of the range.
pub fn jumps() -> Vec<f64> {
    let near = |far: f64, by: f64| {
        let there = far + by;
        if (0.0..=1.0).contains(&there) {
            there
        } else {
            far - by
        }
    };
    let top = [1.0];
    let places = (0..FAR).flat_map(|k| {
        let far = (BEGIN + STRIDE * k as f64).fract();
        [far, near(far, NEAR[k % NEAR.len()])]
    });
    top.into_iter().chain(places).collect()
}
