//! What a kelvin of the room is worth, in kelvins of the heaters, beside what the first milliseconds of a step would say of it.
//!
//! A heater that runs all along the beam warms it evenly at first, as a room does, before the ends take their part of the heat away: so
//! the bend for each kelvin of the heaters should begin at what it is for each kelvin of the room.

use virtual_mirror::{ConfigError, Effect, Family, MirrorConfig, VirtualMirror};

/// The room is so much warmer (K); smaller than what the drive makes of the heaters.
const ROOM_K: f64 = 5.0;
/// Long enough for heat and substrate to settle (s).
const SETTLED_S: f64 = 60.0;
/// The step of the drives (V), and when it is looked at (s).
const STEP_V: (f64, f64) = (1.5, 1.7);
const LOOKED_AT_S: [f64; 4] = [5e-4, 1e-3, 2e-3, 5e-3];

fn main() -> Result<(), ConfigError> {
    println!("mirror   room   at {LOOKED_AT_S:?} s of a step");
    let families = [
        (Family::A, 31),
        (Family::B, 32),
        (Family::C, 741),
        (Family::C, 751),
        (Family::D, 745),
        (Family::E, 742),
        (Family::E, 752),
        (Family::F, 743),
        (Family::F, 753),
        (Family::G, 744),
        (Family::G, 754),
    ];
    for (family, seed) in families {
        let config = MirrorConfig::draw(family, seed)
            .with_effect(Effect::HeatLossTemperature, 1.0)
            .with_effect(Effect::SubstrateWarming, 0.7);
        let curve = Curve::of(&config)?;
        let early = early(&config, &curve)?;
        let early: Vec<_> = early.iter().map(|ratio| format!("{ratio:.3}")).collect();
        let name = format!("{family:?} {seed}");
        println!(
            "{name:7} {:.3}   {}",
            ratio(&config, &curve)?,
            early.join("  ")
        );
    }
    Ok(())
}

/// The heaters' mean temperature (K) and the displacement (um).
fn seen(mirror: &VirtualMirror) -> (f64, f64) {
    let state = mirror.state();
    (state.heater_mean_k.iter().sum::<f64>() / 4.0, state.z_um)
}

/// Both at rest in the room of the calibration, by rising drive.
struct Curve(Vec<(f64, f64)>);

impl Curve {
    fn of(config: &MirrorConfig) -> Result<Self, ConfigError> {
        let mut mirror = VirtualMirror::new(config)?;
        let at_rest = |step: u32| {
            mirror.advance([0.1 * f64::from(step); 4], SETTLED_S);
            seen(&mirror)
        };
        Ok(Self((0..=35).map(at_rest).collect()))
    }

    /// How warm the heaters are where the mirror is so far down.
    fn heaters_k(&self, z_um: f64) -> f64 {
        let above = self.0.partition_point(|(_, z)| *z < z_um);
        let above = above.clamp(1, self.0.len() - 1);
        let ((low_k, low_um), (high_k, high_um)) = (self.0[above - 1], self.0[above]);
        low_k + (z_um - low_um) * (high_k - low_k) / (high_um - low_um)
    }
}

/// Kelvins of the heaters for each of the room, at half of the range.
fn ratio(config: &MirrorConfig, curve: &Curve) -> Result<f64, ConfigError> {
    let mut mirror = VirtualMirror::new(config)?;
    mirror.set_ambient(ROOM_K);
    mirror.advance([2.0; 4], SETTLED_S);
    let (heaters_k, z_um) = seen(&mirror);
    Ok((curve.heaters_k(z_um) - heaters_k) / ROOM_K)
}

/// What the bend has come for each kelvin that the heaters have, in parts of what it is at rest.
fn early(config: &MirrorConfig, curve: &Curve) -> Result<Vec<f64>, ConfigError> {
    let mut mirror = VirtualMirror::new(config)?;
    let (from_v, to_v) = STEP_V;
    mirror.advance([from_v; 4], SETTLED_S);
    let (from_k, from_um) = seen(&mirror);
    let mut passed_s = 0.0;
    let ratios = LOOKED_AT_S.iter().map(|at_s| {
        mirror.advance([to_v; 4], at_s - passed_s);
        passed_s = *at_s;
        let (heaters_k, z_um) = seen(&mirror);
        (curve.heaters_k(z_um) - curve.heaters_k(from_um)) / (heaters_k - from_k)
    });
    Ok(ratios.collect())
}
