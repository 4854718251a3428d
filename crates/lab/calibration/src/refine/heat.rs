//! The stage `heat` forward, in f64: from heating power to the temperature rises of the four actuators.

use control_core::CHANNELS;
use control_core::Second;
use control_core::calibration::{FAST_POLES, Heat, Lag, SLOW, SLOW_POLES};

use super::course::Moment;

/// Thermal poles, the fast ones first.
pub(super) const POLES: usize = FAST_POLES + SLOW_POLES;

/// Weights that add up to one, and time constants (s).
#[derive(Clone, Copy, Debug)]
pub(super) struct Poles {
    pub(super) weight: [f64; POLES],
    pub(super) time_s: [f64; POLES],
}

/// What a lane's power does at rest: `rise (1 + growth rise) = R_T P`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loss {
    pub(super) k_per_w: f64,
    pub(super) growth: f64,
}

impl Poles {
    pub(super) fn of(heat: &Heat) -> Self {
        let all = || heat.fast.iter().chain(&heat.slow);
        let mut poles = Self {
            weight: [0.0; POLES],
            time_s: [0.0; POLES],
        };
        for (k, lag) in all().enumerate() {
            poles.weight[k] = f64::from(lag.weight);
            poles.time_s[k] = f64::from(lag.time.0);
        }
        poles
    }

    pub(super) fn heat(&self) -> Heat {
        let lag = |k: usize| Lag {
            weight: self.weight[k] as f32,
            time: Second(self.time_s[k] as f32),
        };
        Heat {
            fast: std::array::from_fn(lag),
            slow: std::array::from_fn(|k| {
                let slow = lag(FAST_POLES + k);
                Lag {
                    time: Second(slow.time.0.max(SLOW.0)),
                    ..slow
                }
            }),
        }
    }

    /// The temperature rise of every lane at the end of every moment.
    pub(super) fn rises(
        &self,
        moments: &[Moment],
        losses: &[Loss; CHANNELS],
    ) -> Vec<[f64; CHANNELS]> {
        let mut lags = [[0.0; POLES]; CHANNELS];
        let mut rise = [0.0; CHANNELS];
        let step = |moment: &Moment| {
            if moment.step_s > 0.0 {
                let shares = self.time_s.map(|time_s| Share::new(time_s, moment.step_s));
                for (lane, loss) in losses.iter().enumerate() {
                    let (from, to) = (moment.from_w[lane], moment.to_w[lane]);
                    rise[lane] =
                        self.advance(&mut lags[lane], rise[lane], &shares, loss, (from, to));
                }
            }
            rise
        };
        moments.iter().map(step).collect()
    }

    /// One lane through one moment; returns its rise at the end.
    fn advance(
        &self,
        lags: &mut [f64; POLES],
        rise: f64,
        shares: &[Share; POLES],
        loss: &Loss,
        (from_w, to_w): (f64, f64),
    ) -> f64 {
        let start = loss.k_per_w * from_w - loss.growth * rise * rise;
        let (mut coasting, mut gain) = (0.0, 0.0);
        for ((share, weight), at) in shares.iter().zip(self.weight).zip(lags.iter()) {
            coasting += weight * (share.keeps * at + share.takes_start * start);
            gain += weight * share.takes_end;
        }
        // rise = coasting + gain (R_T P - growth rise^2), solved for the root that is 0 at rest.
        let driven = coasting + gain * loss.k_per_w * to_w;
        let root = (1.0 + 4.0 * loss.growth * gain * driven).max(0.0).sqrt();
        let rise = 2.0 * driven / (1.0 + root);
        let end = loss.k_per_w * to_w - loss.growth * rise * rise;
        for (share, at) in shares.iter().zip(lags) {
            *at = share.after(*at, start, end);
        }
        rise
    }
}

/// A first-order lag over one step with an input that runs straight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share {
    keeps: f64,
    takes_start: f64,
    takes_end: f64,
}

impl Share {
    pub(super) fn new(time_s: f64, step_s: f64) -> Self {
        let keeps = (-step_s / time_s).exp();
        let mean = time_s / step_s * (1.0 - keeps);
        Self {
            keeps,
            takes_start: mean - keeps,
            takes_end: 1.0 - mean,
        }
    }

    pub(super) fn after(&self, at: f64, from: f64, to: f64) -> f64 {
        self.keeps * at + self.takes_start * from + self.takes_end * to
    }
}

impl Loss {
    /// What the power of a rise would make if the loss did not grow.
    pub(super) fn heating(&self, rise: f64) -> f64 {
        rise * (1.0 + self.growth * rise)
    }

    /// The rise that such a heating holds.
    pub(super) fn rise(&self, heating: f64) -> f64 {
        let root = (1.0 + 4.0 * self.growth * heating).max(0.0).sqrt();
        2.0 * heating / (1.0 + root)
    }
}
