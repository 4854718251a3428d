//! What a board leaves of effects that it knows, and of those that it does not.

use calibration::rehearse;
use mirror_model::effect::{Active, find};
use mirror_model::{Model, Preset, Symbol};

fn plain() -> Model {
    let mut model = Model::from(Preset::Reconciled);
    for (symbol, value) in [
        (Symbol::FastTime, 5e-3),
        (Symbol::MiddleTime, 0.04),
        (Symbol::MiddleWeight, 0.2),
    ] {
        model.parameters.set(symbol, value);
    }
    model
}

fn with(id: &str) -> Model {
    let mut model = plain();
    model
        .effects
        .push(Active::usual(find(id).expect("an effect")));
    model
}

#[test]
fn a_board_that_knows_the_model_leaves_nearly_nothing_and_its_table_alone_leaves_the_poles() {
    let left = rehearse(&plain(), &plain()).expect("a calibration");
    // What is required of positions at rest (`docs/requirements.md`); a table alone, that is late by poles of 5 and 40 ms, is far
    // from it.
    assert!(left.in_time.rms_um < 0.05, "{left:?}");
    assert!(left.at_rest.rms_um > 10.0 * left.in_time.rms_um, "{left:?}");
    assert!(left.in_time.largest_um >= left.in_time.rms_um);
}

#[test]
fn static_effects_change_the_table_and_memory_the_feedforward() {
    for id in [
        "heat-loss-temperature",
        "expansion-temperature",
        "hysteresis",
        "creep",
        "substrate-warming",
    ] {
        let ignorant = rehearse(&with(id), &plain())
            .expect("a calibration")
            .in_time;
        let knowing = rehearse(&with(id), &with(id))
            .expect("a calibration")
            .in_time;
        // An effect that is known is inverted but for what its form in the core leaves, the lesser part of it.
        assert!(
            knowing.rms_um < 0.5 * ignorant.rms_um,
            "{id}: {ignorant:?} {knowing:?}"
        );
    }
}

#[test]
fn what_the_core_cannot_invert_remains() {
    let knowing = rehearse(&with("ambient-drift"), &with("ambient-drift")).expect("a calibration");
    let ignorant = rehearse(&with("ambient-drift"), &plain()).expect("a calibration");
    assert_eq!(knowing, ignorant);
    assert!(knowing.in_time.rms_um > rehearse(&plain(), &plain()).unwrap().in_time.rms_um);
}

#[test]
fn what_the_sensor_adds_moves_no_mirror() {
    let plain_left = rehearse(&plain(), &plain()).expect("a calibration");
    assert_eq!(
        rehearse(&with("sensor-gain"), &plain()).expect("a calibration"),
        plain_left
    );
}
