//! A session as the simulation sees it: pieces of drive, and what was observed at the end of which.

mod clock;
mod meters;
mod observation;
mod sign;
mod thin;

use crate::noise::{Noise, assumed, misstated};
use crate::surroundings::Surroundings;
pub use clock::OwnZero;
use clock::{Clock, ROUNDING_S};
use measurement::{MeasurementFile, Row, Session};
use mirror_model::{ACTUATORS, Interval, Output};
pub use observation::{Channel, Observation};
pub use thin::{Thinned, thinned};

/// How long the drive of a settled reading was on (s): time constants that a base may have without being fitted, some seconds,
/// are over.
const SETTLED_S: f64 = 100.0;
/// A pause that is shorter is rounding of the times (s).
const NO_TIME_S: f64 = 1e-6;

/// Drives and observations of a session.
#[derive(Clone, Debug, Default)]
pub struct Dataset {
    /// The drives, without a gap from the session's start.
    pub intervals: Vec<Interval>,
    /// The observations in the order of time.
    pub observations: Vec<Observation>,
    /// The experiments' names, made unique.
    pub experiments: Vec<String>,
    /// Rows of the files that were dropped because they were more than a fit needs.
    pub thinned_rows: usize,
    /// Sentences on what was done to the readings before they are compared with a model.
    pub notes: Vec<String>,
    /// The first known temperature of the surroundings, which cold resistances and the displacement's zero belong to (degC).
    pub first_ambient_c: Option<f64>,
    /// Experiments whose displacements count from a zero of their own.
    pub own_zeros: Vec<OwnZero>,
    /// Whether all readings are settled ones, which time and order say nothing of.
    pub is_steady: bool,
}

impl Dataset {
    /// Of a session, [`thinned`] where it is dense.
    pub fn new(session: &Session) -> Self {
        let of_noise = misstated(session).into_iter().chain(assumed(session));
        let of_noise: Vec<String> = of_noise.collect();
        let Thinned {
            session,
            rows_left_out,
            notes,
        } = thinned(session);
        let session = session.as_ref();
        let surroundings = Surroundings::of(session);
        let mut data = Self {
            first_ambient_c: surroundings.first_c(),
            is_steady: session.files.iter().all(|(_, file)| file.keys.is_steady()),
            thinned_rows: rows_left_out,
            notes,
            ..Self::default()
        };
        let noise = Noise::of(session);
        let mut clock = Clock::default();
        for (_, file) in &session.files {
            data.add(file, &noise, &surroundings, &mut clock);
        }
        data.end_clock(&mut clock);
        data.take_meter_zeros();
        if shows_one_heater(session) {
            let first = |o: &Observation| o.channel == Channel::Current(0);
            data.observations.retain(first);
        }
        let turned = sign::turned(&data.driven_displacements());
        data.notes.extend(turned.into_iter().chain(of_noise));
        data
    }

    /// By experiment every displacement after the mean square of the drives at it (V^2, um).
    fn driven_displacements(&self) -> Vec<(&str, Vec<sign::Driven>)> {
        let named = self
            .experiments
            .iter()
            .map(|name| (name.as_str(), Vec::new()));
        let mut driven: Vec<_> = named.collect();
        for o in &self.observations {
            if o.channel == Channel::Displacement {
                let squares = self.drive(o).map(|volts| volts * volts);
                let mean = squares.iter().sum::<f64>() / ACTUATORS as f64;
                driven[o.experiment].1.push((mean, o.value));
            }
        }
        driven
    }

    /// What a simulation's outputs say of each observation.
    pub fn read(&self, outputs: &[Output]) -> Vec<f64> {
        let read = self
            .observations
            .iter()
            .map(|o| pick(&outputs[o.interval], o.channel));
        self.at_own_zeros(read.collect())
    }

    /// Numbers like the observations, those with a zero of their own moved to it.
    pub fn at_own_zeros(&self, mut numbers: Vec<f64>) -> Vec<f64> {
        for zero in &self.own_zeros {
            let off_um = zero.mean_um(&numbers, &self.observations) - zero.measured_um;
            for (number, o) in numbers.iter_mut().zip(&self.observations) {
                if zero.is_of(o) {
                    *number -= off_um;
                }
            }
        }
        numbers
    }

    /// The experiments since the clock began have a zero of their own, if it is not the first clock and anything but the drive
    /// moved the mirror: where only the drive did, rest is rest.
    fn end_clock(&mut self, clock: &mut Clock) {
        let experiments = clock.first..self.experiments.len();
        if clock.first > 0 && clock.moved {
            let zero = OwnZero::new(experiments, &self.observations);
            self.own_zeros.push(zero);
        }
        (clock.first, clock.moved) = (self.experiments.len(), false);
    }

    /// The measured numbers.
    pub fn values(&self) -> Vec<f64> {
        self.observations.iter().map(|o| o.value).collect()
    }

    /// The same drives and channels with other numbers measured.
    pub fn with_values(&self, values: &[f64]) -> Self {
        let mut data = self.clone();
        for (observation, &value) in data.observations.iter_mut().zip(values) {
            observation.value = value;
        }
        data
    }

    /// The drive that was on when an observation was made.
    pub fn drive(&self, observation: &Observation) -> [f64; ACTUATORS] {
        self.intervals[observation.interval].to_v
    }

    /// When each interval ends, from the start of the simulation (s).
    pub fn ends_s(&self) -> impl Iterator<Item = f64> {
        self.intervals.iter().scan(0.0, |t_s, interval| {
            *t_s += interval.duration_s;
            Some(*t_s)
        })
    }

    /// How long the simulation lasts (s).
    pub fn lasts_s(&self) -> f64 {
        self.ends_s().last().unwrap_or(0.0)
    }

    /// The first reading at or after a time from the start of the simulation, in words for people.
    pub fn first_reading_after(&self, t_s: f64) -> Option<String> {
        let running = self.ends_s().position(|end_s| end_s >= t_s)?;
        let reading = self.observations.iter().find(|o| o.interval >= running)?;
        let volts = self.drive(reading).into_iter().fold(0.0, f64::max);
        let experiment = &self.experiments.get(reading.experiment)?;
        Some(if self.is_steady {
            format!("in `{experiment}`, from its reading at {volts} V on")
        } else {
            let t_s = reading.t_s;
            format!("in `{experiment}`, from its reading at {t_s} s on ({volts} V)")
        })
    }

    /// The displacement that all others count from: the first one without drive.
    pub fn zero(&self) -> Option<&Observation> {
        let mut observed = self.observations.iter();
        observed.find(|o| o.channel == Channel::Displacement && self.drive(o) == [0.0; ACTUATORS])
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

    fn add<'a>(
        &mut self,
        file: &'a MeasurementFile,
        noise: &Noise,
        surroundings: &Surroundings,
        clock: &mut Clock<'a>,
    ) {
        let (start, begins) = clock.start(file);
        if begins {
            self.end_clock(clock);
        }
        let experiment = self.name(file.experiment());
        let first = file.rows[0];
        let rise_k = surroundings.rise_k(file);
        let around = |index: usize| Interval {
            ambient_k: rise_k[index],
            reference_um: file.rows[index].reference_um.unwrap_or(0.0),
            ..Interval::default()
        };
        let moves = |index| around(index) != Interval::default();
        clock.moved |= (0..file.rows.len()).any(moves);
        if file.keys.is_steady() {
            for (index, row) in file.rows.iter().enumerate() {
                self.intervals.push(Interval {
                    duration_s: SETTLED_S,
                    from_v: row.voltage_v,
                    to_v: row.voltage_v,
                    ..around(index)
                });
                self.observe(file, row, noise, experiment);
            }
            clock.end_s = start + SETTLED_S * file.rows.len() as f64;
            return;
        }
        let (hold_v, hold_s) = file.keys.prehold().unwrap_or((0.0, 0.0));
        self.hold(0.0, start - hold_s - clock.end_s, around(0));
        self.hold(hold_v, hold_s, around(0));
        let interpolated = file.keys.drive_is_interpolated();
        let (mut t, mut global, mut from_v) = (0.0_f64.min(first.t_s), start, [hold_v; ACTUATORS]);
        for (row, around) in file.rows.iter().zip((0..).map(around)) {
            let dwell = row.t_s - t;
            let on_clock = row.t_global_s.map(|global| clock.origin_s + global);
            let row_global = on_clock.unwrap_or(global + dwell);
            let pause = row_global - global - dwell;
            if pause > ROUNDING_S {
                self.hold(0.0, pause, around);
            }
            if dwell > 0.0 {
                let begin = if interpolated { from_v } else { row.voltage_v };
                self.intervals.push(Interval {
                    duration_s: dwell,
                    from_v: begin,
                    to_v: row.voltage_v,
                    ..around
                });
            } else if self.intervals.is_empty() {
                self.intervals.push(Interval {
                    duration_s: NO_TIME_S,
                    from_v: row.voltage_v,
                    to_v: row.voltage_v,
                    ..around
                });
            }
            self.observe(file, row, noise, experiment);
            (t, global, from_v) = (row.t_s, row_global, row.voltage_v);
        }
        clock.end_s = global;
    }

    fn observe(&mut self, file: &MeasurementFile, row: &Row, noise: &Noise, experiment: usize) {
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
            push(Channel::Displacement, z, noise.of_displacement(file, row));
        }
        for (actuator, current) in row.current_a.iter().enumerate() {
            if let Some(current) = current {
                let noise = noise.of_current(actuator, file, row);
                push(Channel::Current(actuator), *current, noise);
            }
        }
    }

    fn hold(&mut self, voltage_v: f64, duration_s: f64, around: Interval) {
        if duration_s > NO_TIME_S {
            self.intervals.push(Interval {
                duration_s,
                from_v: [voltage_v; ACTUATORS],
                to_v: [voltage_v; ACTUATORS],
                ..around
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
pub fn rms<'o>(
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

/// Whether no displacement was measured, and all four actuators read the same in every row: one heater, which counts once.
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

mod made;
#[cfg(test)]
mod tests;
