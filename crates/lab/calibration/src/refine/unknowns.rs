//! What enters the stages nonlinearly, by name, and as the coordinates that a fit moves.

use control_core::calibration::{FAST_POLES, Heat, LAGS, PLAYS, SLOW};
use least_squares::{Bounds, Prior};
use nalgebra::DVector;

use super::films::Films;
use super::heat::{FosterNetwork, HeatLoss, POLES};
use crate::memory::{CREEP_S, RADII};

/// Weights and times (s) where a fit starts besides the model's own poles: a mirror in its package. Bimorphs take 1 ms (the
/// paper); the frame of the virtual mirror `paper.toml` 43.7 uJ/K over 1.31 mW/K, which is 0.03 s, and its package 31.9 mJ/K
/// over 6.8 mW/K, which is 4.7 s. The others lie between them.
const USUAL: FosterNetwork = FosterNetwork {
    weight: [0.5, 0.3, 0.1, 0.01, 0.05],
    time_s: [1e-3, 0.03, 0.15, 0.7, 4.0],
    time_growth_s_per_k: 0.0,
};
/// The weight that a pole starts with of which the model knows nothing: little, and enough to have a slope.
const UNKNOWN: f64 = 5e-3;
/// Fastest and slowest pole (s): a control tick, and half of the two minutes that a session of jumps takes.
const POLE_S: (f64, f64) = (1e-4, 60.0);
/// Logarithms of weights, which are normalised to a sum of one: e^-20 is nothing.
const LN_WEIGHT: (f64, f64) = (-20.0, 20.0);
/// Growth of the heat loss (1/K): none, and a loss that is doubled at 10 K.
const GROWTH_PER_K: (f64, f64) = (0.0, 0.1);
/// Growth of the time constants over what a step's beginning tells of them (1/K): a rise of 150 K leaves a quarter of them, or makes them
/// four times as long. Under free convection the loss grows ever less, which a fit says as loss and time constants that both grow (0.014/K,
/// `bench foreign`, seed 901).
const TIME_GROWTH_PER_K: (f64, f64) = (-5e-3, 2e-2);
/// Unit in which their changes are fitted (1/K): about what air and radiation make (the file format's example has 0.0012 / K).
const GROWTH_UNIT_PER_K: f64 = 1e-3;
/// Fastest and slowest release of the play operators (s): two moves, and never within a session.
const RELEASE_S: (f64, f64) = (0.02, 1e4);
/// Where it starts (s): the drive's rounding loosens friction within half a second (docs/theory/identification.md).
const USUAL_RELEASE_S: f64 = 1.0;
/// The usual time constants of creep, where they start, are a factor of five apart; each stays within its own fifth, so that no two are
/// the same.
const CREEP_APART: f64 = 5.0;
/// So are the usual radii of play operators a factor of two.
const RADII_APART: f64 = 2.0;
/// But the widest of unusual films may be as wide as this part of the range: slip over all of a film ends nowhere before, and loops grow with the square of the
/// way (Rayleigh).
const WIDEST_PLAY: f64 = 0.35;
/// Shortest and longest lag of the beams (s): a tenth of a tick, and twice that of the usual foreign mirror (`bench foreign`, seed 901). A
/// longer one and a fast pole nearly cancel each other, and a mirror whose beams take a millisecond rests 0.2 um off. Where it starts: a tick.
const BEAM_LAG_S: (f64, f64) = (1e-5, 3e-4);
const USUAL_BEAM_LAG_S: f64 = 1e-4;
/// Standard deviation of all coordinates around the start: a factor of 20 either way, and 0.003 / K of growth. It keeps what
/// the data do not determine, and the scale of the weights.
const PRIOR: f64 = 3.0;

/// What enters the stages nonlinearly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unknowns {
    /// Thermal poles; the weights count relative to each other.
    pub(super) network: FosterNetwork,
    /// Time constant with which the beams follow their heaters (s).
    pub(super) beam_lag_s: f64,
    /// What is added to the growth of every actuator's heat loss (1/K).
    pub(super) added_growth_per_k: f64,
    /// Time in which the play operators let go (s).
    pub(super) release_s: f64,
    /// Time constants of creep (s).
    pub(super) creep_s: [f64; LAGS],
    /// Radii of the play operators, as shares of the range.
    pub(super) radii: [f64; PLAYS],
}

impl Unknowns {
    /// Where fits start: at a calibration's own poles, and at the usual ones.
    pub(super) fn starts(heat: &Heat) -> [Self; 2] {
        [FosterNetwork::of(heat), USUAL].map(|network| Self {
            network: completed(&network),
            beam_lag_s: USUAL_BEAM_LAG_S,
            added_growth_per_k: 0.0,
            release_s: USUAL_RELEASE_S,
            creep_s: CREEP_S,
            radii: RADII,
        })
    }

    /// As a fit moves them: logarithms of times and weights, the growths in their unit, the logarithms of the lag, of the release, of the
    /// times of creep and of the radii.
    pub(super) fn coordinates(&self) -> DVector<f64> {
        let poles = self.network.time_s.iter().chain(&self.network.weight);
        let time_growth_per_k = self.network.time_growth_s_per_k / self.network.initial_time_s();
        let growths = [self.added_growth_per_k, time_growth_per_k];
        let growths = growths.map(|per_k| per_k / GROWTH_UNIT_PER_K);
        let memory = [&self.beam_lag_s, &self.release_s]
            .into_iter()
            .chain(&self.creep_s)
            .chain(&self.radii);
        let logarithms = |values: f64| values.ln();
        let all = poles.copied().map(logarithms).chain(growths);
        let all = all.chain(memory.copied().map(logarithms));
        DVector::from_iterator(2 * POLES + 4 + LAGS + PLAYS, all)
    }

    /// Whether these heat a mirror as the others do.
    pub(super) fn heats_like(&self, others: &Self) -> bool {
        let heat = |of: &Self| (of.network, of.beam_lag_s, of.added_growth_per_k);
        heat(self) == heat(others)
    }

    /// Whether a mirror remembers with these as with the others.
    pub(super) fn remembers_like(&self, others: &Self) -> bool {
        let memory = |of: &Self| (of.release_s, of.creep_s, of.radii);
        memory(self) == memory(others)
    }

    /// From such coordinates.
    pub(super) fn at(coordinates: &DVector<f64>) -> Self {
        let mut values = coordinates.iter().copied();
        let mut next = || values.next().expect("as many coordinates as unknowns");
        let time_s = std::array::from_fn(|_| next().exp());
        let weight: [f64; POLES] = std::array::from_fn(|_| next().exp());
        let whole: f64 = weight.iter().sum();
        let mut network = FosterNetwork {
            weight: weight.map(|weight| weight / whole),
            time_s,
            time_growth_s_per_k: 0.0,
        };
        let added_growth_per_k = next() * GROWTH_UNIT_PER_K;
        network.time_growth_s_per_k = next() * GROWTH_UNIT_PER_K * network.initial_time_s();
        Self {
            network,
            added_growth_per_k,
            beam_lag_s: next().exp(),
            release_s: next().exp(),
            creep_s: std::array::from_fn(|_| next().exp()),
            radii: std::array::from_fn(|_| next().exp()),
        }
    }

    /// Where the coordinates stay, on a mirror with these heat losses: what the core's stages can hold.
    pub(super) fn bounds(losses: &[HeatLoss], films: Films) -> Bounds {
        let slow_s = f64::from(SLOW.0);
        let times = (0..POLES).map(|pole| {
            if pole < FAST_POLES {
                (POLE_S.0.ln(), slow_s.ln())
            } else {
                (slow_s.ln(), POLE_S.1.ln())
            }
        });
        let growths = || losses.iter().map(|loss| loss.growth);
        let least = growths().fold(f64::INFINITY, f64::min);
        let most = growths().fold(0.0, f64::max);
        let growth = (
            (GROWTH_PER_K.0 - most) / GROWTH_UNIT_PER_K,
            (GROWTH_PER_K.1 - least).max(0.0) / GROWTH_UNIT_PER_K,
        );
        let time_growth = (
            TIME_GROWTH_PER_K.0 / GROWTH_UNIT_PER_K,
            TIME_GROWTH_PER_K.1 / GROWTH_UNIT_PER_K,
        );
        let logarithms = |(least, most): (f64, f64)| (least.ln(), most.ln());
        let memory = [BEAM_LAG_S, RELEASE_S].map(logarithms);
        let about =
            |usual: f64, apart: f64| (usual.ln() - 0.5 * apart.ln(), usual.ln() + 0.5 * apart.ln());
        let creep = CREEP_S.map(|usual_s| about(usual_s, CREEP_APART));
        let mut radii = RADII.map(|usual| about(usual, RADII_APART));
        if films == Films::Unusual {
            radii[PLAYS - 1].1 = WIDEST_PLAY.ln();
        }
        let network = times.chain([LN_WEIGHT; POLES]);
        Bounds::new(
            network
                .chain([growth, time_growth])
                .chain(memory)
                .chain(creep)
                .chain(radii),
        )
    }

    /// What is known of the coordinates before anything was measured.
    pub(super) fn prior(&self) -> Prior {
        Prior::around(self.coordinates(), PRIOR)
    }

    /// The heat losses of actuators that had `before`.
    pub(super) fn losses<const N: usize>(&self, before: &[HeatLoss; N]) -> [HeatLoss; N] {
        before.map(|loss| HeatLoss {
            growth: (loss.growth + self.added_growth_per_k).clamp(GROWTH_PER_K.0, GROWTH_PER_K.1),
            ..loss
        })
    }
}

/// With a light pole at its usual place for every one that is not there.
fn completed(network: &FosterNetwork) -> FosterNetwork {
    let mut completed = *network;
    for pole in 0..POLES {
        if network.weight[pole] > UNKNOWN {
            completed.time_s[pole] = network.time_s[pole].max(POLE_S.0);
        } else {
            completed.weight[pole] = UNKNOWN;
            completed.time_s[pole] = USUAL.time_s[pole];
        }
    }
    completed
}

#[cfg(test)]
mod tests {
    use super::*;
    use control_core::Second;
    use control_core::calibration::Lag;

    #[test]
    fn every_coordinate_belongs_to_heat_or_to_memory() {
        let [start, _] = Unknowns::starts(&Heat::INSTANT);
        let at = start.coordinates();
        let before = Unknowns::at(&at);
        assert!(before.heats_like(&before) && before.remembers_like(&before));
        for index in 0..at.len() {
            let mut moved = at.clone();
            moved[index] += 1e-4;
            let moved = Unknowns::at(&moved);
            assert!(
                before.heats_like(&moved) != before.remembers_like(&moved),
                "{index}"
            );
        }
    }

    #[test]
    fn coordinates_name_the_unknowns_and_lead_back_to_them() {
        let unknowns = Unknowns {
            network: FosterNetwork {
                weight: [0.4, 0.3, 0.2, 0.06, 0.04],
                time_growth_s_per_k: 2e-6,
                ..USUAL
            },
            added_growth_per_k: -5e-4,
            beam_lag_s: 3e-4,
            release_s: 2.0,
            creep_s: [0.2, 2.0, 6.0, 40.0],
            radii: [0.01, 0.03, 0.07, 0.15],
        };
        let coordinates = unknowns.coordinates();
        let back = Unknowns::at(&coordinates);
        for pole in 0..POLES {
            let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
            assert!(close(
                back.network.weight[pole],
                unknowns.network.weight[pole]
            ));
            assert!(close(
                back.network.time_s[pole],
                unknowns.network.time_s[pole]
            ));
        }
        assert!((back.added_growth_per_k + 5e-4).abs() < 1e-15);
        assert!((back.network.time_growth_s_per_k - 2e-6).abs() < 1e-15);
        assert!((back.beam_lag_s - 3e-4).abs() < 1e-15);
        assert!((back.release_s - 2.0).abs() < 1e-12);
        for (back, creep_s) in back.creep_s.into_iter().zip(unknowns.creep_s) {
            assert!((back / creep_s - 1.0).abs() < 1e-12);
        }
        for (back, radius) in back.radii.into_iter().zip(unknowns.radii) {
            assert!((back / radius - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn weights_add_up_to_one_whatever_the_coordinates() {
        let moved = Unknowns::starts(&Heat::INSTANT)[1]
            .coordinates()
            .add_scalar(0.7);
        let sum: f64 = Unknowns::at(&moved).network.weight.iter().sum();
        assert!((sum - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_start_is_within_the_bounds_and_keeps_the_poles_that_are_known() {
        let mut heat = Heat::INSTANT;
        heat.fast[1] = Lag {
            weight: 0.4,
            time: Second(0.05),
        };
        let losses = [HeatLoss {
            k_per_w: 6000.0,
            growth: 1e-3,
        }];
        let bounds = Unknowns::bounds(&losses, Films::Usual);
        let starts = Unknowns::starts(&heat);
        for start in starts {
            let coordinates = start.coordinates();
            assert_eq!(bounds.clamp(&coordinates), coordinates);
        }
        assert_eq!(starts[0].network.time_s[1], f64::from(0.05_f32));
        assert_eq!(starts[0].network.weight[2], UNKNOWN);
        assert_eq!(starts[0].network.time_s[2], USUAL.time_s[2]);
        assert_eq!(starts[1].network, USUAL);
        // At the bounds of the growth the loss is at the ends of what it may be.
        let growth = |coordinate: f64| {
            let mut at = starts[1].coordinates();
            at[2 * POLES] = coordinate;
            Unknowns::at(&at).losses(&losses)[0].growth
        };
        assert!(growth(bounds.low(2 * POLES)).abs() < 1e-15);
        assert!((growth(bounds.high(2 * POLES)) - 0.1).abs() < 1e-15);
    }
}
