//! Setpoints played on the board's core, and what its instruments read meanwhile, as measurement files.

use std::f64::consts::TAU;

use control_core::{CHANNELS, Calibration, Micrometre, Setpoint};
use measurement::{MeasurementFile, Row};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use virtual_mirror::{ConfigError, MirrorConfig};

use crate::{Loop, TICK_S};

/// Noise of one reading of the position sensor (um).
const NOISE_UM: f64 = 0.02;
/// After a jump every tick is read, and then a twentieth of the time since the jump later each time, as on the
/// board.
const SLOWING: usize = 20;
/// Readings in a period of a sine, its periods, and those in which the mirror is still on its way there.
const READINGS: usize = 100;
const PERIODS: usize = 6;
const ON_ITS_WAY: usize = 2;

/// A mirror on its board, with a sensor, and what was read of it.
pub(crate) struct Bench<'a> {
    mirror: Loop<'a>,
    noise: Normal<f64>,
    rng: ChaCha8Rng,
}

impl<'a> Bench<'a> {
    pub(crate) fn new(
        calibration: &'a mut Calibration,
        config: &MirrorConfig,
    ) -> Result<Self, ConfigError> {
        Ok(Self {
            mirror: Loop::new(calibration, config)?,
            noise: Normal::new(0.0, NOISE_UM).expect("a positive deviation"),
            rng: ChaCha8Rng::seed_from_u64(config.seed),
        })
    }

    /// Positions, each held so long.
    pub(crate) fn positions(&mut self, z_um: &[f64], hold_s: f64) -> MeasurementFile {
        let mut file = file("positions");
        let held = (hold_s / TICK_S).round() as usize;
        for (jump, &z) in z_um.iter().enumerate() {
            let mut next = 0;
            for tick in 0..held {
                let t_s = (jump * held + tick) as f64 * TICK_S;
                let before_v = self.mirror.drive_v();
                let mut row = self.tick(Setpoint::Position(Micrometre(z as f32)), t_s);
                if tick < next && tick + 1 < held {
                    continue;
                }
                next = tick + (tick / SLOWING).max(1);
                if tick == 0 {
                    row.voltage_v = before_v;
                    row.current_a = [None; CHANNELS];
                }
                file.rows.push(row);
            }
        }
        file
    }

    /// A sine of positions.
    pub(crate) fn sine(&mut self, middle_um: f64, amplitude_um: f64, hz: f64) -> MeasurementFile {
        let mut file = file(&format!("sine_{hz}"));
        let period = 1.0 / (hz * TICK_S);
        let every = (period / READINGS as f64).round().max(1.0) as usize;
        for tick in 0..(PERIODS as f64 * period) as usize {
            let z = middle_um - amplitude_um * (TAU * (tick as f64 + 1.0) / period).cos();
            let mut row = self.tick(Setpoint::Track(Micrometre(z as f32)), tick as f64 * TICK_S);
            if (tick as f64) < ON_ITS_WAY as f64 * period {
                row.z_um = None;
            }
            if tick % every == 0 {
                file.rows.push(row);
            }
        }
        file
    }

    /// At 0 V for so long.
    pub(crate) fn rest(&mut self, seconds: f64) {
        for _ in 0..(seconds / TICK_S) as usize {
            self.mirror.tick(Setpoint::Off);
        }
    }

    /// A tick, and what was read as it began: where the mirror was, and the currents at the drive between the tick before
    /// and this one.
    fn tick(&mut self, setpoint: Setpoint, t_s: f64) -> Row {
        let start_um = self.mirror.mirror().state().z_um;
        let start_s = self.mirror.mirror().time_s();
        let before_v = self.mirror.drive_v();
        self.mirror.tick(setpoint);
        let now_v = self.mirror.drive_v();
        let voltage_v: [f64; CHANNELS] =
            std::array::from_fn(|lane| 0.5 * (before_v[lane] + now_v[lane]));
        let ohm = self.mirror.sensed_ohm();
        Row {
            t_s,
            t_global_s: Some(start_s),
            voltage_v,
            current_a: std::array::from_fn(|lane| Some(voltage_v[lane] / ohm[lane]?)),
            z_um: Some(start_um + self.noise.sample(&mut self.rng)),
            ..Row::default()
        }
    }
}

fn file(name: &str) -> MeasurementFile {
    let mut file = MeasurementFile::default();
    file.keys.set("experiment", name);
    file.keys.set("noise_z_nm", &(1e3 * NOISE_UM).to_string());
    file.keys.set("drive", "position");
    file
}
