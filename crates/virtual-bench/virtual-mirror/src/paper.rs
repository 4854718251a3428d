//! The paper's experiments, run on a virtual mirror: the numbers of its section 4.

use std::f64::consts::TAU;

use crate::config::{ConfigError, MirrorConfig};
use crate::mirror::VirtualMirror;

/// Frequencies of the published loops (Hz).
pub const LOOP_HZ: [f64; 4] = [0.1, 1.0, 20.0, 100.0];
/// What counts as having stopped creeping (um): two steps of the paper's sensor.
const STILL_UM: f64 = 0.02;

/// A loop at one frequency, 1 V +- 0.5 V.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loop {
    /// Largest difference of displacement between the two branches at one voltage (um).
    pub width_um: f64,
    /// Displacement range (um).
    pub range_um: f64,
}

/// Mean and standard deviation of a tilt over the drive range, counted from its value at 2 V (deg).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TiltStatistics {
    /// Mean (deg).
    pub mean_deg: f64,
    /// Standard deviation (deg).
    pub sd_deg: f64,
}

/// What the paper publishes of its mirror.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PaperNumbers {
    /// Displacement at 3.5 V (um).
    pub z_3v5_um: f64,
    /// Displacement at 1.9 V (um); inferred from the published model error, not itself published.
    pub z_1v9_um: f64,
    /// Time to 95 % of the value after 30 s, for a step from 0 to 2 V (ms).
    pub t95_ms: f64,
    /// Largest fall after a rise in the first 5 ms of the step, in parts of the step: the ringing.
    pub ringing: f64,
    /// Time after which the step has stopped creeping (s).
    pub creep_s: f64,
    /// The loops at [`LOOP_HZ`].
    pub loops: [Loop; 4],
    /// Tilt about x.
    pub tilt_x: TiltStatistics,
    /// Tilt about y.
    pub tilt_y: TiltStatistics,
}

impl PaperNumbers {
    /// The published values; ringing was seen but not quantified.
    pub const PUBLISHED: Self = {
        const fn width(width_um: f64) -> Loop {
            Loop {
                width_um,
                range_um: f64::NAN,
            }
        }
        Self {
            z_3v5_um: 173.7,
            z_1v9_um: 74.8,
            t95_ms: 563.0,
            ringing: f64::NAN,
            creep_s: 30.0,
            loops: [width(1.6), width(4.0), width(5.9), width(9.5)],
            tilt_x: TiltStatistics {
                mean_deg: 0.09,
                sd_deg: 0.12,
            },
            tilt_y: TiltStatistics {
                mean_deg: 0.01,
                sd_deg: 0.09,
            },
        }
    };

    /// Runs the experiments on the mirror of `config`.
    ///
    /// # Errors
    /// [`ConfigError::Range`] when a number of `config` is out of range.
    pub fn measure(config: &MirrorConfig) -> Result<Self, ConfigError> {
        let rest = VirtualMirror::new(config)?;
        let ladder = Ladder::measure(rest.clone());
        let step = Step::measure(rest.clone());
        Ok(Self {
            z_3v5_um: ladder.z_um[35],
            z_1v9_um: ladder.z_um[19],
            t95_ms: step.t95_ms(),
            ringing: step.ringing(),
            creep_s: step.creep_s(),
            loops: LOOP_HZ.map(|hz| measure_loop(rest.clone(), hz)),
            tilt_x: ladder.statistics(&ladder.tilt_x_deg),
            tilt_y: ladder.statistics(&ladder.tilt_y_deg),
        })
    }
}

/// The static experiment: 0 to 3.5 V in steps of 0.1 V.
#[derive(Default)]
struct Ladder {
    z_um: Vec<f64>,
    tilt_x_deg: Vec<f64>,
    tilt_y_deg: Vec<f64>,
}

impl Ladder {
    fn measure(mut mirror: VirtualMirror) -> Self {
        let mut ladder = Self::default();
        for step in 0..=35 {
            mirror.advance([0.1 * f64::from(step); 4], 10.0);
            let state = mirror.state();
            ladder.z_um.push(state.z_um);
            ladder.tilt_x_deg.push(state.tilt_x_deg);
            ladder.tilt_y_deg.push(state.tilt_y_deg);
        }
        ladder
    }

    fn statistics(&self, tilt: &[f64]) -> TiltStatistics {
        let count = tilt.len() as f64;
        let mean = tilt.iter().sum::<f64>() / count;
        let variance = tilt.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / (count - 1.0);
        TiltStatistics {
            mean_deg: mean - tilt[20],
            sd_deg: variance.sqrt(),
        }
    }
}

/// A step from 0 to 2 V, seen for a minute.
struct Step {
    /// Every 0.1 ms of the first 5 ms (um).
    start: Vec<f64>,
    /// Time (s) and displacement (um), every millisecond at first and every 20 ms later.
    course: Vec<(f64, f64)>,
}

impl Step {
    fn measure(mut mirror: VirtualMirror) -> Self {
        let mut quick = mirror.clone();
        let read = |mirror: &mut VirtualMirror, dt: f64| {
            mirror.advance([2.0; 4], dt);
            (mirror.time_s(), mirror.state().z_um)
        };
        let dwells = [1e-3; 2000].into_iter().chain([20e-3; 2900]);
        Self {
            start: (0..50).map(|_| read(&mut quick, 1e-4).1).collect(),
            course: dwells.map(|dt| read(&mut mirror, dt)).collect(),
        }
    }

    /// Displacement after 30 s (um), which the paper calls final.
    fn end(&self) -> f64 {
        let after = self.course.partition_point(|(time, _)| *time < 30.0);
        self.course[after].1
    }

    /// First time after the last reading that `out` holds of (s).
    fn time_after(&self, out: impl Fn(f64) -> bool) -> f64 {
        let last = self.course.iter().rposition(|(_, z)| out(*z));
        last.and_then(|last| self.course.get(last + 1))
            .map_or(0.0, |(time, _)| *time)
    }

    fn t95_ms(&self) -> f64 {
        let level = 0.95 * self.end();
        1e3 * self.time_after(|z| z < level)
    }

    fn creep_s(&self) -> f64 {
        let still = self.course[self.course.len() - 1].1;
        self.time_after(|z| (z - still).abs() > STILL_UM)
    }

    /// Largest fall after a rise: a course without ringing has none.
    fn ringing(&self) -> f64 {
        let mut peak = 0.0f64;
        let fall = |z: &f64| {
            peak = peak.max(*z);
            peak - z
        };
        self.start.iter().map(fall).fold(0.0, f64::max) / self.end()
    }
}

/// The third period of a sine of 1 V +- 0.5 V after 5 s at 1 V.
fn measure_loop(mut mirror: VirtualMirror, hz: f64) -> Loop {
    const ROWS: usize = 400;
    mirror.advance([1.0; 4], 5.0);
    let mut z = Vec::with_capacity(ROWS + 1);
    for row in 1..=3 * ROWS {
        let volts = 1.0 + 0.5 * (TAU * row as f64 / ROWS as f64).sin();
        mirror.advance_ramp([volts; 4], 1.0 / (hz * ROWS as f64));
        if row >= 2 * ROWS {
            z.push(mirror.state().z_um);
        }
    }
    // Rows at the same voltage lie mirrored about a quarter and about three quarters of the period.
    let pairs = (0..=ROWS / 4)
        .map(|k| (k, ROWS / 2 - k))
        .chain((ROWS / 2..=3 * ROWS / 4).map(|k| (k, 3 * ROWS / 2 - k)));
    let width = pairs.map(|(a, b)| (z[a] - z[b]).abs()).fold(0.0, f64::max);
    let (low, high) = z.iter().fold((f64::MAX, f64::MIN), |(low, high), z| {
        (low.min(*z), high.max(*z))
    });
    Loop {
        width_um: width,
        range_um: high - low,
    }
}
