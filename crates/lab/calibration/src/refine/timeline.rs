//! A session as time steps: what heats the mirror in each, and what is read at its end.

use control_core::CHANNELS;
use control_core::calibration::Path;
use experiments::instruments::POSITION_NOISE_UM;
use measurement::{MeasurementFile, Row, Session};

use super::noise::{Lagging, Noise, ringing_s};

/// Rest at 0 V assumed between files that share no clock (s): about what it takes to begin the next experiment by hand.
const REST_S: f64 = 60.0;
/// A resistance is read from this voltage on (V). Below, an amplifier offset of 10 uA would be 4 % of the current of 360 ohm;
/// the heating left out, 28 uW, is 0.16 K.
const SENSED_V: f64 = 0.1;
/// After a jump of the drive the resistance moves with the temperature; a row that comes later than this (s) has missed it:
/// the fastest thermal pole of these mirrors.
const SOON_S: f64 = 1e-3;
/// The first time step of a drive that stays (s), the fastest thermal pole of these mirrors, and by how much each of the next is longer: half
/// of what has passed.
const FIRST_HELD_S: f64 = 1e-3;
const HELD_GROW: f64 = 1.5;
/// Where the time between rows falls to less than this part, somebody has begun to look closely: something has jumped.
const DENSER: f64 = 0.5;

/// A time step of a session.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TimeStep {
    /// How long it is (s).
    pub(super) duration_s: f64,
    /// Drive of its actuators in the mean (V).
    pub(super) drive_v: f64,
    /// Heating power of each actuator at its start and at its end, a straight line between (W).
    pub(super) from_w: [f64; CHANNELS],
    pub(super) to_w: [f64; CHANNELS],
    /// Resistances that the currents show at its end.
    pub(super) sensed: [Option<SensedResistance>; CHANNELS],
    /// Where the mirror is at its end; `None` where that was not read, or what heated it is not known.
    pub(super) displacement: Option<Displacement>,
}

/// A reading of the displacement.
#[derive(Clone, Copy, Debug)]
pub(super) struct Displacement {
    pub(super) z_um: f64,
    /// Of the reading's noise and the stages' discrepancy.
    pub(super) standard_deviation_um: f64,
}

/// A resistance read from voltage and current.
#[derive(Clone, Copy, Debug)]
pub(super) struct SensedResistance {
    pub(super) ohm: f64,
    /// The voltage that it was read at: its relative error is that of the current, and so inverse to this (V).
    pub(super) volts: f64,
}

/// The time steps of a session, from rest.
#[derive(Debug, Default)]
pub(super) struct Timeline {
    pub(super) steps: Vec<TimeStep>,
}

impl Timeline {
    /// The session of a mirror that goes to a new position like this, and lags behind by so much.
    pub(super) fn of(session: &Session, path: &Path, lagging: Lagging) -> Self {
        let mut timeline = Self::default();
        let mut clock_s = 0.0;
        for (_, file) in &session.files {
            let Some(first) = file.rows.first() else {
                continue;
            };
            let start_s = first
                .t_global_s
                .map_or(clock_s + REST_S, |global| global - first.t_s.max(0.0));
            let (held_v, held_s) = file.keys.prehold().unwrap_or((0.0, 0.0));
            hold(
                &mut timeline.steps,
                start_s - held_s - clock_s,
                TimeStep::default(),
            );
            let mut reader = Reader::new(&mut timeline.steps, file, (path, lagging));
            reader.hold(first, held_v, held_s);
            clock_s = start_s + reader.read(held_v);
        }
        timeline
    }

    /// How many readings of the displacement bear weight.
    pub(super) fn readings(&self) -> usize {
        let read = |step: &&TimeStep| step.displacement.is_some();
        self.steps.iter().filter(read).count()
    }
}

/// A drive that stays for so long (s), in time steps that grow with what has passed: in each of them the mirror goes about straight on.
fn hold(steps: &mut Vec<TimeStep>, seconds: f64, held: TimeStep) {
    let mut left_s = seconds;
    let mut longest_s = FIRST_HELD_S;
    while left_s > 0.0 {
        let duration_s = left_s.min(longest_s);
        steps.push(TimeStep { duration_s, ..held });
        left_s -= duration_s;
        longest_s *= HELD_GROW;
    }
}

/// A file on its way into time steps.
struct Reader<'a> {
    steps: &'a mut Vec<TimeStep>,
    file: &'a MeasurementFile,
    noise: Noise,
    /// The last resistance that was read, since the actuator was last without drive.
    resistance_ohm: [Option<f64>; CHANNELS],
    since_jump_s: f64,
    /// Where the mirror was read last, and where before the last jump (um).
    last_um: f64,
    jumped_from_um: f64,
}

impl<'a> Reader<'a> {
    fn new(
        steps: &'a mut Vec<TimeStep>,
        file: &'a MeasurementFile,
        (path, lagging): (&Path, Lagging),
    ) -> Self {
        let noise = Noise {
            reading_um: file
                .keys
                .displacement_noise_um()
                .unwrap_or(POSITION_NOISE_UM),
            is_smooth: file.keys.drive_is_interpolated(),
            ringing_s: ringing_s(path),
            lagging,
        };
        let first_um = file.rows.iter().find_map(|row| row.z_um).unwrap_or(0.0);
        Self {
            steps,
            file,
            noise,
            resistance_ohm: [None; CHANNELS],
            since_jump_s: 0.0,
            last_um: first_um,
            jumped_from_um: first_um,
        }
    }

    /// A voltage held before the first row, with the resistance that this row shows.
    fn hold(&mut self, first: &Row, volts: f64, duration_s: f64) {
        self.sense(first);
        let power = self.power([volts; CHANNELS]);
        let held = TimeStep {
            drive_v: volts,
            from_w: power,
            to_w: power,
            ..TimeStep::default()
        };
        hold(self.steps, duration_s, held);
    }

    /// All rows; returns how long they take (s).
    fn read(&mut self, held_v: f64) -> f64 {
        let (mut t_s, mut volts) = (0.0, [held_v; CHANNELS]);
        let (mut passed_s, mut last_duration_s) = (0.0, 0.0);
        for row in &self.file.rows {
            let duration_s = (row.t_s - t_s).max(0.0);
            passed_s += duration_s;
            let denser = duration_s < DENSER * last_duration_s;
            self.step(row, duration_s, volts, denser);
            (t_s, volts, last_duration_s) = (row.t_s, row.voltage_v, duration_s);
        }
        passed_s
    }

    /// The time step that ends with a row, after one that ended with `volts`.
    fn step(&mut self, row: &Row, duration_s: f64, volts: [f64; CHANNELS], denser: bool) {
        let is_smooth = self.noise.is_smooth;
        let jumps = !is_smooth && row.voltage_v != volts;
        if jumps || denser {
            self.since_jump_s = 0.0;
            self.jumped_from_um = self.last_um;
        }
        self.since_jump_s += duration_s;
        self.last_um = row.z_um.unwrap_or(self.last_um);
        let start_v = if is_smooth && !denser {
            volts
        } else {
            row.voltage_v
        };
        let missed = jumps && duration_s > SOON_S;
        if missed || self.resistance_ohm.contains(&None) {
            self.sense(row);
        }
        let from_w = self.power(start_v);
        let sensed = self.sense(row);
        let to_w = self.power(row.voltage_v);
        let is_followed = !missed && self.heating_is_known(row);
        let moved_um = (self.last_um - self.jumped_from_um).abs();
        let standard_deviation_um = self
            .noise
            .standard_deviation_um(self.since_jump_s, moved_um);
        let displacement = row.z_um.filter(|_| is_followed).map(|z_um| Displacement {
            z_um,
            standard_deviation_um,
        });
        let drives_v = start_v.iter().chain(&row.voltage_v);
        self.steps.push(TimeStep {
            duration_s,
            drive_v: drives_v.sum::<f64>() / (2 * CHANNELS) as f64,
            from_w,
            to_w,
            sensed: if is_followed {
                sensed
            } else {
                [None; CHANNELS]
            },
            displacement,
        });
    }

    /// Reads the resistances that a row's currents show.
    fn sense(&mut self, row: &Row) -> [Option<SensedResistance>; CHANNELS] {
        let sensed: [Option<SensedResistance>; CHANNELS] = std::array::from_fn(|channel| {
            let volts = row.voltage_v[channel];
            let current = row.current_a[channel].filter(|current| *current > 0.0)?;
            (volts > SENSED_V).then(|| SensedResistance {
                ohm: volts / current,
                volts,
            })
        });
        for (channel, sensed) in sensed.iter().enumerate() {
            if let Some(sensed) = sensed {
                self.resistance_ohm[channel] = Some(sensed.ohm);
            } else if row.voltage_v[channel] <= SENSED_V {
                self.resistance_ohm[channel] = None;
            }
        }
        sensed
    }

    /// Whether every driven actuator's resistance has been read since its drive began.
    fn heating_is_known(&self, row: &Row) -> bool {
        let known = |channel: usize| {
            row.voltage_v[channel] <= SENSED_V || self.resistance_ohm[channel].is_some()
        };
        (0..CHANNELS).all(known)
    }

    /// What these voltages heat with (W). An actuator of unknown resistance counts as unheated; no reading is used then.
    fn power(&self, volts: [f64; CHANNELS]) -> [f64; CHANNELS] {
        std::array::from_fn(|channel| {
            let volts = volts[channel];
            self.resistance_ohm[channel].map_or(0.0, |ohm| volts * volts / ohm)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::path_of;

    /// A row at a drive of all four, into 400 ohm.
    fn row(t_s: f64, volts: f64) -> Row {
        Row {
            t_s,
            voltage_v: [volts; CHANNELS],
            current_a: [Some(volts / 400.0); CHANNELS],
            z_um: Some(10.0),
            ..Row::default()
        }
    }

    fn timeline(rows: Vec<Row>, keys: &[(&str, &str)]) -> Timeline {
        let mut file = MeasurementFile::default();
        for (key, value) in keys {
            file.keys.set(key, value);
        }
        file.rows = rows;
        let files = vec![("moves.csv".into(), file)];
        Timeline::of(&Session { files }, &path_of(None), Lagging::USUAL)
    }

    #[test]
    fn power_runs_straight_along_a_smooth_drive_and_is_held_otherwise() {
        let rows = || vec![row(0.0, 1.0), row(0.5e-3, 2.0), row(1e-3, 3.0)];
        let power = |timeline: &Timeline| {
            let last = timeline.steps.last().unwrap();
            (last.duration_s, last.from_w, last.to_w)
        };
        let smooth = timeline(rows(), &[("drive", "sine")]);
        // V^2 / 400 ohm at 2 and at 3 V.
        assert_eq!(power(&smooth), (0.5e-3, [0.01; 4], [0.0225; 4]));
        let held = timeline(rows(), &[]);
        assert_eq!(power(&held), (0.5e-3, [0.0225; 4], [0.0225; 4]));
        assert_eq!((smooth.readings(), held.readings()), (3, 3));
    }

    #[test]
    fn a_file_begins_from_rest_and_its_prehold() {
        let held = timeline(
            vec![row(0.0, 2.0)],
            &[("prehold_V", "2"), ("prehold_s", "7")],
        );
        let of_power = |watts: f64| {
            let steps = held
                .steps
                .iter()
                .filter(move |step| step.to_w == [watts; 4]);
            steps.map(|step| step.duration_s).sum::<f64>()
        };
        // 60 s after the session's beginning, less the 7 s of the hold; the first row takes no time.
        assert!((of_power(0.0) - 53.0).abs() < 1e-9, "{held:?}");
        assert!((of_power(0.01) - 7.0).abs() < 1e-9, "{held:?}");
    }

    /// A mirror that falls at once is where it is held for all but a moment of it: what creeps behind goes straight on in each time step.
    #[test]
    fn a_drive_that_stays_is_followed_from_its_first_millisecond_on() {
        let mut steps = Vec::new();
        hold(&mut steps, 30.0, TimeStep::default());
        assert_eq!(steps[0].duration_s, FIRST_HELD_S);
        let passed_s: f64 = steps.iter().map(|step| step.duration_s).sum();
        assert!((passed_s - 30.0).abs() < 1e-9, "{passed_s}");
        let mut before_s = FIRST_HELD_S;
        for step in &steps[1..] {
            assert!(step.duration_s <= HELD_GROW * before_s, "{steps:?}");
            before_s = step.duration_s;
        }
        hold(&mut steps, 0.0, TimeStep::default());
        hold(&mut steps, -1.0, TimeStep::default());
        assert!(steps.iter().all(|step| step.duration_s > 0.0));
    }

    #[test]
    fn a_row_that_comes_late_after_a_jump_bears_no_weight() {
        let late = timeline(vec![row(0.0, 1.0), row(1e-2, 2.0), row(2e-2, 2.0)], &[]);
        let read: Vec<bool> = late
            .steps
            .iter()
            .map(|s| s.displacement.is_some())
            .collect();
        // The rest, the jump at the file's beginning in no time, the late jump, and what follows it.
        let (rest, rows) = read.split_at(read.len() - 3);
        assert!(rest.iter().all(|read| !read));
        assert_eq!(rows, [true, false, true]);
    }

    #[test]
    fn missing_readings_bear_no_weight() {
        let mut rows = vec![row(0.0, 1.0), row(0.5e-3, 1.0), row(1e-3, 1.0)];
        rows[1].z_um = None;
        assert_eq!(timeline(rows.clone(), &[]).readings(), 2);
        // A current that is missing once: the resistance is the one before.
        rows[2].current_a[3] = None;
        let once = timeline(rows.clone(), &[]);
        assert_eq!(once.readings(), 2);
        let last = once.steps.last().unwrap();
        assert!(last.sensed[3].is_none() && last.sensed[2].is_some());
        assert_eq!(last.to_w, [0.0025; 4]);
        // Never read: nobody knows what heats the mirror.
        for row in &mut rows {
            row.current_a[3] = None;
        }
        let never = timeline(rows, &[]);
        assert_eq!(never.readings(), 0);
        assert!(never.steps.iter().all(|step| step.sensed[0].is_none()));
    }
}
