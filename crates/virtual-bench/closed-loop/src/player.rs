//! Experiments played on the board's core, and what its instruments read meanwhile.
//!
//! It plays as the firmware does: the waveforms, the ticks that are sampled and the rows that they make are those of
//! `experiment-player`, and what the sensor and the current senses read is their mean where the board takes a mean.

use control_core::{CHANNELS, Calibration, PwmCode, Setpoint, Volt};
use emulated_board::{Device, Mirror};
use experiment_player::{Clock, Piece, PlayError, pieces, rows};
use experiments::instruments::POSITION_NOISE_UM;
use experiments::{Experiment, Prehold};
use measurement::MeasurementFile;
use mirror_protocol::Telemetry;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use virtual_mirror::ConfigError;
use waveforms::{Player as WaveformPlayer, Reading, Sampler};

use crate::{Loop, TICK_S};

/// Control ticks a second.
const TICK_HZ: u32 = (1.0 / TICK_S).round() as u32;

/// A mirror on its board, with a position sensor that is read at every tick.
pub(crate) struct Player<'a, M> {
    mirror: Loop<'a, M>,
    noise: Normal<f64>,
    rng: ChaCha8Rng,
    /// Ticks since the session began.
    tick: u32,
}

impl<'a, M: Mirror> Player<'a, M> {
    pub(crate) fn new(
        calibration: &'a mut Calibration,
        config: &impl Device<Mirror = M>,
    ) -> Result<Self, ConfigError> {
        Ok(Self {
            mirror: Loop::new(calibration, config)?,
            noise: Normal::new(0.0, POSITION_NOISE_UM).expect("a positive deviation"),
            rng: ChaCha8Rng::seed_from_u64(config.seed()),
            tick: 0,
        })
    }

    /// Uses `calibration` from now on; returns the one before.
    pub(crate) fn exchange(&mut self, calibration: &'a mut Calibration) -> &'a mut Calibration {
        self.mirror.exchange(calibration)
    }

    /// The mirror on its board.
    pub(crate) fn mirror(&mut self) -> &mut Loop<'a, M> {
        &mut self.mirror
    }

    /// Plays an experiment after its rest; nothing is driven afterwards.
    pub(crate) fn play(&mut self, experiment: &Experiment) -> Result<MeasurementFile, PlayError> {
        let pieces = pieces(experiment, TICK_HZ)?;
        let mut file = header(experiment, &pieces);
        self.hold(Setpoint::Off, experiment.rest_s);
        let mut passed_s = 0.0;
        for (index, piece) in pieces.iter().enumerate() {
            self.hold(Setpoint::Off, piece.rest_s);
            if let Some(Prehold { volts, seconds }) = experiment.prehold.filter(|_| index == 0) {
                file.keys.set("prehold_V", &volts.to_string());
                file.keys.set("prehold_s", &seconds.to_string());
                let drive = Setpoint::Drive([Volt(volts as f32); CHANNELS]);
                self.hold(drive, seconds);
            }
            self.play_piece(piece, passed_s, &mut file);
            // The last row is a tick before its dwell ends.
            passed_s = file.rows.last().map_or(0.0, |row| row.t_s) + TICK_S;
        }
        Ok(file)
    }

    /// Plays a piece and appends its rows.
    fn play_piece(&mut self, piece: &Piece, passed_s: f64, file: &mut MeasurementFile) {
        let player = WaveformPlayer::new(piece.waveform, TICK_HZ).expect("pieces are playable");
        let mut player = player.leading(self.mirror.track_delay_ticks());
        // The first sample is from before the waveform; it gives no row, and what is driven then is what was.
        let mut samples = Samples::new(piece);
        samples.add(self.before(), false);
        let clock = Clock {
            tick_hz: TICK_HZ,
            session_tick: 0,
            first_tick: self.tick,
            passed_s,
        };
        let mut asked = None;
        while !player.is_over() {
            let played = player.next(|index| piece.points[index]);
            let wanted = piece.waveform.setpoint(&played);
            let steps = asked.replace(wanted) != Some(wanted);
            let read = self.tick(wanted);
            samples.add(read, steps);
        }
        file.rows.extend(rows(&samples.taken, piece, &clock));
    }

    fn hold(&mut self, setpoint: Setpoint, seconds: f64) {
        for _ in 0..(seconds * f64::from(TICK_HZ)).round() as u64 {
            self.mirror.tick(setpoint);
            self.tick = self.tick.wrapping_add(1);
        }
    }

    /// The tick before this one, of which only the drive is known any more.
    fn before(&self) -> Telemetry {
        Telemetry {
            tick: self.tick.wrapping_sub(1),
            drive_v: self.mirror.applied.map(PwmCode::drive).map(|volt| volt.0),
            ..Telemetry::default()
        }
    }

    /// A tick, and what was read in it: where the mirror was as it began, and the currents at the drive of its own.
    fn tick(&mut self, setpoint: Setpoint) -> Telemetry {
        let z_um = self.mirror.mirror().state().z_um + self.noise.sample(&mut self.rng);
        let (_, limits) = self.mirror.tick(setpoint);
        let telemetry = Telemetry {
            tick: self.tick,
            drive_v: self.mirror.applied.map(PwmCode::drive).map(|volt| volt.0),
            current_a: self.mirror.currents.map(|current| current.0),
            limits: limits.bits(),
            sensor_z_um: Some(z_um as f32),
            ..Telemetry::default()
        };
        self.tick = self.tick.wrapping_add(1);
        telemetry
    }
}

/// The samples that a stream takes of the ticks.
struct Samples {
    sampler: Sampler,
    taken: Vec<Telemetry>,
}

impl Samples {
    fn new(piece: &Piece) -> Self {
        Self {
            sampler: Sampler::new(piece.stream),
            taken: Vec::new(),
        }
    }

    /// A tick. `steps`: the setpoint jumped with it.
    fn add(&mut self, read: Telemetry, steps: bool) {
        let reading = Reading {
            current_a: read.current_a,
            sensor_z_um: read.sensor_z_um,
        };
        if let Some(sample) = self.sampler.tick(reading, steps) {
            self.taken.push(Telemetry {
                current_a: sample.current_a,
                sensor_z_um: sample.sensor_z_um,
                ..read
            });
        }
    }
}

fn header(experiment: &Experiment, pieces: &[Piece]) -> MeasurementFile {
    let mut file = MeasurementFile::default();
    file.keys.set("experiment", &experiment.name);
    let mean_ticks = pieces
        .first()
        .map_or(1, |piece| piece.stream.mean_ticks.max(1));
    let noise_nm = 1e3 * POSITION_NOISE_UM / f64::from(mean_ticks).sqrt();
    file.keys.set("noise_z_nm", &format!("{noise_nm:.2}"));
    if let Some(drive) = experiment.drive_key() {
        file.keys.set("drive", &drive);
    }
    file
}
