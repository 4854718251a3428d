//! What to measure next: of what this board can run, where the rivals' predictions differ most.

use crate::base::identifiable;
use crate::fit::{Knob, in_units_of_trust, jacobian, predict};
use crate::menu::{Experiment, OTHER_ROOM, OVEN, REFERENCE_STEP, menu, with_currents};
use crate::plan::{Channel, Plan};
use crate::report::NextMeasurement;
use crate::space::Space;
use mirror_model::Model;
use mirror_model::effect::{Active, Stage};
use rayon::prelude::*;

/// Noise of the displacement where the session has none (um).
const NOISE_UM: f64 = 0.02;
/// Rivals that differ by less than this, in units of what a reading is trusted to, need something else than a drive.
const TELLING: f64 = 5.0;

/// The experiment whose outcome differs most between the best of the rivals and any other, beyond what refitted base
/// parameters hide. Where no drive tells, what else would.
pub(crate) fn choose(model: &Model, session: &Plan, rivals: &[Active]) -> Option<NextMeasurement> {
    let (first, others) = rivals.split_first()?;
    let second = others.first()?;
    if session.is_of_heaters() {
        return Some(on_a_bench(first, second));
    }
    let noise_um = session
        .observations
        .iter()
        .find(|o| o.channel == Channel::Displacement)
        .map_or(NOISE_UM, |o| o.noise);
    let top = highest_drive(session);
    let mut experiments = menu(top);
    if !session.has_current() {
        experiments.push(with_currents(session, top));
    }
    let told = |experiment: &Experiment| {
        let plan = experiment.plan(noise_um);
        let tells = |other| difference(model, &plan, first, other).unwrap_or(0.0);
        others.iter().map(tells).fold(f64::INFINITY, f64::min)
    };
    let (best, size) = experiments
        .par_iter()
        .map(|experiment| (experiment, told(experiment)))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    if size < TELLING {
        return Some(beyond_drives(first, second));
    }
    let others: Vec<&str> = others.iter().map(Active::id).collect();
    Some(NextMeasurement {
        why: format!(
            "{}: there {} differs from {} by {size:.0} times what a reading is trusted to",
            best.what,
            first.id(),
            others.join(", ")
        ),
        command: best.command.clone(),
    })
}

/// What to measure where a session shows next to nothing, if there is a channel that it lacks.
pub(crate) fn more(session: &Plan) -> Option<NextMeasurement> {
    let with_currents = with_currents(session, highest_drive(session));
    (!session.has_current()).then(|| NextMeasurement {
        why: with_currents.what.into(),
        command: with_currents.command,
    })
}

fn highest_drive(session: &Plan) -> f64 {
    let drives = session.intervals.iter().flat_map(|interval| interval.to_v);
    drives.fold(0.0, f64::max)
}

/// How far two effects' predictions of an experiment differ beyond what the base can hide.
fn difference(model: &Model, plan: &Plan, first: &Active, second: &Active) -> Option<f64> {
    let with = |active: &Active| {
        let mut model = model.clone();
        model.effects.push(active.clone());
        predict(&model, plan).ok()
    };
    let differences = with(first)?.into_iter().zip(with(second)?);
    let difference = in_units_of_trust(differences.map(|(a, b)| a - b), plan);
    let knobs: Vec<_> = identifiable(plan).into_iter().map(Knob::Base).collect();
    let slopes = jacobian(model, plan, &knobs).ok()?;
    let space = Space::of_base(&slopes);
    let vector = space.vector(&difference);
    Some(space.product(&vector, &vector).max(0.0).sqrt())
}

/// What tells effects apart that no drive does.
fn beyond_drives(first: &Active, second: &Active) -> NextMeasurement {
    let (what, command) = beside_the_board(first, second);
    NextMeasurement {
        why: format!(
            "no drive of this board tells {} from {}; this would: {what}",
            first.id(),
            second.id()
        ),
        command,
    }
}

/// What tells effects apart in a heater that both of them fit.
fn on_a_bench(first: &Active, second: &Active) -> NextMeasurement {
    let (what, command) = beside_the_board(first, second);
    NextMeasurement {
        why: format!(
            "{} and {} both follow these readings, so the same again would not tell; this would: {what}",
            first.id(),
            second.id()
        ),
        command,
    }
}

/// What would tell them apart, and a command for it.
fn beside_the_board<'e>(first: &'e Active, second: &Active) -> (&'e str, String) {
    let stages = [first, second].map(|active| active.effect.info().stage);
    let one_is = |wanted: &[Stage]| wanted.contains(&stages[0]) != wanted.contains(&stages[1]);
    let is_drift = |active: &Active| active.id() == "ambient-drift";
    match () {
        () if one_is(&[Stage::Sensor]) => (
            "a reference step of the sensor's target on a stage, while it records",
            REFERENCE_STEP.to_owned(),
        ),
        () if is_drift(first) || is_drift(second) => (
            "a second session with the room at another, known temperature",
            OTHER_ROOM.to_owned(),
        ),
        () if one_is(&[Stage::Resistance, Stage::Curvature, Stage::Shape]) => (
            "an oven at a known temperature with the heaters next to off",
            OVEN.to_owned(),
        ),
        () => (
            first.effect.info().separates.as_ref(),
            format!("host-tool effect show {}", first.id()),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_model::effect::find;
    use mirror_model::{Interval, Preset, Symbol};

    /// What is proposed where these two are rivals after a sweep.
    fn proposed(first: &str, second: &str) -> NextMeasurement {
        let mut model = Model::from(Preset::Reconciled);
        for (symbol, value) in [
            (Symbol::FastTime, 2e-3),
            (Symbol::MiddleTime, 0.04),
            (Symbol::MiddleWeight, 0.2),
        ] {
            model.parameters.set(symbol, value);
        }
        let session = Plan {
            intervals: vec![Interval {
                duration_s: 1.0,
                from_v: [3.5; 4],
                to_v: [3.5; 4],
            }],
            ..Plan::default()
        };
        let rivals = [first, second].map(|id| Active::usual(find(id).expect("an effect")));
        choose(&model, &session, &rivals).expect("two rivals")
    }

    #[test]
    fn the_experiment_is_the_one_that_tells_the_rivals_apart() {
        for (first, second, command) in [
            ("crosstalk", "sensor-gain", "measure single --max 3.5V"),
            (
                "creep",
                "sensor-offset",
                "measure step --to 2.45V --hold 60s",
            ),
            ("resonance", "sensor-offset", "Hz"),
        ] {
            let next = proposed(first, second);
            assert!(
                next.command.contains(command),
                "{first}, {second}: {next:?}"
            );
        }
    }

    #[test]
    fn what_no_drive_tells_is_told_on_the_bench() {
        let scale = [
            find("sensor-gain"),
            find("film-tcr"),
            find("ambient-drift"),
            find("radiation"),
        ]
        .map(|effect| Active::usual(effect.expect("an effect")));
        let [gain, film, drift, radiation] = &scale;
        assert!(beyond_drives(gain, film).command.contains("record"));
        assert!(
            beyond_drives(film, radiation)
                .command
                .contains("--ambient 60")
        );
        assert!(
            beyond_drives(radiation, drift)
                .command
                .contains("-o warmer")
        );
        assert_eq!(
            beyond_drives(radiation, radiation).command,
            "host-tool effect show radiation"
        );
    }
}
