//! A session: a plan measured on a mirror, with the instruments' noise.

use crate::config::{ConfigError, MirrorConfig};
use crate::mirror::VirtualMirror;
use crate::plan::{Dwell, Experiment, Plan};
use crate::sensor::{Reading, Sensor};

/// One row of a measurement file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time from the file's start (s).
    pub t_s: f64,
    /// Time from the session's start (s).
    pub t_global_s: f64,
    /// Voltage at each actuator (V).
    pub drive_v: [f64; 4],
    /// How far a stage had moved the mirror (um).
    pub reference_um: f64,
    /// What the instruments read.
    pub reading: Reading,
    /// Temperature of the room (degC).
    pub ambient_c: f64,
}

/// One measurement file.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// What was measured; its rows are the plan.
    pub experiment: Experiment,
    /// What was read.
    pub rows: Vec<Row>,
}

/// The files of one session: one mirror, one day, its drift.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    /// White noise of the position readings (nm).
    pub noise_z_nm: f64,
    /// One recording an experiment.
    pub recordings: Vec<Recording>,
}

impl Session {
    /// Measures `plan` on the mirror that `config` describes.
    ///
    /// # Errors
    /// [`ConfigError::Range`] when a number of `config` is out of range.
    pub fn record(config: &MirrorConfig, plan: &Plan) -> Result<Self, ConfigError> {
        let mut recorder = Recorder {
            mirror: VirtualMirror::new(config)?,
            sensor: Sensor::new(config),
            read_at_s: 0.0,
        };
        Ok(Self {
            noise_z_nm: config.sensor.position_noise_nm,
            recordings: plan
                .experiments
                .iter()
                .map(|experiment| recorder.record(experiment))
                .collect(),
        })
    }
}

/// A mirror and its instruments during a session.
struct Recorder {
    mirror: VirtualMirror,
    sensor: Sensor,
    read_at_s: f64,
}

impl Recorder {
    fn record(&mut self, experiment: &Experiment) -> Recording {
        self.mirror.set_ambient(experiment.ambient_rise_k);
        self.mirror.advance([0.0; 4], experiment.rest_s);
        self.mirror
            .advance([experiment.prehold_v; 4], experiment.prehold_s);
        let mut t_s = 0.0;
        let mut rows = Vec::with_capacity(experiment.rows.len());
        for dwell in &experiment.rows {
            t_s += dwell.dwell_s;
            rows.push(self.measure(dwell, experiment.interpolated, t_s));
        }
        Recording {
            experiment: experiment.clone(),
            rows,
        }
    }

    fn measure(&mut self, dwell: &Dwell, interpolated: bool, t_s: f64) -> Row {
        self.mirror.set_stage(dwell.reference_um);
        if dwell.rest_s > 0.0 {
            self.mirror.advance([0.0; 4], dwell.rest_s);
        }
        if interpolated {
            self.mirror.advance_ramp(dwell.drive_v, dwell.dwell_s);
        } else {
            self.mirror.advance(dwell.drive_v, dwell.dwell_s);
        }
        let (state, now) = (self.mirror.state(), self.mirror.time_s());
        let reading = self.sensor.read(&state, now - self.read_at_s);
        self.read_at_s = now;
        Row {
            t_s,
            t_global_s: now,
            drive_v: dwell.drive_v,
            reference_um: dwell.reference_um,
            reading,
            ambient_c: state.ambient_c,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A staircase that is held, and a ramp after a prehold.
    fn plan() -> Plan {
        let stairs = (0..8).map(|step| ([0.5 * f64::from(step); 4], 1.0));
        let ramp = (0..10).map(|step| ([1.0 + 0.1 * f64::from(step); 4], 0.01));
        Plan {
            experiments: vec![
                Experiment::held("stairs", 0.0, stairs),
                Experiment {
                    prehold_v: 1.0,
                    prehold_s: 5.0,
                    interpolated: true,
                    ..Experiment::held("ramp", 20.0, ramp)
                },
            ],
        }
    }

    #[test]
    fn a_session_has_the_plan_s_rows_and_clocks() {
        let plan = plan();
        let session = Session::record(&MirrorConfig::bench(), &plan).expect("valid mirror");
        for (recording, experiment) in session.recordings.iter().zip(&plan.experiments) {
            assert_eq!(recording.rows.len(), experiment.rows.len());
            assert!(
                recording
                    .rows
                    .is_sorted_by(|a, b| a.t_s < b.t_s && a.t_global_s < b.t_global_s)
            );
        }
        let last = session
            .recordings
            .last()
            .and_then(|r| r.rows.last())
            .expect("rows");
        // 8 s of stairs, 20 s of rest, 5 s of prehold, 0.1 s of ramp.
        approx::assert_relative_eq!(last.t_global_s, 33.1, max_relative = 1e-9);
        approx::assert_relative_eq!(plan.duration_s(), 33.1, max_relative = 1e-9);
    }

    #[test]
    fn the_same_seed_records_the_same_session() {
        let plan = plan();
        let record =
            |seed| Session::record(&MirrorConfig::bench().with_seed(seed), &plan).expect("valid");
        assert_eq!(record(1), record(1));
        assert_ne!(record(1), record(2));
    }
}
