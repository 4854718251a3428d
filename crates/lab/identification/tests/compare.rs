//! What a comparison says of a session that a model with one more effect would have measured.

use identification::prediction::predict;
use identification::{Comparison, Dataset, Unit, compare};
use measurement::{Keys, MeasurementFile, Row, Session};
use mirror_model::effect::{Active, find};
use mirror_model::{Model, Preset};

const CHANNELS: [bool; 2] = [true, true];

fn file(
    experiment: &str,
    begin_s: f64,
    drives: Vec<([f64; 4], f64)>,
    [z, i]: [bool; 2],
) -> (String, MeasurementFile) {
    let mut keys = Keys::default();
    keys.set("experiment", experiment);
    let mut t_s = 0.0;
    let rows = drives
        .into_iter()
        .map(|(voltage_v, dwell_s)| {
            t_s += dwell_s;
            Row {
                t_s,
                t_global_s: Some(begin_s + t_s),
                voltage_v,
                z_um: z.then_some(0.0),
                current_a: [i.then_some(0.0); 4],
                ..Row::default()
            }
        })
        .collect();
    let file = MeasurementFile {
        keys,
        rows,
        ..MeasurementFile::default()
    };
    (format!("{experiment}.csv"), file)
}

/// A sweep, each actuator alone, a held step, and the sweep again, as a mirror with this effect would show them.
fn comparison(effect: &str, size: f64, channels: [bool; 2]) -> Comparison {
    let volts = |step: i32| 0.25 * f64::from(step);
    let sweep = || {
        (0..=14)
            .chain((0..14).rev())
            .map(|s| ([volts(s); 4], 1.0))
            .collect()
    };
    let single = (0..4).flat_map(|hot| {
        (0..=7).map(move |s| {
            let mut drive = [0.2; 4];
            drive[hot] = 0.5 * f64::from(s);
            (drive, 1.0)
        })
    });
    let step = (0..60).map(|row| ([2.0; 4], if row < 30 { 1e-3 } else { 1.0 }));
    let files = vec![
        file("sweep", 0.0, sweep(), channels),
        file("single", 40.0, single.collect(), channels),
        file("step", 100.0, step.collect(), channels),
        file("repeat", 200.0, sweep(), channels),
    ];
    let mut data = Dataset::new(&Session { files });
    let model = Model::from(Preset::Reconciled);
    let mut nature = model.clone();
    let mut active = Active::usual(find(effect).expect("an effect"));
    active.values[0] = size;
    nature.effects.push(active);
    let values = predict(&nature, &data).expect("an answer");
    for (observation, value) in data.observations.iter_mut().zip(values) {
        observation.value = value;
    }
    compare(&model, &data).expect("an answer")
}

fn says(comparison: &Comparison, place: &str, words: &str) -> bool {
    comparison
        .sentences
        .iter()
        .any(|sentence| sentence.starts_with(place) && sentence.contains(words))
}

#[test]
fn directions_are_compared_for_each_actuator_and_not_between_them() {
    let bent = comparison("heat-loss-temperature", 2e-3, CHANNELS);
    assert!(
        says(&bent, "sweep: ", "both directions alike, so not memory"),
        "{bent}"
    );
    assert!(says(&bent, "single, actuators 1, 2, 3, 4: ", ""), "{bent}");
    assert!(!says(&bent, "single", "memory"), "{bent}");
    let torn = comparison("hysteresis", 0.1, CHANNELS);
    assert!(says(&torn, "sweep: ", "the way down lies up to"), "{torn}");
}

#[test]
fn an_offset_is_the_same_at_every_drive() {
    let moved = comparison("sensor-offset", 2.0, CHANNELS);
    assert!(says(&moved, "sweep: ", "too low by 2.00 um"), "{moved}");
    assert!(
        says(&moved, "sweep: ", "much the same at every drive"),
        "{moved}"
    );
    assert!(
        says(&moved, "repeat, against sweep", "the same within 0.00 um"),
        "{moved}"
    );
    assert_eq!(
        moved.stages.z_at_equal_r_um.map(|um| (1e6 * um).round()),
        Some(2e6)
    );
    assert!(
        moved
            .stages
            .r_at_equal_p_percent
            .is_some_and(|percent| percent < 1e-9)
    );
}

#[test]
fn what_stays_is_history_and_what_creeps_shows_in_time() {
    let bent = comparison("softening", 0.1, CHANNELS);
    assert!(
        says(&bent, "repeat, against sweep", "in the mean"),
        "{bent}"
    );
    let crept = comparison("creep", 0.05, CHANNELS);
    assert!(
        says(&crept, "step, the error after the jump to 2.00 V", "creep"),
        "{crept}"
    );
}

#[test]
fn heat_shows_in_the_resistance_at_equal_power() {
    let hot = comparison("heat-loss-temperature", 4e-3, CHANNELS);
    let stages = &hot.stages;
    assert!(stages.heat_um > stages.z_at_equal_r_um, "{hot}");
    let course = &stages.heat_course;
    assert!(course.len() == 3 && course[2].1 < course[0].1, "{hot}");
}

#[test]
fn currents_alone_are_compared_in_milliamperes() {
    let hot = comparison("heat-loss-temperature", 4e-3, [false, true]);
    assert_eq!((hot.unit, hot.experiments.len()), (Unit::Milliampere, 4));
    assert!(says(&hot, "sweep: ", "mA at"), "{hot}");
    assert!(hot.rms > 0.0 && hot.stages.z_at_equal_r_um.is_none());
    let seen = comparison("heat-loss-temperature", 4e-3, [true, false]);
    assert!(seen.current_rms_ma.is_none() && seen.stages.heat_um.is_none());
}
