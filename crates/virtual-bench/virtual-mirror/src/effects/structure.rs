//! Effects that are another construction or other films of the same mirror: applied to its description before it is
//! built.

use super::catalogue::{Effect, Effects};
use crate::config::{Frame, MirrorConfig, MotionConfig};

/// The description with these effects worked in.
pub(crate) fn reconstruct(config: &MirrorConfig) -> MirrorConfig {
    let mut config = config.clone();
    let effects = config.effects.clone();
    if let Some(strength) = effects.active(Effect::FilmTcr) {
        // Bulk platinum has 3.9e-3/K, sputtered films of 0.2 um about 3e-3/K.
        config.heater.tcr_per_k /= 1.0 + 0.3 * strength;
    }
    if let Some(strength) = effects.active(Effect::InitialCurl) {
        config.shape.rest_height_um = (config.shape.rest_height_um + 220.0 * strength).min(380.0);
    }
    if let Some(strength) = effects.active(Effect::Resonance) {
        config.motion = Some(resonance(config.motion, strength));
    }
    if let Some(strength) = effects.active(Effect::SubstrateWarming) {
        config.frame = Some(warming_frame(strength));
        config.air_to_frame = config.air_to_frame.max(0.6);
    }
    config
}

/// A lightly damped plate; stronger is slower and rings longer.
fn resonance(present: Option<MotionConfig>, strength: f64) -> MotionConfig {
    let piston_hz = 1300.0 / strength.sqrt();
    let tilt_hz = present.map_or(1.3 * piston_hz, |motion| motion.tilt_hz);
    MotionConfig {
        piston_hz,
        tilt_hz,
        q: 1.0 + 11.0 * strength,
    }
}

/// A small package: 5 % of the beams' warming at strength 1, after seconds.
fn warming_frame(strength: f64) -> Frame {
    Frame {
        frame_uj_k: 6e3,
        frame_to_package_uw_k: 3.5e4 / strength,
        package_mj_k: 60.0,
        package_to_room_uw_k: 1.4e4 / strength,
    }
}

/// First and second correction of expansion that is linear in temperature, `t (1 + t (p + q t))`. Bulk
/// aluminium is at strength 0.5: 23.1e-6/K at 293 K and 26.4e-6/K at 500 K (Touloukian, Thermophysical Properties of
/// Matter, vol. 12) are 7e-4/K, which is 2 p.
pub(crate) fn expansion(effects: &Effects) -> [f64; 2] {
    let per_kelvin = 7.5e-4 * effects.strength(Effect::ExpansionTemperature);
    [per_kelvin, -per_kelvin / 600.0]
}
