//! The mirrors that figures are measured on.

use virtual_mirror::{Effect, Family, MirrorConfig};

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
