//! What no drive shows, an oven or a reference step does: mirrors from a family that no threshold was calibrated on.

use diagnosis::{Asked, Means, Verdict, diagnose, diagnose_with_gains};
use experiments::Experiment;
use identification::Dataset;
use measurement::Session;
use mirror_model::{Model, Preset};
use shared_cache::null_ensembles as cache;
use virtual_mirror::{Effect, Family, MirrorConfig};
use virtual_sessions::{Instruments, measure};

fn hiding(effect: Effect) -> MirrorConfig {
    MirrorConfig::draw(Family::F, 41).with_effect(effect, 1.0)
}

/// What a bench has measured of a mirror before anybody asked for more.
fn usual() -> Vec<Experiment> {
    vec![
        Experiment::sweep(3.5, 14, 1.0, 1),
        Experiment::single(3.5, 5, 1.0).after(5.0),
    ]
}

fn measured(config: &MirrorConfig, experiments: Vec<Experiment>) -> Session {
    measure(config, &experiments, Instruments::PositionAndCurrents).expect("a possible mirror")
}

fn found(session: &Session) -> (Verdict, Vec<String>) {
    let paper = Model::from(Preset::Paper);
    let found = diagnose(&paper, &Dataset::new(session), &[], cache().as_deref()).expect("finite");
    (found.verdict, found.effects)
}

/// It stays unseen in the usual session, and is found where `more` was measured.
#[track_caller]
fn shows(hidden: Effect, more: Experiment) {
    let config = hiding(hidden);
    let (_, unseen) = found(&measured(&config, usual()));
    assert!(!(1..=2).contains(&unseen.len()), "{unseen:?}");
    let with = measured(&config, [usual(), vec![more]].concat());
    let (verdict, effects) = found(&with);
    assert!(
        effects.len() <= 2 && effects.iter().any(|id| id == hidden.id()),
        "{hidden}: {verdict:?} {effects:?}"
    );
}

fn oven() -> Experiment {
    Experiment::sweep(0.4, 8, 1.0, 1)
        .named("oven")
        .after(60.0)
        .with_ambient_rise(38.0)
}

#[test]
#[ignore = "long"]
fn an_oven_shows_the_film_s_coefficient() {
    shows(Effect::FilmTcr, oven());
}

#[test]
fn a_reference_step_shows_the_sensor_s_gain() {
    let heights = [0.0, 50.0, 100.0, 150.0, 100.0, 50.0, 0.0];
    shows(
        Effect::SensorGain,
        Experiment::reference(&heights, 1.0).after(20.0),
    );
}

/// An oven on another day, on a board that was switched on in it: the sensor's zero is another one.
#[test]
#[ignore = "long"]
fn an_oven_on_another_clock_shows_it_too() {
    let config = hiding(Effect::FilmTcr);
    let mut session = measured(&config, usual());
    let day = |session: &mut Session, began: &str, ambient_c: f64| {
        for (_, file) in &mut session.files {
            file.keys.set("session", began);
            file.rows
                .iter_mut()
                .for_each(|row| row.ambient_c = Some(ambient_c));
        }
    };
    day(&mut session, "2026-11-21T10:00:00Z", config.ambient_c);
    let mut later = measured(&config, vec![oven()]);
    day(&mut later, "2026-11-22T10:00:00Z", config.ambient_c + 38.0);
    for row in later.files.iter_mut().flat_map(|(_, file)| &mut file.rows) {
        row.z_um = row.z_um.map(|z| z - 71.3);
    }
    session.files.extend(later.files);
    let (verdict, effects) = found(&session);
    assert!(
        effects.len() <= 2 && effects.iter().any(|id| id == "film-tcr"),
        "{verdict:?} {effects:?}"
    );
}

#[test]
#[ignore = "long"]
fn nothing_hidden_stays_nothing_in_an_oven_and_on_a_stage() {
    let heights = [0.0, 60.0, 120.0, 0.0];
    let more = vec![oven(), Experiment::reference(&heights, 1.0).after(20.0)];
    let session = measured(&MirrorConfig::draw(Family::G, 42), [usual(), more].concat());
    assert_eq!(found(&session), (Verdict::None, vec![]));
}

/// What the tests above find by these measurements is what they are said to show, of a mirror that hides nothing.
#[test]
#[ignore = "long"]
fn what_a_measurement_would_show_is_told_before_it_is_made() {
    let session = measured(&MirrorConfig::draw(Family::F, 41), usual());
    let data = Dataset::new(&session);
    let asked = Asked {
        measurements: true,
        ..Asked::default()
    };
    let paper = Model::from(Preset::Paper);
    let (found, gains) =
        diagnose_with_gains(&paper, &data, &[], cache().as_deref(), asked).expect("finite");
    assert_eq!(found.verdict, Verdict::None);
    let gains = gains.measurements.expect("they were asked for");
    let shown_by = |name: &str| -> Vec<&str> {
        let is_of_name = |means: &Means| match means {
            Means::Measurement(proposal) => proposal.name == Some(name),
            Means::Fact(_) => panic!("nobody asked for facts"),
        };
        let worth = gains.iter().find(|worth| is_of_name(&worth.means));
        let shows = &worth.expect("it is offered").shows;
        shows.iter().map(|shown| shown.effect.as_str()).collect()
    };
    assert!(shown_by("oven").contains(&"film-tcr"), "{gains:?}");
    let by_steps = shown_by("reference");
    assert!(by_steps.contains(&"sensor-gain"), "{gains:?}");
    assert!(!by_steps.contains(&"film-tcr"), "{gains:?}");
}
