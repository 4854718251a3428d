//! What is measured: drives over time, experiment by experiment.

use std::f64::consts::TAU;

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
    /// How much warmer the room or oven is than at the session's start (K), from the rest before it on.
    pub warmer_k: f64,
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
            warmer_k: 0.0,
            interpolated: false,
            drive: None,
            rows: dwells.into_iter().map(row).collect(),
        }
    }

    /// All actuators up to `max_v` in `steps` equal steps and down again, `dwell_s` each.
    pub fn sweep(name: &str, rest_s: f64, max_v: f64, steps: u32, dwell_s: f64) -> Self {
        let volts = |step: u32| max_v * f64::from(step) / f64::from(steps);
        let ladder = (0..=steps).chain((0..steps).rev());
        Self::held(name, rest_s, ladder.map(|step| ([volts(step); 4], dwell_s)))
    }

    /// All actuators from 0 to `volts` and back to 0 after `hold_s`, read ever more slowly after each edge.
    pub fn step(rest_s: f64, volts: f64, hold_s: f64) -> Self {
        let edge = |volts: f64| {
            reading_times(hold_s)
                .into_iter()
                .map(move |dwell| ([volts; 4], dwell))
        };
        Self::held("step", rest_s, edge(volts).chain(edge(0.0)))
    }

    /// `mean_v` plus a sine of `amplitude_v` at `hz` on all actuators for some periods of 100 rows, after 5 s at the
    /// mean.
    pub fn sine(mean_v: f64, amplitude_v: f64, hz: f64, periods: u32) -> Self {
        let volts = |row: u32| mean_v + amplitude_v * (TAU * f64::from(row) / 100.0).sin();
        let rows = (1..=100 * periods).map(|row| ([volts(row); 4], 0.01 / hz));
        let name = format!("sine_{hz}").replace('.', "p");
        Self {
            prehold_v: mean_v,
            prehold_s: 5.0,
            interpolated: true,
            drive: Some(format!("{mean_v:?}+{amplitude_v:?}*sin(2*pi*f*t)")),
            ..Self::held(&name, 5.0, rows)
        }
    }

    /// Each actuator alone up to `max_v` in `steps` steps of 1 s, the others at a sense bias of 0.2 V, 2 s of rest
    /// between actuators.
    pub fn single(max_v: f64, steps: u32) -> Self {
        let drive = |actuator: usize, step: u32| {
            let mut drive = [0.2; 4];
            drive[actuator] = max_v * f64::from(step) / f64::from(steps);
            (drive, 1.0)
        };
        let rows = (0..4).flat_map(|actuator| (0..=steps).map(move |step| drive(actuator, step)));
        let mut single = Self::held("single", 5.0, rows);
        for actuator in 1..4 {
            single.rows[actuator * (steps as usize + 1)].rest_s = 2.0;
        }
        single
    }

    /// A stage moves the resting mirror under the sensor to each of these heights (um), `dwell_s` each.
    pub fn reference(rest_s: f64, heights_um: &[f64], dwell_s: f64) -> Self {
        let mut reference = Self::held(
            "reference",
            rest_s,
            heights_um.iter().map(|_| ([0.0; 4], dwell_s)),
        );
        for (row, &height_um) in reference.rows.iter_mut().zip(heights_um) {
            row.reference_um = height_um;
        }
        reference
    }

    /// The same in an oven or another room, `warmer_k` warmer than at the session's start.
    #[must_use]
    pub fn warmer_by(self, warmer_k: f64) -> Self {
        Self { warmer_k, ..self }
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
    /// The session that a bench measures by default, up to `max_v`: sweep, step, four sines, each actuator alone, and
    /// the sweep again, coarser.
    pub fn standard(max_v: f64) -> Self {
        let sine = |hz| Experiment::sine(1.0, 0.5, hz, 3);
        Self {
            experiments: vec![
                Experiment::sweep("sweep", 0.0, max_v, 35, 1.0),
                Experiment::step(20.0, 2.0, 30.0),
                Experiment {
                    rest_s: 20.0,
                    ..sine(0.1)
                },
                sine(1.0),
                sine(20.0),
                sine(100.0),
                Experiment::single(max_v, 7),
                Experiment::sweep("repeat", 7.0, max_v, 7, 1.0),
            ],
        }
    }

    /// The standard session, sweeps too small to heat much in an oven at two temperatures, and a ladder of reference steps.
    pub fn with_oven_and_reference(max_v: f64) -> Self {
        let mut plan = Self::standard(max_v);
        let oven = |warmer_k: f64| {
            Experiment::sweep(&format!("oven_{warmer_k}"), 60.0, 0.4, 8, 1.0).warmer_by(warmer_k)
        };
        plan.experiments.extend([
            oven(20.0),
            oven(40.0),
            Experiment::reference(60.0, &REFERENCE_UM, 1.0),
        ]);
        plan
    }

    /// Its length (s).
    pub fn duration_s(&self) -> f64 {
        self.experiments.iter().map(Experiment::duration_s).sum()
    }
}

/// Heights that a stage goes to and back from (um).
const REFERENCE_UM: [f64; 9] = [0.0, 40.0, 80.0, 120.0, 160.0, 120.0, 80.0, 40.0, 0.0];

/// Dwells that follow an edge: every 0.2 ms for 8 ms, then each a twentieth later than the one before, to `end`.
fn reading_times(end: f64) -> Vec<f64> {
    let mut dwells = Vec::new();
    let mut passed = 0.0;
    while passed < end * (1.0 - 1e-9) {
        let dwell = (passed * 0.05).max(2e-4).min(end - passed);
        dwells.push(dwell);
        passed += dwell;
    }
    dwells
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_standard_session_has_the_times_of_a_bench_session() {
        let plan = Plan::standard(3.5);
        let names: Vec<&str> = plan.experiments.iter().map(|e| e.name.as_str()).collect();
        assert_eq!(
            names,
            [
                "sweep", "step", "sine_0p1", "sine_1", "sine_20", "sine_100", "single", "repeat"
            ]
        );
        approx::assert_relative_eq!(plan.duration_s(), 304.18, max_relative = 1e-9);
    }

    #[test]
    fn readings_after_an_edge_are_dense_first_and_end_in_time() {
        let dwells = reading_times(30.0);
        assert_eq!(dwells[0], 2e-4);
        approx::assert_relative_eq!(dwells.iter().sum::<f64>(), 30.0, max_relative = 1e-12);
        assert!((100..300).contains(&dwells.len()), "{}", dwells.len());
    }
}
