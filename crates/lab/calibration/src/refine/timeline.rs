//! A session as what heats the mirror, moment by moment, and where it was seen.

use control_core::CHANNELS;
use measurement::{MeasurementFile, Row, Session};

/// White noise of the displacement where a file does not say `noise_z_nm` (um).
const DEFAULT_NOISE_UM: f64 = 0.02;
/// What the stages are trusted to at best (um).
const APPROXIMATION_UM: f64 = 0.02;
/// Under a drive that is held, friction lets go otherwise than where the loop makes it tremble, and the actuators are not
/// at one position (um).
const HELD_UM: f64 = 0.15;
/// What the stages do not follow after a jump (um): of the drive, when the mirror rings, which dies down in twice the time of
/// a move; of the position, which is smooth. There it is distributed heat, of which a few poles leave a part at every time
/// scale: it falls with the moves that have passed.
const RINGING_UM: f64 = 10.0;
const LAGGING_UM: f64 = 1.0;
/// Rest at 0 V assumed between files that share no clock (s).
const REST_S: f64 = 60.0;
/// A resistance is read from this voltage on (V).
const SENSED_V: f64 = 0.1;
/// After a jump of the drive the resistance moves with the temperature; a row that comes later than this has missed it (s).
const SOON_S: f64 = 1e-3;

/// A piece of time.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moment {
    /// How long it is.
    pub(super) step_s: f64,
    /// Heating power of each lane at its start and at its end, a straight line between.
    pub(super) from_w: [f64; CHANNELS],
    pub(super) to_w: [f64; CHANNELS],
    /// Resistances that the currents told at its end, and the voltages that they were told at.
    pub(super) told: [Option<Told>; CHANNELS],
    /// Where the mirror was at its end, and to how much that is to be followed; one standard deviation.
    pub(super) seen_um: Option<(f64, f64)>,
}

/// What a current tells of its heater.
#[derive(Clone, Copy, Debug)]
pub(super) struct Told {
    pub(super) ohm: f64,
    /// The higher, the less the current's noise is worth (V).
    pub(super) volts: f64,
}

/// The moments of a session, from rest.
#[derive(Debug, Default)]
pub(super) struct Course {
    pub(super) moments: Vec<Moment>,
}

/// The mirror while a file is read.
struct Reader<'a> {
    moments: &'a mut Vec<Moment>,
    file: &'a MeasurementFile,
    resistance_ohm: [Option<f64>; CHANNELS],
    since_jump_s: f64,
    move_s: f64,
}

impl Course {
    /// The session of a mirror whose moves take `move_s`.
    pub(super) fn of(session: &Session, move_s: f64) -> Self {
        let mut course = Self::default();
        let mut clock_s = 0.0;
        for (_, file) in &session.files {
            let Some(first) = file.rows.first() else {
                continue;
            };
            let start_s = first
                .t_global_s
                .map_or(clock_s + REST_S, |global| global - first.t_s.max(0.0));
            let (held_v, held_s) = file.keys.prehold().unwrap_or((0.0, 0.0));
            course.moments.push(Moment {
                step_s: (start_s - held_s - clock_s).max(0.0),
                ..Moment::default()
            });
            let mut reader = Reader {
                moments: &mut course.moments,
                file,
                resistance_ohm: [None; CHANNELS],
                since_jump_s: 0.0,
                move_s,
            };
            reader.hold(held_v, held_s);
            clock_s = start_s + reader.read(held_v);
        }
        course
    }

    /// How often the mirror was seen.
    pub(super) fn seen(&self) -> usize {
        self.moments
            .iter()
            .filter(|moment| moment.seen_um.is_some())
            .count()
    }
}

impl Reader<'_> {
    /// A voltage held before the first row, with the resistance that the first row shows.
    fn hold(&mut self, volts: f64, seconds: f64) {
        self.sense(&self.file.rows[0]);
        let power = self.power([volts; CHANNELS]);
        self.moments.push(Moment {
            step_s: seconds,
            from_w: power,
            to_w: power,
            ..Moment::default()
        });
    }

    /// All rows; returns how long they take (s).
    fn read(&mut self, held_v: f64) -> f64 {
        let interpolated = self.file.keys.drive_is_interpolated();
        let noise = self
            .file
            .keys
            .displacement_noise_um()
            .unwrap_or(DEFAULT_NOISE_UM);
        let (mut t_s, mut volts) = (0.0, [held_v; CHANNELS]);
        let (mut passed_s, mut last_step_s) = (0.0, 0.0);
        for row in &self.file.rows {
            let step_s = (row.t_s - t_s).max(0.0);
            passed_s += step_s;
            let jumps = !interpolated && row.voltage_v != volts;
            // Where readings become dense again, something has jumped.
            let denser = step_s < 0.5 * last_step_s;
            last_step_s = step_s;
            self.since_jump_s = match (jumps, denser) {
                (false, false) => self.since_jump_s + step_s,
                _ => step_s,
            };
            let before = if interpolated && !denser {
                volts
            } else {
                row.voltage_v
            };
            let blind = jumps && step_s > SOON_S;
            if blind || self.resistance_ohm.contains(&None) {
                self.sense(row);
            }
            let from_w = self.power(before);
            let told = self.sense(row);
            let to_w = self.power(row.voltage_v);
            let moves = self.since_jump_s / self.move_s;
            let (approximation, transient) = if interpolated {
                (APPROXIMATION_UM, LAGGING_UM / (1.0 + moves))
            } else {
                (HELD_UM, RINGING_UM * (-0.5 * moves).exp())
            };
            let trust = noise.hypot(approximation).hypot(transient);
            self.moments.push(Moment {
                step_s,
                from_w,
                to_w,
                told: if blind { [None; CHANNELS] } else { told },
                seen_um: row.z_um.filter(|_| !blind).map(|z| (z, trust)),
            });
            (t_s, volts) = (row.t_s, row.voltage_v);
        }
        passed_s
    }

    fn sense(&mut self, row: &Row) -> [Option<Told>; CHANNELS] {
        let told: [Option<Told>; CHANNELS] = std::array::from_fn(|lane| {
            let volts = row.voltage_v[lane];
            let current = row.current_a[lane].filter(|current| *current > 0.0)?;
            (volts > SENSED_V).then(|| Told {
                ohm: volts / current,
                volts,
            })
        });
        for (lane, told) in told.iter().enumerate() {
            if let Some(told) = told {
                self.resistance_ohm[lane] = Some(told.ohm);
            } else if row.voltage_v[lane] <= SENSED_V {
                self.resistance_ohm[lane] = None;
            }
        }
        told
    }

    /// What these voltages heat with; a lane that nothing is known of yet heats with nothing.
    fn power(&self, volts: [f64; CHANNELS]) -> [f64; CHANNELS] {
        std::array::from_fn(|lane| {
            self.resistance_ohm[lane].map_or(0.0, |ohm| volts[lane] * volts[lane] / ohm)
        })
    }
}
