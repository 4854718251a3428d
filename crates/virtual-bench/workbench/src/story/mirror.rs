//! The mirror of a story, and what is hidden in it.

use anyhow::{Result, bail};
use virtual_mirror::{ConfigError, Effect, Family, MirrorConfig, Sensor, State, VirtualMirror};

/// Families of layouts whose mirrors come to all positions of a story without getting too hot for the board. The thresholds of the
/// diagnosis come from such layouts, with other seeds; those that it never saw, F and G, are too hot for this board.
const FAMILIES: [Family; 3] = [Family::A, Family::B, Family::E];
/// An effect of a size that happens.
const STRENGTH: f64 = 1.0;
/// From one seed to the next so many places in the list of effects, which has no such factor: neighbouring seeds tell
/// nothing of each other, and as many seeds in a row as there are effects hide each of them once.
const STRIDE: u64 = 7;
/// The board's highest drive (V), and the time after which a mirror is where a drive takes it (s).
const HIGHEST_V: f64 = 3.5;
const SETTLED_S: f64 = 5.0;
/// There a mirror comes at least so far (um): to all positions of a story, and a little more.
const FAR_UM: f64 = 165.0;
/// And its heaters are at most so hot (K): with the factory's calibration the board turns itself off at 554 ohm, which is 130 K
/// in the middle, and less where the cold resistance is more (docs/faults/over-temperature.md).
const HOT_K: f64 = 120.0;
/// Mirrors that are tried with one seed, and the distance of their seeds.
const TRIALS: u64 = 100;
const APART: u64 = 100_000;
/// Of what slowly wanders in a position sensor's reading, a correction by that sensor keeps less than three standard
/// deviations.
const DEVIATIONS: f64 = 3.0;

/// A mirror with an effect that only its maker knows.
pub(super) struct HiddenIn {
    pub(super) effect: Effect,
    pub(super) config: MirrorConfig,
}

/// The effects that a diagnosis has a candidate for.
pub(super) fn listed() -> Vec<Effect> {
    let all = Effect::ALL.iter().copied();
    all.filter(|effect| effect.is_listed()).collect()
}

/// What a seed hides.
pub(super) fn effect(seed: u64) -> Effect {
    let listed = listed();
    listed[((seed * STRIDE) % listed.len() as u64) as usize]
}

impl HiddenIn {
    /// The same seed gives the same mirror and effect. The mirror is one that this board can drive.
    ///
    /// # Errors
    /// Where none of those that are tried is one.
    pub(super) fn draw(seed: u64) -> Result<Self> {
        let effect = effect(seed);
        let family = FAMILIES[(seed % FAMILIES.len() as u64) as usize];
        for trial in 0..TRIALS {
            let config = MirrorConfig::draw(family, seed + APART * trial);
            let config = config.with_effect(effect, STRENGTH);
            if is_for_the_board(&config)? {
                return Ok(Self { effect, config });
            }
        }
        bail!("no mirror of seed {seed} is one for this board; take another seed")
    }

    /// How far from `z_um` above its rest a mirror is (um) that somebody has brought there who knows all of it, and where it is by
    /// its sensor only: what the sensor, zeroed at rest, is off by, and what wanders in it.
    pub(super) fn limit_um(&self, z_um: f64) -> f64 {
        let mut exact = self.config.clone();
        exact.sensor.position_noise_nm = 0.0;
        exact.sensor.wander_nm = 0.0;
        let read_um = |z_um| {
            let there = State {
                z_um,
                seen_z_um: z_um,
                ..State::default()
            };
            Sensor::new(&exact).read(&there, 0.0).z_um
        };
        let off_um = read_um(z_um) - read_um(0.0) - z_um;
        off_um.abs() + DEVIATIONS * 1e-3 * self.config.sensor.wander_nm
    }
}

/// Whether a mirror comes to all positions of a story, and does not get too hot for the board on the way.
fn is_for_the_board(config: &MirrorConfig) -> Result<bool, ConfigError> {
    let mut mirror = VirtualMirror::new(config)?;
    mirror.advance([HIGHEST_V; 4], SETTLED_S);
    let state = mirror.state();
    let hottest_k = state.heater_mean_k.into_iter().fold(0.0, f64::max);
    Ok(state.z_um >= FAR_UM && hottest_k <= HOT_K)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn as_many_seeds_in_a_row_as_there_are_effects_hide_each_of_them() {
        let count = listed().len() as u64;
        for first in [0, 1, 9301] {
            let hidden: BTreeSet<Effect> = (first..first + count).map(effect).collect();
            assert_eq!(hidden.len() as u64, count);
        }
    }

    #[test]
    fn the_limit_is_the_sensor_s_own_error_and_wander() {
        let hiding = |effect| HiddenIn {
            effect,
            config: MirrorConfig::draw(FAMILIES[0], 1).with_effect(effect, 1.0),
        };
        // 1 % of scale; the sensor of a drawn mirror wanders by 20 nm.
        let limit_um = hiding(Effect::SensorGain).limit_um(120.0);
        assert!((limit_um - (1.2 + 0.06)).abs() < 1e-9, "{limit_um}");
        // An offset is gone once the sensor is zeroed.
        for effect in [Effect::Hysteresis, Effect::SensorOffset] {
            let limit_um = hiding(effect).limit_um(120.0);
            assert!((limit_um - 0.06).abs() < 1e-9, "{limit_um}");
        }
    }
}
