//! What a mirror is made of, as a file a person can read.

mod check;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::effects::{Effect, Effects};
use crate::material::{Layer, Materials};

/// A mirror's description; the unit of every number stands at the end of its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MirrorConfig {
    /// What to call it.
    pub name: String,
    /// Draws the differences among the four actuators and the sensor's noise.
    pub seed: u64,
    /// Temperature of the room and, unless `[frame]` says otherwise, of the substrate (degC).
    #[serde(default = "room_temperature")]
    pub ambient_c: f64,
    /// The driver's rails: a drive beyond them is held at them (V).
    #[serde(default = "driver_rails")]
    pub drive_limit_v: f64,
    /// Part of the heat lost to the air that ends in the frame, 0 to 1, rather than in the room; counts only with a
    /// `[frame]`.
    #[serde(default)]
    pub air_to_frame: f64,
    /// The platinum heater of one actuator.
    pub heater: Heater,
    /// The films' materials.
    #[serde(default)]
    pub materials: Materials,
    /// The beam of one actuator, from the substrate to the plate.
    pub segments: Vec<Segment>,
    /// The mirror plate.
    pub plate: Plate,
    /// The chip frame that the beams stand on; without it they stand on an ideal heat sink.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<Frame>,
    /// How bending becomes displacement.
    #[serde(default)]
    pub shape: ShapeConfig,
    /// Resonances of the plate; without them it follows its static position at once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionConfig>,
    /// How much the four actuators differ.
    #[serde(default)]
    pub spread: Spread,
    /// Known differences of the four actuators.
    #[serde(default)]
    pub trim: Trim,
    /// The displacement sensor and the current sense of a measuring session.
    #[serde(default)]
    pub sensor: SensorConfig,
    /// Effects that are switched on: `creep = 1.0`.
    #[serde(default, skip_serializing_if = "Effects::is_empty")]
    pub effects: Effects,
}

fn room_temperature() -> f64 {
    22.0
}

fn driver_rails() -> f64 {
    10.0
}

/// The platinum heater of one actuator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Heater {
    /// Resistance at ambient temperature, spread evenly over the heated segments (ohm).
    pub ohm: f64,
    /// Local temperature coefficient of resistance (1/K).
    pub tcr_per_k: f64,
    /// Resistance of leads and contacts in series with each actuator's heater (ohm), beside the effect's.
    #[serde(default)]
    pub leads_ohm: [f64; 4],
}

/// A piece of the beam with one stack of films.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// What to call it: `NI`, `OL`, `IV`, `isolation`.
    pub name: String,
    /// Length along the beam (um).
    pub length_um: f64,
    /// Width of all parallel beams of the actuator together (um).
    pub width_um: f64,
    /// Cells it is divided into.
    pub cells: usize,
    /// Films from the bottom, the substrate's side, up.
    pub layers: Vec<Layer>,
    /// Heat lost to the air per length and kelvin (W/(m K)): conductivity of air, 0.026 W/(m K), times the shape
    /// factor of the beams, 2 to 7 for a pair of them beside a frame.
    pub air_loss_w_m_k: f64,
    /// Whether the heater runs here.
    #[serde(default)]
    pub heated: bool,
    /// Lies in the return half of the fold, where the same bending counts the other way along the path.
    #[serde(default)]
    pub turned: bool,
}

/// The mirror plate: silicon under aluminium.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plate {
    /// Edge length (um).
    pub side_um: f64,
    /// Thickness of the silicon (um).
    pub silicon_um: f64,
    /// Heat lost to the air (uW/K).
    pub air_loss_uw_k: f64,
    /// Distance from the centre at which an actuator's displacement acts on the plate (um): more than half a side,
    /// since the joints themselves bend.
    pub lever_um: f64,
}

/// The chip frame and the package under it, as two heat capacities in series.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frame {
    /// Heat capacity of the frame (uJ/K).
    pub frame_uj_k: f64,
    /// Conductance from the frame to the package (uW/K).
    pub frame_to_package_uw_k: f64,
    /// Heat capacity of the package (mJ/K).
    pub package_mj_k: f64,
    /// Conductance from the package to the room (uW/K).
    pub package_to_room_uw_k: f64,
}

/// How bending becomes displacement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ShapeConfig {
    /// Height of the plate above the beams' anchors when cold (um): residual stress of the films curls the released
    /// beams up. 0: flat.
    pub rest_height_um: f64,
    /// How stiffly the bar at the fold and the plate hold the two halves' ends parallel, 0 (free) to 1 (clamped: the
    /// half whose end does not tilt, the paper's Fig. 1b).
    pub clamp: f64,
}

/// Resonances of the plate on its four beams.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionConfig {
    /// Piston mode (Hz).
    pub piston_hz: f64,
    /// Both tilt modes (Hz).
    pub tilt_hz: f64,
    /// Quality factor of all of them.
    pub q: f64,
}

/// Relative standard deviations of what differs among the four actuators; draws are cut at two of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Spread {
    /// Heater resistance.
    pub ohm: f64,
    /// Temperature coefficient.
    pub tcr: f64,
    /// Heat loss to the air.
    pub air_loss: f64,
    /// Curvature per kelvin.
    pub bend: f64,
}

/// Known differences among the four actuators of one particular mirror, as factors, on top of the drawn ones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Trim {
    /// Heater resistance.
    pub ohm: [f64; 4],
    /// Temperature coefficient.
    pub tcr: [f64; 4],
    /// Heat loss to the air.
    pub air_loss: [f64; 4],
    /// Curvature per kelvin.
    pub bend: [f64; 4],
}

impl Default for Trim {
    fn default() -> Self {
        Self {
            ohm: [1.0; 4],
            tcr: [1.0; 4],
            air_loss: [1.0; 4],
            bend: [1.0; 4],
        }
    }
}

/// Noise of a measuring session.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensorConfig {
    /// White noise of a position reading (nm).
    pub position_noise_nm: f64,
    /// Slow wander of the position reading, standard deviation (nm).
    pub wander_nm: f64,
    /// Correlation time of the wander (s).
    pub wander_s: f64,
    /// White noise of a tilt reading (mdeg).
    pub tilt_noise_mdeg: f64,
    /// White noise of a current reading (uA).
    pub current_noise_ua: f64,
    /// White noise of a current reading in proportion to it.
    pub current_noise_ratio: f64,
    /// Standard deviation of each channel's constant gain error.
    pub current_gain_ratio: f64,
}

impl Default for SensorConfig {
    fn default() -> Self {
        Self {
            position_noise_nm: 20.0,
            wander_nm: 20.0,
            wander_s: 30.0,
            tilt_noise_mdeg: 2.0,
            current_noise_ua: 2.0,
            current_noise_ratio: 1e-4,
            current_gain_ratio: 1e-3,
        }
    }
}

/// Why a mirror file was refused, in words for whoever wrote it.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file could not be read.
    #[error("cannot read mirror file {path}: {source}")]
    Read {
        /// Where it was looked for.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is longer than any mirror's.
    #[error(
        "{path} is larger than {MOST_BYTES} bytes, the most that a mirror file has; is it the right file?"
    )]
    TooLarge {
        /// Where it was looked for.
        path: String,
    },
    /// Not TOML, or a key is missing, unknown or of the wrong kind.
    #[error("not a mirror file: {0}")]
    Syntax(#[from] toml::de::Error),
    /// The same, of a file.
    #[error("{path} is no mirror file: {source}")]
    SyntaxOf {
        /// Where it is.
        path: String,
        /// What is wrong, and where.
        source: toml::de::Error,
    },
    /// A number is outside of what a mirror can have.
    #[error("{key} is {value}, but must be {range}")]
    Range {
        /// The key, with its table.
        key: String,
        /// What it says.
        value: String,
        /// What it may say.
        range: String,
    },
}

/// The most that is read of a mirror file: a hundred times the longest that ships.
const MOST_BYTES: u64 = 1_000_000;

impl MirrorConfig {
    /// The default mirror, `mirrors/bench.toml`.
    pub fn bench() -> Self {
        Self::shipped(include_str!("../mirrors/bench.toml"))
    }

    /// The paper's mirror, `mirrors/paper.toml`: shows every number that the paper publishes within 10 %.
    pub fn paper() -> Self {
        Self::shipped(include_str!("../mirrors/paper.toml"))
    }

    /// A mirror file of this crate, which its tests hold valid.
    fn shipped(text: &str) -> Self {
        Self::from_toml(text).expect("mirror files that ship are valid")
    }

    /// Reads and checks a mirror file's text.
    ///
    /// # Errors
    /// [`ConfigError::Syntax`] with the line, or [`ConfigError::Range`] with the key, its value and its range.
    pub fn from_toml(text: &str) -> Result<Self, ConfigError> {
        let config: Self = toml::from_str(text)?;
        config.check()?;
        Ok(config)
    }

    /// Reads and checks a mirror file.
    ///
    /// # Errors
    /// As [`from_toml`](Self::from_toml), [`ConfigError::Read`] or [`ConfigError::TooLarge`].
    pub fn from_file(path: impl AsRef<Path>) -> Result<Self, ConfigError> {
        let name = || path.as_ref().display().to_string();
        let mut text = String::new();
        let read =
            File::open(&path).and_then(|file| file.take(MOST_BYTES + 1).read_to_string(&mut text));
        match read {
            Err(source) => Err(ConfigError::Read {
                path: name(),
                source,
            }),
            Ok(length) if length as u64 > MOST_BYTES => Err(ConfigError::TooLarge { path: name() }),
            Ok(_) => Self::from_toml(&text).map_err(|error| match error {
                ConfigError::Syntax(source) => ConfigError::SyntaxOf {
                    path: name(),
                    source,
                },
                other => other,
            }),
        }
    }

    /// The same mirror with other draws of its differences and noise.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// The same mirror with an effect switched on (or off, with strength 0).
    #[must_use]
    pub fn with_effect(mut self, effect: Effect, strength: f64) -> Self {
        self.effects.set(effect, strength);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_without_an_end_is_told_before_it_takes_the_memory() {
        let zeros = MirrorConfig::from_file("/dev/zero").expect_err("no mirror");
        assert!(matches!(zeros, ConfigError::TooLarge { .. }), "{zeros}");
        let page = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
        let said = MirrorConfig::from_file(page).expect_err("no mirror");
        let said = said.to_string();
        assert!(said.contains("/Cargo.toml is no mirror file"), "{said}");
        let folder = MirrorConfig::from_file("/").expect_err("no mirror");
        assert!(matches!(folder, ConfigError::Read { .. }), "{folder}");
    }
}
