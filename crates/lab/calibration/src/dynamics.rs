//! The model in time: which of its stages the core inverts, and how.

use control_core::calibration::{
    FAST_POLES, Heat, LAGS, Lag, Memory, Path, Play, SLOW, SLOW_POLES,
};
use control_core::{Micrometre, Second};
use mirror_model::Model;
use mirror_model::effect::Active;

use crate::Remaining;

/// Time of a move where no resonance is known: that of the lowest in this family of mirrors.
const LOWEST_RESONANCE_HZ: f64 = 500.0;
/// Periods of the lowest resonance that a move takes.
pub(crate) const PERIODS: f64 = 5.0;

fn value(active: &Active, symbol: &str) -> f64 {
    let parameters = active.effect.info().parameters.iter();
    parameters
        .zip(&active.values)
        .find(|(parameter, _)| parameter.symbol == symbol)
        .map_or(0.0, |(_, value)| *value)
}

fn find<'a>(model: &'a Model, id: &str) -> Option<&'a Active> {
    model.effects.iter().find(|active| active.id() == id)
}

/// A weight and a time constant (s).
type Pole = (f64, f64);

/// The thermal poles, as parts of the whole.
pub(crate) fn heat(model: &Model) -> Heat {
    let p = &model.parameters;
    let mut poles = vec![
        (1.0 - p.middle_weight - p.slow_weight, p.fast_s),
        (p.middle_weight, p.middle_s),
        (p.slow_weight, p.slow_s),
    ];
    if let Some(warming) = find(model, "substrate-warming") {
        poles.push((value(warming, "w"), value(warming, "tau")));
    }
    if let Some(lag) = find(model, "thermal-lag") {
        poles = behind(&poles, value(lag, "w"), value(lag, "tau"));
    }
    poles.retain(|(weight, _)| *weight > 0.0);
    let whole: f64 = poles.iter().map(|(weight, _)| weight).sum();
    let is_slow = |pole: &Pole| pole.1 >= f64::from(SLOW.0);
    let (slow, fast): (Vec<_>, Vec<_>) = poles
        .iter()
        .map(|(weight, time)| (weight / whole, *time))
        .partition(is_slow);
    Heat {
        fast: lags::<FAST_POLES>(fast, Second(0.0)),
        slow: lags::<SLOW_POLES>(slow, SLOW),
    }
}

/// Poles of which the part `w` goes through one more lag: partial fractions of the product.
fn behind(poles: &[Pole], w: f64, tau: f64) -> Vec<Pole> {
    let mut new_weight = 0.0;
    let mut expanded: Vec<Pole> = poles
        .iter()
        .map(|&(weight, time)| {
            // Two equal lags in a row have no partial fractions; a ppm apart is as good.
            let apart = if (time - tau).abs() < 1e-6 * tau {
                1e-6 * tau
            } else {
                time - tau
            };
            new_weight -= weight * w * tau / apart;
            (weight * (1.0 - w) + weight * w * time / apart, time)
        })
        .collect();
    expanded.push((new_weight, tau));
    expanded
}

/// So many lags: the lightest is merged with its neighbour in time as long as there are too many.
fn lags<const N: usize>(mut poles: Vec<Pole>, unused: Second) -> [Lag; N] {
    poles.sort_by(|a, b| a.1.total_cmp(&b.1));
    while poles.len() > N {
        let lightest = (0..poles.len())
            .min_by(|&a, &b| poles[a].0.total_cmp(&poles[b].0))
            .unwrap_or_default();
        let (weight, time) = poles.remove(lightest);
        let neighbour = &mut poles[lightest.saturating_sub(1)];
        let both = neighbour.0 + weight;
        neighbour.1 = (neighbour.0 * neighbour.1 + weight * time) / both;
        neighbour.0 = both;
    }
    std::array::from_fn(|i| {
        poles.get(i).map_or(
            Lag {
                weight: 0.0,
                time: unused,
            },
            |&(weight, time)| Lag {
                weight: weight as f32,
                time: Second(time as f32),
            },
        )
    })
}

/// Hysteresis and creep.
pub(crate) fn memory(model: &Model) -> Memory {
    let mut memory = Memory::NONE;
    if let Some(hysteresis) = find(model, "hysteresis") {
        let (w, r) = (value(hysteresis, "w"), value(hysteresis, "r"));
        memory.plays = std::array::from_fn(|k| Play {
            weight: if k < 3 { (w / 3.0) as f32 } else { 0.0 },
            radius: Micrometre((r * (k.min(2) + 1) as f64 / 3.0) as f32),
        });
    }
    if let Some(creep) = find(model, "creep") {
        let (c, tau) = (value(creep, "c"), value(creep, "tau"));
        let elements = [0.2, 1.0, 5.0].map(|factor| (c / 3.0, factor * tau));
        memory.creep = lags::<LAGS>(elements.to_vec(), SLOW);
    }
    memory
}

/// How long a move takes.
pub(crate) fn path(model: &Model) -> Path {
    let hz = find(model, "resonance").map_or(LOWEST_RESONANCE_HZ, |active| value(active, "f"));
    Path {
        move_time: Second((PERIODS / hz) as f32),
    }
}

/// What the core does not invert.
pub(crate) fn remaining(model: &Model) -> Vec<Remaining> {
    let because = |active: &Active| -> Option<&'static str> {
        Some(match active.id() {
            "hysteresis" | "creep" | "substrate-warming" | "thermal-lag" => return None,
            "ambient-drift" => {
                "the board knows neither the clock nor the room; calibrate when the room is another"
            }
            "softening" => "what yields stays bent; calibrate after the hottest excursion",
            "resonance" => {
                "moves are long enough not to make it ring, but what shakes the mirror still does"
            }
            "crosstalk" => "it is inverted where all four actuators are driven alike",
            "electrostatic-pull" => "it is inverted at rest; it acts at once, and heat later",
            "sensor-offset" | "sensor-gain" | "sensor-nonlinearity" | "sensor-lag" => {
                "it is the sensor's, and the mirror goes where it should"
            }
            _ if active.effect.states() > 0 => "it is inverted at rest; its memory is not",
            _ => return None,
        })
    };
    let effects = model.effects.iter();
    effects
        .filter_map(|active| {
            Some(Remaining {
                effect: active.id().to_owned(),
                because: because(active)?,
            })
        })
        .collect()
}
