//! The mirrors that figures are measured on.

use virtual_mirror::{Effect, Family, MirrorConfig};

/// Scatter of a mirror's actuators in their loss and their curvature, as docs/requirements.md has it (standard deviation).
const SCATTER: f64 = 0.03;

/// The mirror with that scatter.
pub fn scattered(mut config: MirrorConfig) -> MirrorConfig {
    config.spread.air_loss = SCATTER;
    config.spread.bend = SCATTER;
    config
}

/// A mirror of a family, with what usual ones have: the loss, substrate, memory and resonance that the paper's has beyond the
/// layout.
pub fn usual_mirror(family: Family, seed: u64) -> MirrorConfig {
    MirrorConfig::draw(family, seed)
        .with_effect(Effect::HeatLossTemperature, 1.0)
        .with_effect(Effect::SubstrateWarming, 0.7)
        .with_effect(Effect::Hysteresis, 0.3)
        .with_effect(Effect::Creep, 0.2)
        .with_effect(Effect::Resonance, 1.0)
}
