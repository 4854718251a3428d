//! What to measure next: of what this board can run, where the rivals' predictions differ most.

use crate::base::identifiable;
use crate::fit::{Knob, in_units_of_trust, jacobian, predict, white_noise};
use crate::plan::{Channel, Observation, Plan};
use crate::report::NextMeasurement;
use crate::space::{Approximation, Space};
use mirror_model::effect::Active;
use mirror_model::{ACTUATORS, Interval, Model};
use nalgebra::DMatrix;
use std::sync::Arc;

const NOISE_UM: f64 = 0.02;
const NOISE_A: f64 = 2e-6;
/// Rivals that differ by less than this many noises in every experiment of the menu need something else than this board.
const TELLING: f64 = 5.0;

/// An experiment that the board can run.
struct Experiment {
    command: &'static str,
    what: &'static str,
    drives: Vec<([f64; ACTUATORS], f64)>,
}

/// The experiment whose outcome differs most between the rivals, in units of its noise and beyond what refitted base
/// parameters hide. Where none tells, the effect's own description says what would.
pub(crate) fn choose(model: &Model, session: &Plan, rivals: &[Active]) -> Option<NextMeasurement> {
    let (first, second) = (rivals.first()?, rivals.get(1)?);
    if !session.has_current() {
        let why =
            "without currents heat cannot be told from mechanics: the resistance is a thermometer"
                .into();
        return Some(NextMeasurement {
            why,
            command: "host-tool record -o with-currents.csv".into(),
        });
    }
    let told = |experiment: &Experiment| {
        difference(model, &plan(experiment), first, second).unwrap_or(0.0)
    };
    let menu = menu();
    let (best, size) = menu
        .iter()
        .map(|e| (e, told(e)))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    if size < TELLING {
        let info = first.effect.info();
        let why = format!(
            "no drive of this board tells {} from {}; this would: {}",
            first.id(),
            second.id(),
            info.separates
        );
        return Some(NextMeasurement {
            why,
            command: format!("host-tool effect show {}", first.id()),
        });
    }
    let why = format!(
        "{}: there {} and {} differ by {size:.0} times the noise",
        best.what,
        first.id(),
        second.id()
    );
    Some(NextMeasurement {
        why,
        command: best.command.into(),
    })
}

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
    let nothing = DMatrix::zeros(difference.len(), 0);
    let approximation = Approximation::new(&nothing, &white_noise(plan));
    let space = Space::new(&slopes, &Arc::new(approximation), Vec::new());
    let vector = space.vector(&difference);
    Some(space.product(&vector, &vector).max(0.0).sqrt())
}

fn menu() -> Vec<Experiment> {
    let all = |voltage: f64, duration: f64| ([voltage; ACTUATORS], duration);
    let ladder = |dwell: f64| {
        (0..=14)
            .chain((0..14).rev())
            .map(move |i| all(0.25 * f64::from(i), dwell))
    };
    let one_hot = (0..ACTUATORS).flat_map(|hot| {
        [1.0, 2.0, 3.0, 0.0].map(move |voltage| {
            (
                std::array::from_fn(|i| if i == hot { voltage } else { 0.2 }),
                1.0,
            )
        })
    });
    let fast = |voltage: f64| std::iter::repeat_n(all(voltage, 1e-4), 100);
    let hold = |voltage: f64| (0..12).map(move |i| all(voltage, 0.05 * 1.8_f64.powi(i)));
    let loops =
        (0..2).flat_map(|_| [1.0, 1.5, 2.0, 2.5, 2.0, 1.5].map(|voltage| all(voltage, 10.0)));
    vec![
        Experiment {
            command: "host-tool measure single",
            what: "heat one actuator and sense an idle one",
            drives: one_hot.collect(),
        },
        Experiment {
            command: "host-tool measure step --hold 60s",
            what: "hold a step for a minute, then rest",
            drives: hold(2.5).chain(hold(0.0)).collect(),
        },
        Experiment {
            command: "host-tool measure step --rate 10kHz",
            what: "sample a step fast",
            drives: fast(2.0).chain(fast(0.0)).collect(),
        },
        Experiment {
            command: "host-tool measure sweep --repeat 2",
            what: "repeat the sweep",
            drives: ladder(1.0).chain(ladder(1.0)).collect(),
        },
        Experiment {
            command: "host-tool measure sine --frequency 0.01Hz",
            what: "minor loops, slow enough for all heat to settle",
            drives: loops.collect(),
        },
    ]
}

fn plan(experiment: &Experiment) -> Plan {
    let mut plan = Plan {
        experiments: vec![experiment.command.into()],
        ..Plan::default()
    };
    let mut t_s = 0.0;
    for (index, &(drive, duration_s)) in experiment.drives.iter().enumerate() {
        plan.intervals.push(Interval {
            duration_s,
            from_v: drive,
            to_v: drive,
        });
        t_s += duration_s;
        let observation = |channel, noise| Observation {
            interval: index,
            channel,
            value: 0.0,
            noise,
            experiment: 0,
            t_s,
        };
        plan.observations
            .push(observation(Channel::Displacement, NOISE_UM));
        plan.observations.extend(
            (0..ACTUATORS).map(|actuator| observation(Channel::Current(actuator), NOISE_A)),
        );
    }
    plan
}
