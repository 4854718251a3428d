//! What to measure next: of what this board and its bench can run, where the rivals' predictions differ most.

use crate::apart::apart;
use crate::measured_already::holds;
use crate::menu::{Offer, ROOM_C, beside, highest_drive_v, menu, position_noise_um, with_currents};
use crate::proposal::{Next, NextMeasurement, Proposal};
use crate::residual_space::ResidualSpace;
use experiments::Measurement;
use identification::base::identifiable;
use identification::dataset::Dataset;
use identification::parameter::FreeParameter;
use mirror_model::Model;
use mirror_model::effect::{Active, Stage};

/// Rivals that differ by less than this need something else than a drive: five standard deviations of one reading.
const TELLING: f64 = 5.0;

/// The experiment whose outcome differs most between the best of the rivals and any other, beyond what refitted parameters of base and
/// rivals hide. Where no drive tells, one on the bench.
pub(crate) fn choose(
    model: &Model,
    session: &Dataset,
    rivals: &[Active],
) -> Option<NextMeasurement> {
    let (first, others) = rivals.split_first()?;
    let second = others.first()?;
    if session.is_of_heaters() {
        return Some(of_a_heater(session, first, second));
    }
    let noise_um = position_noise_um(session);
    let top = highest_drive_v(session);
    let mut offers = menu(top);
    // Measured once more, it would tell what it told.
    offers.retain(|offer| !holds(session, offer));
    if !session.has_current() {
        offers.push(with_currents(session, top));
    }
    let told_by = |plan: &Dataset| {
        let tells = |other| difference(model, plan, first, other).unwrap_or(0.0);
        others.iter().map(tells).fold(f64::INFINITY, f64::min)
    };
    let told = |offer: &Offer| told_by(&offer.plan(noise_um));
    // What they differ by in the session did not tell them apart: the model's discrepancy hides it.
    let enough = told_by(session).max(TELLING);
    let ids: Vec<&str> = others.iter().map(Active::id).collect();
    let (first_id, other_ids) = (first.id(), ids.join(", "));
    if let Some((best, size)) = most_telling(&offers, enough, told) {
        return Some(NextMeasurement {
            why: format!(
                "{}: there {first_id} differs from {other_ids} by {size:.0} standard deviations of a reading",
                best.what
            ),
            how: best.proposal.clone().into(),
        });
    }
    let on_the_bench = beside(top, session.first_ambient_c.unwrap_or(ROOM_C));
    if let Some((best, size)) = most_telling(&on_the_bench, enough, told) {
        return Some(NextMeasurement {
            why: format!(
                "no drive of this board tells {first_id} from {other_ids}; this would: {}, where they differ by {size:.0} standard deviations of a reading",
                best.what
            ),
            how: best.proposal.clone().into(),
        });
    }
    Some(NextMeasurement {
        why: format!(
            "no measurement of this board tells {first_id} from {other_ids}; what would, where it was not measured already: {}",
            first.effect.info().separates
        ),
        how: Next::ReadAbout(first_id.to_owned()),
    })
}

/// What tells effects apart that both follow the readings of a heater, which the same drives again would not.
fn of_a_heater(session: &Dataset, first: &Active, second: &Active) -> NextMeasurement {
    let room_c = session.first_ambient_c.unwrap_or(ROOM_C);
    let [.., oven] = beside(highest_drive_v(session), room_c);
    let is_of_resistance = |active: &Active| active.effect.info().stage == Stage::Resistance;
    let (what, how) = if is_of_resistance(first) != is_of_resistance(second) {
        (oven.what, oven.proposal.into())
    } else {
        let about = Next::ReadAbout(first.id().to_owned());
        (first.effect.info().separates.as_ref(), about)
    };
    NextMeasurement {
        why: format!(
            "{} and {} both follow these readings, and would if they were made again; this would tell: {what}",
            first.id(),
            second.id()
        ),
        how,
    }
}

/// The measurement by which most is told, and how much, if it is enough.
fn most_telling(
    offers: &[Offer],
    enough: f64,
    told: impl Fn(&Offer) -> f64 + Sync,
) -> Option<(&Offer, f64)> {
    let sizes = parallel::map(offers, |offer| (offer, told(offer)));
    sizes
        .into_iter()
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .filter(|&(_, size)| size > enough)
}

/// What to measure where a session shows next to nothing: a channel that it lacks, or what it has only settled readings or one
/// experiment of.
pub(crate) fn more(session: &Dataset) -> Option<NextMeasurement> {
    let top_v = highest_drive_v(session);
    let with_currents = with_currents(session, top_v);
    if !session.has_current() {
        return Some(NextMeasurement {
            why: with_currents.what.into(),
            how: with_currents.proposal.into(),
        });
    }
    let is_little = session.is_steady || session.experiments.len() == 1;
    let whole = Proposal {
        measurement: Measurement::Session { max_v: top_v },
        ambient_c: None,
        name: None,
    };
    (is_little && !session.is_of_heaters()).then(|| NextMeasurement {
        why: "measure sweep, steps, sines and single actuators: a few readings are fitted whatever is missing".into(),
        how: whole.into(),
    })
}

/// How far two effects' predictions of an experiment differ beyond what base and effects can hide, in standard deviations of one
/// reading.
fn difference(model: &Model, plan: &Dataset, first: &Active, second: &Active) -> Option<f64> {
    let free: Vec<_> = identifiable(plan)
        .into_iter()
        .map(FreeParameter::Base)
        .collect();
    apart(model, plan, &free, [first, second], ResidualSpace::of_base).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use experiments::instruments::POSITION_NOISE_UM;
    use identification::dataset::{Channel, Observation};
    use mirror_model::effect::find;
    use mirror_model::{Preset, Symbol};

    /// What is offered, by its words.
    fn offer(what: &str) -> Offer {
        let mut menu = menu(3.5).into_iter();
        menu.find(|offer| offer.what == what).expect("on the menu")
    }

    /// What is proposed where these two are rivals after a sweep.
    fn proposed(first: &str, second: &str) -> NextMeasurement {
        let session = offer("repeat the sweep").plan(POSITION_NOISE_UM);
        proposed_after(&session, first, second)
    }

    /// What is proposed where these two are rivals after a session.
    fn proposed_after(session: &Dataset, first: &str, second: &str) -> NextMeasurement {
        let mut model = Model::from(Preset::Reconciled);
        for (symbol, value) in [
            (Symbol::FastTime, 2e-3),
            (Symbol::MiddleTime, 0.04),
            (Symbol::MiddleWeight, 0.2),
        ] {
            model.parameters.set(symbol, value);
        }
        let rivals = [first, second].map(|id| Active::usual(find(id).expect("an effect")));
        choose(&model, session, &rivals).expect("two rivals")
    }

    /// The measurement that is proposed.
    fn measurement(next: &NextMeasurement) -> Option<&Proposal> {
        match &next.how {
            Next::Measure(proposal) => Some(proposal),
            Next::ReadAbout(_) => None,
        }
    }

    #[test]
    fn the_experiment_is_the_one_that_tells_the_rivals_apart() {
        type Is = fn(&Measurement) -> bool;
        let cases: [(&str, &str, Is); 3] = [
            (
                "crosstalk",
                "sensor-gain",
                |m| matches!(m, Measurement::Single { max_v, .. } if *max_v == 3.5),
            ),
            (
                "creep",
                "sensor-offset",
                |m| matches!(m, Measurement::Step { to_v, hold_s, .. } if (*to_v, *hold_s) == (2.45, 60.0)),
            ),
            (
                "resonance",
                "sensor-offset",
                |m| matches!(m, Measurement::Sine { frequency_hz, .. } if *frequency_hz >= 200.0),
            ),
        ];
        for (first, second, is) in cases {
            let next = proposed(first, second);
            assert!(
                measurement(&next).is_some_and(|proposal| is(&proposal.measurement)),
                "{first}, {second}: {next:?}"
            );
        }
    }

    #[test]
    fn what_was_measured_as_proposed_is_not_proposed_again() {
        let is_the_hold = |next: &NextMeasurement| {
            measurement(next).is_some_and(
                |p| matches!(p.measurement, Measurement::Step { hold_s, .. } if hold_s == 60.0),
            )
        };
        let sweep = offer("repeat the sweep").plan(POSITION_NOISE_UM);
        let first = proposed_after(&sweep, "creep", "sensor-offset");
        assert!(is_the_hold(&first), "{first:?}");
        let (longer, _) = offer("hold a step for a minute, then rest").after(&sweep);
        let second = proposed_after(&longer, "creep", "sensor-offset");
        assert!(!is_the_hold(&second), "{second:?}");
    }

    #[test]
    fn a_few_points_are_followed_by_a_session() {
        let mut points = offer("repeat the sweep").plan(POSITION_NOISE_UM);
        let is_displacement = |o: &Observation| o.channel == Channel::Displacement;
        points.observations.retain(is_displacement);
        let name = |session: &Dataset| {
            let next = more(session).expect("a measurement");
            measurement(&next).expect("of the board").name
        };
        assert!(name(&points).is_some());
        let mut current = points.observations[0];
        current.channel = Channel::Current(0);
        points.observations.push(current);
        points.experiments = vec!["sweep".into()];
        assert_eq!(name(&points), None);
        let next = more(&points).expect("a measurement");
        let whole = Measurement::Session { max_v: 3.5 };
        assert_eq!(
            measurement(&next).map(|p| p.measurement.clone()),
            Some(whole)
        );
        // Of a whole session nothing is known that would show more.
        points.experiments.push("step".into());
        assert_eq!(more(&points), None);
    }

    #[test]
    fn a_heater_is_not_measured_again_as_it_was() {
        let mut session = menu(6.0).swap_remove(3).plan(POSITION_NOISE_UM);
        session
            .observations
            .retain(|o| o.channel == Channel::Current(0));
        let next = |ids: [&str; 2]| {
            let rivals = ids.map(|id| Active::usual(find(id).expect("an effect")));
            choose(&Model::from(Preset::Paper), &session, &rivals).expect("two rivals")
        };
        let oven = next(["heat-loss-temperature", "quadratic-tcr"]);
        let oven = measurement(&oven).expect("the bench can");
        assert_eq!((oven.name, oven.ambient_c), (Some("oven"), Some(62.0)));
        let other = next(["radiation", "heat-loss-temperature"]);
        assert_eq!(other.how, Next::ReadAbout("radiation".into()));
    }

    #[test]
    fn what_no_drive_tells_is_told_on_the_bench() {
        for (first, second, is_of_a_stage) in [
            ("sensor-gain", "film-tcr", false),
            ("film-tcr", "radiation", false),
            ("sensor-gain", "initial-curl", true),
        ] {
            let next = proposed(first, second);
            let proposal = measurement(&next).expect("the bench can");
            let stage = matches!(proposal.measurement, Measurement::Reference { .. });
            assert!(
                stage == is_of_a_stage
                    && proposal.ambient_c.is_some() != stage
                    && next.why.contains("no drive"),
                "{first}, {second}: {next:?}"
            );
        }
    }

    #[test]
    fn where_nothing_on_the_menu_tells_the_effect_says_what_would() {
        let next = proposed("radiation", "radiation");
        assert_eq!(next.how, Next::ReadAbout("radiation".into()));
    }
}
