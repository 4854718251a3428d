//! The stage `memory` of a model: hysteresis and creep.

use control_core::calibration::{LAGS, Memory, PLAYS, Play, SLOW};
use control_core::{Micrometre, Second};
use mirror_model::Model;

use crate::dynamics::{Pole, find, lags, value};

/// Radii of play operators as shares of the range: about a factor of two apart, as the near jumps of `experiments::calibration` are.
pub(crate) const RADII: [f64; PLAYS] = [0.012, 0.03, 0.06, 0.12];
/// Time constants of creep (s): a factor of five apart, from the slowest move to the longest rest of a session.
pub(crate) const CREEP_S: [f64; LAGS] = [0.3, 1.5, 7.0, 35.0];

/// Hysteresis and creep of a mirror that goes up to `top_um`.
///
/// Play operators and lags that the model knows nothing of have no weight, and are followed all the same: a calibration that finds them
/// to have some begins with what the mirror remembers by then.
pub(crate) fn memory(model: &Model, top_um: f64) -> Memory {
    Memory {
        plays: plays(model, top_um),
        release: Second(0.0),
        creep: lags(creep(model), SLOW),
    }
}

fn plays(model: &Model, top_um: f64) -> [Play; PLAYS] {
    let play = |weight: f64, radius_um: f64| Play {
        weight: weight as f32,
        radius: Micrometre(radius_um as f32),
    };
    match find(model, "hysteresis") {
        Some(hysteresis) => {
            let (w, r) = (value(hysteresis, "w"), value(hysteresis, "r"));
            std::array::from_fn(|k| {
                let weight = if k < 3 { w / 3.0 } else { 0.0 };
                play(weight, r * (k.min(2) + 1) as f64 / 3.0)
            })
        }
        None => RADII.map(|share| play(0.0, share * top_um)),
    }
}

/// The lags of the model, and of the usual ones those that are furthest from them.
fn creep(model: &Model) -> Vec<Pole> {
    let mut poles = match find(model, "creep") {
        Some(creep) => {
            let (c, tau) = (value(creep, "c"), value(creep, "tau"));
            match creep.effect.form() {
                "single" => vec![(c, tau)],
                _ => [0.2, 1.0, 5.0]
                    .map(|factor| (c / 3.0, factor * tau))
                    .to_vec(),
            }
        }
        None => Vec::new(),
    };
    while poles.len() < LAGS {
        let apart = |time_s: f64| {
            let others = poles
                .iter()
                .map(|(_, other_s)| (other_s / time_s).ln().abs());
            others.fold(f64::INFINITY, f64::min)
        };
        let furthest = CREEP_S
            .into_iter()
            .max_by(|a, b| apart(*a).total_cmp(&apart(*b)));
        poles.extend(furthest.map(|time_s| (0.0, time_s)));
    }
    poles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::remaining;
    use mirror_model::Preset;
    use mirror_model::effect::{self, Active};

    const TOP_UM: f64 = 170.0;

    fn with(id: &str, symbols: &[(&str, f64)]) -> Model {
        let mut model = Model::from(Preset::Paper);
        let mut active = Active::usual(effect::find(id).expect("built in"));
        let parameters = active.effect.info().parameters.iter();
        for (parameter, place) in parameters.zip(&mut active.values) {
            let given = symbols
                .iter()
                .find(|(symbol, _)| *symbol == parameter.symbol);
            *place = given.map_or(*place, |(_, value)| *value);
        }
        model.effects = vec![active];
        model
    }

    #[test]
    fn hysteresis_is_three_plays_up_to_its_radius() {
        let plays = memory(&with("hysteresis", &[("w", 0.03), ("r", 9.0)]), TOP_UM).plays;
        for (play, radius_um) in plays[..3].iter().zip([3.0, 6.0, 9.0]) {
            assert!((play.weight - 0.01).abs() < 1e-9, "{play:?}");
            assert!((play.radius.0 - radius_um).abs() < 1e-6, "{play:?}");
        }
        assert!(plays[3].weight == 0.0 && plays[3].radius == plays[2].radius);
    }

    #[test]
    fn what_a_model_knows_nothing_of_has_no_weight_and_is_followed() {
        let times_s = |memory: &Memory| memory.creep.map(|lag| lag.time.0);
        let mut model = with("creep", &[("c", 0.03), ("tau", 7.0)]);
        let known = memory(&model, TOP_UM);
        // A fifth and five times 7 s are nearest to the usual 1.5 and 35 s.
        let expected = [(0.0, 0.3), (0.01, 1.4), (0.01, 7.0), (0.01, 35.0)];
        for (lag, (weight, time_s)) in known.creep.iter().zip(expected) {
            assert!((lag.weight - weight).abs() < 1e-6, "{lag:?}");
            assert!((lag.time.0 - time_s).abs() < 1e-5, "{lag:?}");
        }
        let forms = effect::forms(&effect::find("creep").expect("built in"));
        model.effects = vec![Active::usual(forms[1].clone())];
        let single = memory(&model, TOP_UM);
        // 15 s is nearest to the usual 7 s.
        assert_eq!(times_s(&single), [0.3, 1.5, 15.0, 35.0]);
        assert_eq!(single.creep.map(|lag| lag.weight), [0.0, 0.0, 0.01, 0.0]);
        model.effects.clear();
        let unknown = memory(&model, TOP_UM);
        assert_eq!(times_s(&unknown), CREEP_S.map(|time_s| time_s as f32));
        assert!(unknown.creep.iter().all(|lag| lag.weight == 0.0));
        assert_eq!(unknown.plays[3].radius.0, (RADII[3] * TOP_UM) as f32);
        assert!(unknown.plays.iter().all(|play| play.weight == 0.0));
    }

    #[test]
    fn of_two_forms_the_core_takes_the_one_that_it_inverts() {
        let effect = effect::find("hysteresis").expect("built in");
        let found = effect::forms(&effect).into_iter().map(|form| {
            let mut model = Model::from(Preset::Paper);
            let name = form.form().to_owned();
            model.effects = vec![Active::usual(form)];
            let plays = memory(&model, TOP_UM).plays;
            (name, plays[0].weight > 0.0, remaining(&model).len())
        });
        let expected = [
            ("play", true, 0),
            ("plate", false, 1),
            ("dahl", false, 1),
            ("bouc-wen", false, 1),
        ];
        let expected = expected.map(|(name, plays, left)| (name.to_owned(), plays, left));
        assert_eq!(found.collect::<Vec<_>>(), expected);
    }
}
