//! The model in time: which of its stages the core inverts, and how.

use control_core::calibration::{FAST_POLES, Heat, Lag, Path, Resonance, SLOW, SLOW_POLES};
use control_core::{Hertz, Second};
use mirror_model::Model;
use mirror_model::effect::Active;

/// Taken for the lowest resonance where none is known (Hz): half of what the family of the paper's mirror has, so that a move is rather too
/// slow.
const LOWEST_RESONANCE_HZ: f64 = 500.0;
/// Periods of the lowest resonance that a move takes. A minimum-jerk move of n periods has a jump of its jerk at both ends, each of
/// which rings by 60 / (2 pi n)^3 of the move: together 0.4 % at most.
const PERIODS: f64 = 5.0;
/// Periods of a resonance that is known, which the way leads the plate through: where its frequency is 3 % off, a move rings by 0.6 % at most
/// (`control_core::path`).
const PERIODS_LED: f64 = 2.5;

pub(crate) fn value(active: &Active, symbol: &str) -> f64 {
    let parameters = active.effect.info().parameters.iter();
    parameters
        .zip(&active.values)
        .find(|(parameter, _)| parameter.symbol == symbol)
        .map_or(0.0, |(_, value)| *value)
}

/// An effect, in the form that the core inverts.
pub(crate) fn find<'a>(model: &'a Model, id: &str) -> Option<&'a Active> {
    let mut inverted = model
        .effects
        .iter()
        .filter(|active| active.effect.is_inverted());
    inverted.find(|active| active.id() == id)
}

/// A weight and a time constant (s).
pub(crate) type Pole = (f64, f64);

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
        ..Heat::INSTANT
    }
}

/// Poles of which the part `w` goes through one more lag, all of whose weights are positive as the core inverts them.
///
/// Of the product's partial fractions a slower pole gives the lag a negative part, and a pole that is hardly faster than the lag has one
/// itself. Where the others do not outweigh it, that pole is delayed as a whole, by `w tau`: gain and first moment, so how late a slow
/// course is, are the product's. Its second moment, `t^2 + w t tau + w tau^2`, is less than the square of the first there; lags of positive
/// weights have no less than that square, and a single one has it.
fn behind(poles: &[Pole], w: f64, tau: f64) -> Vec<Pole> {
    let has_parts = |pole: &Pole| pole.1 < (1.0 - w) * tau || pole.1 > tau;
    let (mut parted, mut delayed): (Vec<Pole>, Vec<Pole>) =
        poles.iter().partition(|p| has_parts(p));
    let given = |&(weight, time): &Pole| weight * w * tau / (tau - time);
    // The one that gives the lag most of what is negative comes last.
    parted.sort_by(|a, b| given(b).total_cmp(&given(a)));
    while parted.iter().map(given).sum::<f64>() < 0.0 {
        delayed.extend(parted.pop());
    }
    let lag = (parted.iter().map(given).sum(), tau);
    let kept = parted.iter().map(|pole| (pole.0 - given(pole), pole.1));
    let late = delayed
        .iter()
        .map(|(weight, time)| (*weight, time + w * tau));
    kept.chain(late).chain([lag]).collect()
}

/// So many lags: the lightest is merged with its neighbour in time as long as there are too many.
pub(crate) fn lags<const N: usize>(mut poles: Vec<Pole>, unused: Second) -> [Lag; N] {
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

/// How the mirror of a model goes to a new position.
pub(crate) fn path(model: &Model) -> Path {
    let mut effects = model.effects.iter();
    let resonance = effects.find(|active| active.id() == "resonance");
    path_of(resonance.map(|active| Resonance {
        frequency: Hertz(value(active, "f") as f32),
        quality: value(active, "Q") as f32,
    }))
}

/// How a mirror with this resonance goes to a new position.
pub(crate) fn path_of(resonance: Option<Resonance>) -> Path {
    let hz = resonance.map_or(LOWEST_RESONANCE_HZ, |known| known.frequency.0.into());
    let led = resonance.filter(|known| Resonance::SHAPED_HZ.contains(&known.frequency.0));
    let periods = if led.is_some() { PERIODS_LED } else { PERIODS };
    Path {
        move_time: Second((periods / hz) as f32),
        resonance: led.unwrap_or(Resonance::UNKNOWN),
    }
}

/// The frequency up to which the plate follows (Hz), as far as its way tells.
pub(crate) fn lowest_resonance_hz(path: &Path) -> f64 {
    match path.resonance.is_known() {
        true => path.resonance.frequency.0.into(),
        false => PERIODS / f64::from(path.move_time.0),
    }
}

/// An effect that the core does not invert, or not wholly.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Remaining {
    /// Its id.
    pub effect: String,
    /// What becomes of it.
    pub because: &'static str,
}

/// What the core does not invert.
pub(crate) fn remaining(model: &Model) -> Vec<Remaining> {
    let because = |active: &Active| -> Option<&'static str> {
        Some(match active.id() {
            "ambient-drift" => {
                "the board knows neither the clock nor the room; calibrate when the room is another"
            }
            "softening" => "what yields stays bent; calibrate after the hottest excursion",
            "resonance" => {
                "moves lead the plate without making it ring, but what shakes the mirror still does"
            }
            "crosstalk" => "it is inverted where all four actuators are driven alike",
            "electrostatic-pull" if !active.effect.is_inverted() => {
                "it moves the plate as a whole, which the actuators' tables do not"
            }
            "electrostatic-pull" => "it is inverted at rest; it acts at once, and heat later",
            "sensor-offset"
            | "sensor-drift"
            | "sensor-gain"
            | "sensor-nonlinearity"
            | "sensor-lag" => "it is the sensor's, and the mirror goes where it should",
            _ if active.effect.is_inverted() => return None,
            "hysteresis" => "it is inverted as play operators only",
            _ => "it is inverted at rest; its memory is not",
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

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use control_core::Calibration;
    use control_core::calibration::{CalibrationError, Field, Parts, Problem};
    use mirror_model::Preset;
    use mirror_model::effect;
    use proptest::prelude::*;

    use super::*;

    /// What f32 keeps of numbers about 1.
    const F32: f64 = 1e-6;

    fn with(id: &str, values: &[f64]) -> Model {
        let mut model = Model::from(Preset::Paper);
        let mut active = Active::usual(effect::find(id).expect("a built-in effect"));
        active.values = values.to_vec();
        model.effects = vec![active];
        model
    }

    fn pairs<const N: usize>(lags: [Lag; N]) -> Vec<(f64, f64)> {
        let pair = |lag: Lag| (f64::from(lag.weight), f64::from(lag.time.0));
        lags.map(pair).to_vec()
    }

    #[track_caller]
    fn assert_alike(found: &[(f64, f64)], expected: &[(f64, f64)]) {
        let off = |(a, b): (&(f64, f64), &(f64, f64))| (a.0 - b.0).abs().max((a.1 - b.1).abs());
        let worst = found.iter().zip(expected).map(off).fold(0.0, f64::max);
        assert!(found.len() == expected.len() && worst < F32, "{found:?}");
    }

    #[test]
    fn one_more_lag_behind_faster_poles_is_in_partial_fractions() {
        // Half of 1 / (1 + s) through 1 / (1 + 4 s): 4/3 / (1 + 4 s) - 1/3 / (1 + s) for that half.
        let third = 1.0 / 3.0;
        let expected = [(0.5 - 0.5 * third, 1.0), (2.0 * third, 4.0)];
        assert_alike(&behind(&[(1.0, 1.0)], 0.5, 4.0), &expected);
        assert_alike(&behind(&[(1.0, 2.0)], 0.0, 1.0), &[(1.0, 2.0), (0.0, 1.0)]);
    }

    #[test]
    fn a_pole_that_a_lag_makes_negative_parts_of_is_delayed_as_a_whole() {
        // Behind two equal lags in a row, a slow course is as late as behind one of twice the time.
        let none = (0.0, 2.0);
        assert_alike(&behind(&[(1.0, 2.0)], 1.0, 2.0), &[(1.0, 4.0), none]);
        // A slower pole, and one that is hardly faster.
        assert_alike(&behind(&[(1.0, 3.0)], 0.5, 2.0), &[(1.0, 4.0), none]);
        assert_alike(&behind(&[(1.0, 1.5)], 0.5, 2.0), &[(1.0, 2.5), none]);
        // What a faster pole gives the lag outweighs what a much slower one takes.
        let both = behind(&[(0.5, 0.1), (0.5, 200.0)], 0.5, 2.0);
        assert_eq!(both.len(), 3);
        assert!(
            both.iter()
                .all(|(weight, time)| *weight > 0.0 && *time <= 201.0)
        );
    }

    static FACTORY: LazyLock<Calibration> = LazyLock::new(|| {
        let tabulated = crate::tabulate(&Model::from(Preset::Reconciled));
        tabulated.expect("it tabulates").calibration
    });

    /// Weights and times of what may be in the stage `heat`, in the ranges of the model's effect `thermal-lag`.
    fn lagged() -> impl Strategy<Value = (Vec<Pole>, f64, f64)> {
        let time = || (-4.0_f64..1.5).prop_map(|power| 10.0_f64.powf(power));
        let poles = proptest::collection::vec((0.01_f64..1.0, time()), 1..5);
        let near = proptest::option::of(0.99_f64..1.01);
        (poles, 0.0_f64..0.6, time(), near).prop_map(|(poles, w, tau, near)| {
            // As close to a pole as a fit may come.
            let tau = near.map_or(tau, |near| near * poles[0].1);
            (poles, w, tau.clamp(1e-4, 1.0))
        })
    }

    proptest! {
        #[test]
        fn a_lag_keeps_gain_and_first_moment_and_leaves_no_negative_part((poles, w, tau) in lagged()) {
            let expanded = behind(&poles, w, tau);
            let gain = |poles: &[Pole]| poles.iter().map(|(weight, _)| weight).sum::<f64>();
            let moment = |poles: &[Pole]| poles.iter().map(|(weight, time)| weight * time).sum::<f64>();
            let late = moment(&poles) + w * tau * gain(&poles);
            // Parts of either sign that cancel are each less than a thousand times the whole, of which f64 keeps 1e-16.
            prop_assert!((gain(&expanded) / gain(&poles) - 1.0).abs() < 1e-9, "{expanded:?}");
            prop_assert!((moment(&expanded) / late - 1.0).abs() < 1e-9, "{expanded:?}");
            prop_assert!(expanded.iter().all(|(weight, _)| *weight >= 0.0), "{expanded:?}");
        }

        /// Whatever lag is behind a beam and a slow rest, a board takes it, unless the beam or the plate behind that lag is slow itself: then
        /// it may say that nothing is fast.
        #[test]
        fn a_board_takes_every_lag_behind_a_beam(
            fast_s in 1e-4_f64..0.1, middle in (0.0_f64..0.4, 1e-3_f64..0.3), slow in (0.0_f64..0.4, 0.1_f64..100.0),
            w in 0.0_f64..0.6, tau in 1e-4_f64..1.0, near in proptest::option::of(0.99_f64..1.01),
        ) {
            let tau = near.map_or(tau, |near| near * fast_s);
            let mut model = with("thermal-lag", &[w, tau]);
            let p = &mut model.parameters;
            (p.fast_s, p.middle_weight, p.middle_s) = (fast_s, middle.0, middle.1);
            (p.slow_weight, p.slow_s) = slow;
            let parts = Parts { heat: heat(&model), ..*FACTORY.parts() };
            let refused = Calibration::new(parts).err();
            let nothing_is_fast = matches!(
                refused,
                Some(CalibrationError::Number { field: Field::FastPole, problem: Problem::Sum, .. })
            );
            let is_slow = fast_s.max(middle.1) + w * tau >= f64::from(SLOW.0);
            prop_assert!(refused.is_none() || is_slow && nothing_is_fast, "{refused:?}");
        }
    }

    #[test]
    fn the_lightest_pole_is_merged_with_its_neighbour_where_there_are_too_many() {
        let poles = vec![(0.4, 10.0), (0.5, 1.0), (0.1, 3.0)];
        let merged = pairs(lags::<2>(poles.clone(), SLOW));
        assert_alike(&merged, &[(0.6, 0.8 / 0.6), (0.4, 10.0)]);
        let unused = (0.0, f64::from(SLOW.0));
        let spare = pairs(lags::<4>(poles, SLOW));
        assert_alike(&spare, &[(0.5, 1.0), (0.1, 3.0), (0.4, 10.0), unused]);
    }

    #[test]
    fn poles_are_parts_of_the_whole_and_divided_at_what_the_core_calls_slow() {
        let warming_s = 3.0 * f64::from(SLOW.0);
        let mut model = with("substrate-warming", &[0.25, warming_s]);
        model.parameters.middle_weight = 0.0;
        model.parameters.slow_weight = 0.0;
        let heat = heat(&model);
        // 1 and 0.25 are four and one fifths of both.
        assert!((f64::from(heat.fast[0].weight) - 0.8).abs() < F32);
        assert!((f64::from(heat.slow[0].weight) - 0.2).abs() < F32);
        assert!((f64::from(heat.slow[0].time.0) - warming_s).abs() < F32 * warming_s);
    }

    #[test]
    fn a_move_takes_five_periods_of_the_lowest_resonance_and_half_of_them_of_a_known_one() {
        assert_eq!(path(&Model::from(Preset::Paper)).move_time, Second(0.01));
        let effect = effect::find("resonance").expect("built in");
        let values: Vec<f64> = effect
            .info()
            .parameters
            .iter()
            .map(|parameter| {
                if parameter.symbol == "f" {
                    2000.0
                } else {
                    parameter.start
                }
            })
            .collect();
        let Path {
            move_time,
            resonance,
        } = path(&with("resonance", &values));
        assert!((move_time.0 - 1.25e-3).abs() < 1e-9, "{move_time:?}");
        assert_eq!(resonance.frequency, Hertz(2000.0));
    }

    #[test]
    fn what_the_core_does_not_invert_is_told() {
        let told = |id: &str| {
            let values = effect::find(id).expect("built in").info().parameters.len();
            remaining(&with(id, &vec![0.1; values])).len()
        };
        assert_eq!(
            (told("creep"), told("ambient-drift"), told("sensor-gain")),
            (0, 1, 1)
        );
    }
}
