//! A session as the simulation sees it: pieces of drive, and what was observed at the end of which.

use crate::noise::Noise;
use measurement::{MeasurementFile, Session};
use mirror_model::{ACTUATORS, Interval, Output};

/// Rest at 0 V assumed between files that share no clock.
const REST_S: f64 = 60.0;
/// A file with more rows is thinned.
const DENSE_ROWS: usize = 1500;
/// Rows that are kept of a held drive lie apart by this ratio of the time since its jump.
const THINNING: f64 = 1.1;

/// What is observed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// The displacement.
    Displacement,
    /// The current of an actuator, from 0.
    Current(usize),
}

/// One number that was measured.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// Index of the interval at whose end it was measured.
    pub interval: usize,
    /// What it is of.
    pub channel: Channel,
    /// The number, in um or A.
    pub value: f64,
    /// Its white noise, one standard deviation.
    pub noise: f64,
    /// Index of its experiment in [`Plan::experiments`].
    pub experiment: usize,
    /// Time from its file's start.
    pub t_s: f64,
}

/// Drives and observations of a session.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// The drives, without a gap from the session's start.
    pub intervals: Vec<Interval>,
    /// The observations in the order of time.
    pub observations: Vec<Observation>,
    /// The experiments' names, made unique.
    pub experiments: Vec<String>,
    /// Rows of the files that were dropped because the drive was sampled densely.
    pub thinned_rows: usize,
}

impl Plan {
    /// The plan of a session.
    pub fn new(session: &Session) -> Self {
        let mut plan = Self::default();
        let noise = Noise::of(session);
        let mut clock_s = 0.0;
        for (_, file) in &session.files {
            plan.add(file, &noise, &mut clock_s);
        }
        if shows_one_heater(session) {
            let first = |o: &Observation| o.channel == Channel::Current(0);
            plan.observations.retain(first);
        }
        plan
    }

    /// What a simulation's outputs say of each observation.
    pub fn read(&self, outputs: &[Output]) -> Vec<f64> {
        self.observations
            .iter()
            .map(|o| pick(&outputs[o.interval], o.channel))
            .collect()
    }

    /// The measured numbers.
    pub fn values(&self) -> Vec<f64> {
        self.observations.iter().map(|o| o.value).collect()
    }

    /// The same drives and channels with other numbers measured.
    pub fn with_values(&self, values: &[f64]) -> Self {
        let mut plan = self.clone();
        for (observation, &value) in plan.observations.iter_mut().zip(values) {
            observation.value = value;
        }
        plan
    }

    /// The drive that was on when an observation was made.
    pub fn drive(&self, observation: &Observation) -> [f64; ACTUATORS] {
        self.intervals[observation.interval].to_v
    }

    /// Whether any current was measured.
    pub fn has_current(&self) -> bool {
        self.observations
            .iter()
            .any(|o| o.channel != Channel::Displacement)
    }

    /// Whether any displacement was measured.
    pub fn has_displacement(&self) -> bool {
        self.observations
            .iter()
            .any(|o| o.channel == Channel::Displacement)
    }

    /// Whether it shows heaters only: currents, and no displacement.
    pub fn is_of_heaters(&self) -> bool {
        self.has_current() && !self.has_displacement()
    }

    /// Whether it shows a single heater, which all four actuators then stand for.
    pub fn is_one_heater(&self) -> bool {
        let alike = |drive: [f64; ACTUATORS]| drive.iter().all(|v| *v == drive[0]);
        let one = |o: &Observation| o.channel == Channel::Current(0);
        !self.observations.is_empty()
            && self.observations.iter().all(one)
            && self
                .intervals
                .iter()
                .all(|i| alike(i.from_v) && alike(i.to_v))
    }

    fn add(&mut self, file: &MeasurementFile, noise: &Noise, clock_s: &mut f64) {
        let experiment = self.name(file.experiment());
        let first = file.rows[0];
        let start = first
            .t_global_s
            .map_or(*clock_s + REST_S, |global| global - first.t_s.max(0.0));
        let (hold_v, hold_s) = file.keys.prehold().unwrap_or((0.0, 0.0));
        self.hold(0.0, start - hold_s - *clock_s);
        self.hold(hold_v, hold_s);
        let interpolated = file.keys.drive_is_interpolated();
        let kept = thin(file, interpolated);
        self.thinned_rows += file.rows.len() - kept.len();
        let (mut t, mut global, mut from_v) = (0.0_f64.min(first.t_s), start, [hold_v; ACTUATORS]);
        for row in kept.iter().map(|&index| &file.rows[index]) {
            let dwell = row.t_s - t;
            let row_global = row.t_global_s.unwrap_or(global + dwell);
            self.hold(0.0, row_global - global - dwell);
            if dwell > 0.0 {
                let begin = if interpolated { from_v } else { row.voltage_v };
                self.intervals.push(Interval {
                    duration_s: dwell,
                    from_v: begin,
                    to_v: row.voltage_v,
                });
            } else if self.intervals.is_empty() {
                self.intervals.push(Interval {
                    duration_s: 1e-6,
                    from_v: row.voltage_v,
                    to_v: row.voltage_v,
                });
            }
            self.observe(file, row, noise, experiment);
            (t, global, from_v) = (row.t_s, row_global, row.voltage_v);
        }
        *clock_s = global;
    }

    fn observe(
        &mut self,
        file: &MeasurementFile,
        row: &measurement::Row,
        noise: &Noise,
        experiment: usize,
    ) {
        let interval = self.intervals.len() - 1;
        let mut push = |channel, value, noise| {
            self.observations.push(Observation {
                interval,
                channel,
                value,
                noise,
                experiment,
                t_s: row.t_s,
            });
        };
        if let Some(z) = row.z_um {
            push(Channel::Displacement, z, noise.of_displacement(file));
        }
        for (actuator, current) in row.current_a.iter().enumerate() {
            if let Some(current) = current {
                let noise = noise.of_current(actuator, *current);
                push(Channel::Current(actuator), *current, noise);
            }
        }
    }

    fn hold(&mut self, voltage_v: f64, duration_s: f64) {
        if duration_s > 1e-6 {
            self.intervals.push(Interval {
                duration_s,
                from_v: [voltage_v; ACTUATORS],
                to_v: [voltage_v; ACTUATORS],
            });
        }
    }

    fn name(&mut self, experiment: &str) -> usize {
        let count = self
            .experiments
            .iter()
            .filter(|name| name.split('#').next() == Some(experiment))
            .count();
        self.experiments.push(if count == 0 {
            experiment.into()
        } else {
            format!("{experiment}#{}", count + 1)
        });
        self.experiments.len() - 1
    }
}

/// Root mean square of numbers in their observations' units (um, A), over the displacements or over the currents; `None`
/// where there are none.
pub(crate) fn rms<'o>(
    numbers: impl Iterator<Item = (f64, &'o Observation)>,
    displacement: bool,
) -> Option<f64> {
    let (sum, count) = numbers
        .filter(|(_, o)| (o.channel == Channel::Displacement) == displacement)
        .fold((0.0, 0usize), |(sum, count), (number, _)| {
            (sum + number * number, count + 1)
        });
    (count > 0).then(|| (sum / count as f64).sqrt())
}

/// Whether no displacement was measured, and all four actuators read the same in every row: one heater, and not four witnesses.
fn shows_one_heater(session: &Session) -> bool {
    let mut rows = session.files.iter().flat_map(|(_, file)| &file.rows);
    rows.all(|row| {
        let alike =
            |a: usize| row.voltage_v[a] == row.voltage_v[0] && row.current_a[a] == row.current_a[0];
        row.z_um.is_none() && (1..ACTUATORS).all(alike)
    })
}

fn pick(output: &Output, channel: Channel) -> f64 {
    match channel {
        Channel::Displacement => output.z_um,
        Channel::Current(actuator) => output.current_a[actuator],
    }
}

/// The rows of a file that are worth simulating: all of a small one; of a dense one those next to a jump of the drive,
/// and others ever further apart.
fn thin(file: &MeasurementFile, interpolated: bool) -> Vec<usize> {
    let rows = &file.rows;
    if rows.len() <= DENSE_ROWS {
        return (0..rows.len()).collect();
    }
    if interpolated {
        let stride = rows.len().div_ceil(DENSE_ROWS);
        return (0..rows.len()).step_by(stride).collect();
    }
    let (mut kept, mut jumped_at, mut next) = (Vec::new(), rows[0].t_s, 0.0);
    for (index, row) in rows.iter().enumerate() {
        let jumps = index > 0 && row.voltage_v != rows[index - 1].voltage_v;
        if jumps {
            jumped_at = rows[index - 1].t_s;
            next = 0.0;
            if kept.last() != Some(&(index - 1)) {
                kept.push(index - 1);
            }
        }
        let since = row.t_s - jumped_at;
        if since >= next || index + 1 == rows.len() {
            kept.push(index);
            next = since * THINNING;
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use measurement::Row;

    fn session(text: &str) -> Session {
        Session {
            files: vec![(
                "a.csv".into(),
                MeasurementFile::parse("a.csv", text).unwrap(),
            )],
        }
    }

    #[test]
    fn rests_and_preholds_are_driven_before_the_rows() {
        let plan = Plan::new(&session(
            "# prehold_V=1\n# prehold_s=5\nt_global_s,t_s,V_V,z_um\n11,1,2,60\n13,2,0.5,1\n",
        ));
        let drives: Vec<_> = plan
            .intervals
            .iter()
            .map(|i| (i.duration_s, i.to_v[0]))
            .collect();
        assert_eq!(
            drives,
            [(5.0, 0.0), (5.0, 1.0), (1.0, 2.0), (1.0, 0.0), (1.0, 0.5)]
        );
        assert_eq!(plan.observations[1].interval, 4);
    }

    #[test]
    fn a_sine_runs_straight_from_row_to_row() {
        let plan = Plan::new(&session(
            "# drive=sin\n# prehold_V=1\n# prehold_s=5\nt_s,V_V,z_um\n0.1,1.1,1\n0.2,1.2,2\n",
        ));
        let last = plan.intervals.last().unwrap();
        assert_eq!((last.from_v[0], last.to_v[0]), (1.1, 1.2));
    }

    #[test]
    fn dense_files_keep_their_steps() {
        let rows: Vec<_> = (0..100_000)
            .map(|i| Row {
                t_s: f64::from(i) * 1e-3,
                voltage_v: [f64::from(i / 20_000); 4],
                z_um: Some(0.0),
                ..Row::default()
            })
            .collect();
        let file = MeasurementFile {
            rows,
            ..MeasurementFile::default()
        };
        let plan = Plan::new(&Session {
            files: vec![("dense".into(), file)],
        });
        assert!(
            plan.observations.len() < 2000,
            "{}",
            plan.observations.len()
        );
        for step in 1..5 {
            let after = f64::from(step) * 20.0;
            assert!(
                plan.observations
                    .iter()
                    .any(|o| (o.t_s - after).abs() < 2e-3),
                "the step at {after} s is gone"
            );
        }
    }
}
