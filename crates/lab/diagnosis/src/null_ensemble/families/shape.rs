//! How far the ensemble's beams turn while they bend, at rest and driven. Height says little of that: on beams of half the length, or of arcs
//! of other lengths, a plate that stands as high and moves as far does so by slopes that are twice as steep, and what lumped equations leave
//! of z grows with their square.

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::LN_2;
use virtual_mirror::{MirrorConfig, Segment};

/// Spread of the beams' length (a standard deviation of its logarithm): two are a factor of two, as between an actuator of one S and the
/// paper's, which folds two.
const LENGTH: f64 = 0.5 * LN_2;
/// Spread of the length of each kind of bimorph beside the others': two standard deviations take the ratio of the non-inverted one to the inverted one from
/// the paper's 2 to 1.1 and to 3.5, so to two equal arcs, which end level by themselves.
const ARC: f64 = 0.2;
/// Residual strain of platinum in parts of aluminium's, each beside the oxide's. A beam that stands up by the paper's 220 um is curled as if it were some
/// 130 K colder, by 2.9e-3 of strain; as much is 0.5 GPa in platinum, and sputtered metals are under -0.5 to 1 GPa [J. Thornton and D. Hoffman,
/// "Stress-related effects in thin films", Thin Solid Films 171 (1989) 5-31].
const PLATINUM: (f64, f64) = (-1.0, 2.0);
/// Steepest mean slope of a beam at rest: twice that of the paper's, which stands up by 220 um on a path of a millimetre.
const MEAN_SLOPE: f64 = 0.44;

/// Draws lengths, films and residual strains of a mirror whose rest height is drawn.
pub(super) fn draw(config: &mut MirrorConfig, rng: &mut ChaCha8Rng) {
    let mut factor = |spread: f64| {
        let normal: f64 = StandardNormal.sample(rng);
        (spread * normal.clamp(-2.5, 2.5)).exp()
    };
    let length = factor(LENGTH);
    let arcs = [factor(ARC), factor(ARC), factor(ARC)];
    for segment in &mut config.segments {
        scale(segment, length, arcs);
    }
    let [al, oxide] = [config.materials.al, config.materials.sio2].map(|film| film.expansion_ppm_k);
    let platinum = rng.random_range(PLATINUM.0..PLATINUM.1);
    config.materials.pt.residual_ppm = Some(oxide + (al - oxide) * platinum);
    let path_um: f64 = config.segments.iter().map(|s| s.length_um).sum();
    let rest_um = &mut config.shape.rest_height_um;
    *rest_um = rest_um.min(MEAN_SLOPE * path_um);
}

/// A mirror that is to move as far on beams of another length L has films whose thickness t goes with its square, for z ~ L^2 / t. How its heat
/// flows is drawn elsewhere: what a beam conducts and what it loses to the air stay.
fn scale(segment: &mut Segment, length: f64, [noninverted, overlap, inverted]: [f64; 3]) {
    let arc = match segment.name.as_str() {
        "NI" => noninverted,
        "OL" => overlap,
        "IV" => inverted,
        _ => return,
    };
    segment.length_um *= length * arc;
    for layer in &mut segment.layers {
        layer.um *= length * length;
    }
    segment.width_um /= length;
    segment.air_loss_w_m_k /= length;
}

#[cfg(test)]
mod tests {
    use super::*;
    use virtual_mirror::{Family, VirtualMirror};

    fn driven(length: f64, arcs: [f64; 3]) -> virtual_mirror::State {
        let mut config = MirrorConfig::draw(Family::A, 3);
        for segment in &mut config.segments {
            scale(segment, length, arcs);
        }
        let mut mirror = VirtualMirror::new(&config).expect("a mirror that can be");
        mirror.advance([2.0; 4], 30.0);
        mirror.state()
    }

    #[test]
    fn a_mirror_on_shorter_beams_is_as_warm_and_moves_as_far() {
        let [usual, short] = [1.0, 0.6].map(|length| driven(length, [1.0; 3]));
        for (usual, short) in usual.heater_mean_k.iter().zip(short.heater_mean_k) {
            assert!((short / usual - 1.0).abs() < 1e-6, "{usual} {short}");
        }
        // Isolations are not scaled, and take a part of the clamping.
        let ratio = short.z_um / usual.z_um;
        assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
    }

    #[test]
    fn a_mirror_on_longer_arcs_moves_further() {
        let [usual, longer] = [1.0, 1.2].map(|arc| driven(1.0, [arc, 1.0, 1.0]));
        assert!(longer.z_um > 1.05 * usual.z_um);
    }

    #[test]
    fn a_beam_at_rest_is_no_steeper_than_beams_are() {
        let mut rng = rand::SeedableRng::seed_from_u64(1);
        for seed in 0..200 {
            let mut config = MirrorConfig::draw(Family::D, seed);
            config.shape.rest_height_um = 300.0;
            draw(&mut config, &mut rng);
            let path_um: f64 = config.segments.iter().map(|s| s.length_um).sum();
            assert!(config.shape.rest_height_um <= MEAN_SLOPE * path_um);
        }
    }
}
