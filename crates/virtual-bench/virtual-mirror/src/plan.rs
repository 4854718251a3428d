//! What is measured: drives over time, experiment by experiment.

/// One row: what the drive does until it is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dwell {
    /// Time at 0 V before it, which the experiment's own clock does not count (s).
    pub rest_s: f64,
    /// How long the drive is held, or takes to get there (s).
    pub dwell_s: f64,
    /// Voltage at each actuator at the end of it (V).
    pub drive_v: [f64; 4],
    /// How far a stage has moved the mirror under the sensor since the session's start (um).
    pub reference_um: f64,
}

/// One experiment: one measurement file.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// `sweep`, `step`, `sine_20`, `single`, `repeat`, or free text.
    pub name: String,
    /// Time at 0 V before it (s).
    pub rest_s: f64,
    /// Voltage held on all actuators just before its clock starts (V), and for how long (s).
    pub prehold_v: f64,
    /// How long the prehold voltage is held (s).
    pub prehold_s: f64,
    /// Temperature rise of the room or oven over the session's start (K), from the rest before it on.
    pub ambient_rise_k: f64,
    /// Whether the drive moves in straight lines between rows, or is held.
    pub interpolated: bool,
    /// The formula of the drive, for sines.
    pub drive: Option<String>,
    /// The rows.
    pub rows: Vec<Dwell>,
}

/// A session's experiments, in order, on one mirror.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What is measured, one after the other.
    pub experiments: Vec<Experiment>,
}

impl Experiment {
    /// Drives held one after the other, each for its time (s), and read at its end.
    pub fn held(
        name: &str,
        rest_s: f64,
        dwells: impl IntoIterator<Item = ([f64; 4], f64)>,
    ) -> Self {
        let row = |(drive_v, dwell_s)| Dwell {
            rest_s: 0.0,
            dwell_s,
            drive_v,
            reference_um: 0.0,
        };
        Self {
            name: name.to_owned(),
            rest_s,
            prehold_v: 0.0,
            prehold_s: 0.0,
            ambient_rise_k: 0.0,
            interpolated: false,
            drive: None,
            rows: dwells.into_iter().map(row).collect(),
        }
    }

    /// Its length with rests and prehold (s).
    pub fn duration_s(&self) -> f64 {
        self.rest_s
            + self.prehold_s
            + self
                .rows
                .iter()
                .map(|row| row.rest_s + row.dwell_s)
                .sum::<f64>()
    }
}

impl Plan {
    /// Its length (s).
    pub fn duration_s(&self) -> f64 {
        self.experiments.iter().map(Experiment::duration_s).sum()
    }
}
