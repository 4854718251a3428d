//! Calibration files: read again as they were written, refused one field off at a time.

use calibration::{from_toml, tabulate, to_toml};
use control_core::calibration::{Parts, Plate};
use control_core::{Calibration, Micrometre};
use mirror_model::Model;

const MODEL: &str = r#"
format = 1
preset = "reconciled"
[parameters]
tau_fast = { value = 0.001, unit = "s" }
w_mid = { value = 0.35, unit = "1" }
tau_mid = { value = 0.035, unit = "s" }
w_slow = { value = 0.06, unit = "1" }
tau_slow = { value = 4.7, unit = "s" }
R0 = { value = 360.0, unit = "ohm", actuators = [358.0, 361.0, 362.0, 364.0] }
[[effects]]
id = "hysteresis"
[[effects]]
id = "creep"
[[effects]]
id = "resonance"
[provenance]
device = "mirror 7"
date = "2026-11-21"
"#;

fn calibration() -> Calibration {
    let model = Model::parse("model.toml", MODEL).expect("a model");
    tabulate(&model).expect("a calibration").calibration
}

/// What is said of the file after `from` has become `to`.
fn refusal(from: &str, to: &str) -> String {
    let text = to_toml(&calibration());
    assert!(text.contains(from), "{from} is not in\n{text}");
    let spoiled = text.replacen(from, to, 1);
    from_toml("mirror.toml", &spoiled)
        .expect_err(to)
        .to_string()
}

#[test]
fn a_file_is_read_as_it_was_written() {
    let calibration = calibration();
    let read = from_toml("mirror.toml", &to_toml(&calibration)).expect("its own file");
    assert_eq!(read, calibration);
    assert_eq!(read.to_bytes(), calibration.to_bytes());
}

#[test]
fn one_field_off_at_a_time_is_refused_by_name() {
    for (from, to, named) in [
        ("format = 1", "format = 2", "format 2"),
        ("device = ", "divice = ", "divice"),
        (
            "\"mirror 7\"",
            "\"a mirror with a name that nobody in their right mind would give\"",
            "device",
        ),
        ("model_hash = \"", "model_hash = \"x", "model_hash"),
        ("move_time_s = ", "move_time_s = 1", "move_time_s"),
        (
            "frequency_hz = ",
            "frequency_hz = 9",
            "resonance.frequency_hz",
        ),
        ("quality = ", "quality = -", "resonance.quality"),
        ("max_drive_v = 3.5", "max_drive_v = -3.5", "max_drive_v"),
        ("max_drive_v = 3.5", "max_drive_v = \"3.5\"", "string"),
        ("max_power_w = ", "max_power_w = nan #", "max_power_w"),
        ("max_rise_k = ", "max_rise_k = inf #", "max_rise_k"),
        (
            "weight = 0.35",
            "weight = 0.36",
            "fast_poles[0] and those with it",
        ),
        ("time_s = 4.7", "time_s = -4.7", "slow_poles[0]"),
        ("radius_um = 10", "radius_um = 1", "plays[2]"),
        ("time_s = 25", "time_s = 0", "creep[3]"),
        (
            "cold_resistance_ohm = ",
            "cold_resistance_ohm = -",
            "cold_resistance_ohm of actuator 1",
        ),
        ("tcr_per_k = ", "tcr_per_k = -", "tcr_per_k of actuator 1"),
        (
            "thermal_resistance_k_per_w = ",
            "thermal_resistance_k_per_w = nan #",
            "thermal_resistance",
        ),
        ("top_um = ", "top_um = -", "top_um of actuator 1"),
        (
            "temperature_rise_k = [",
            "temperature_rise_k = [0.0, ",
            "130 values",
        ),
        (
            "temperature_rise_k = [0.0",
            "temperature_rise_k = [1.0",
            "temperature_rise_k[0]",
        ),
    ] {
        let said = refusal(from, to);
        assert!(said.contains(named), "{to}: {said}");
    }
}

/// Each of them is a value that some mirror may have.
#[test]
fn a_thermal_resistance_that_does_not_belong_to_its_table_is_refused() {
    let original = calibration();
    let with = |factor: f32, changed: usize| {
        let mut parts: Parts = *original.parts();
        for actuator in &mut parts.actuators[..changed] {
            actuator.thermal_resistance.0 *= factor;
        }
        let changed = Calibration::new(parts).expect("some mirror's");
        from_toml("mirror.toml", &to_toml(&changed)).map_err(|error| error.to_string())
    };
    for (factor, changed, told) in [
        (1e-3, 1, "the board drives at most 40.000 mW"),
        (10.0, 1, "the other actuators take about"),
        (1e3, 4, "max_power_w is"),
    ] {
        let said = with(factor, changed).expect_err("no mirror");
        for word in ["thermal_resistance_k_per_w of actuator 1", told] {
            assert!(said.contains(word), "{said}");
        }
    }
    for factor in [0.7, 1.4] {
        with(factor, 1).expect("a mirror of unlike actuators");
    }
}

#[test]
fn an_actuator_that_is_missing_is_missed() {
    let text = to_toml(&calibration());
    let last = text.rfind("[[actuators]]").expect("four of them");
    let said = from_toml("mirror.toml", &text[..last]).expect_err("three actuators");
    assert!(said.to_string().contains("3 actuators"), "{said}");
}

/// A plate of half a millimetre whose levers were written in another unit by hand.
#[test]
fn levers_of_another_unit_are_refused_with_what_levers_may_be() {
    let levers = Calibration::new(Parts {
        plate: Plate::cross(Micrometre(212.5)),
        ..*calibration().parts()
    });
    let text = to_toml(&levers.expect("a plate"));
    from_toml("mirror.toml", &text).expect("micrometres");
    for other in ["0.0002125", "0.2125", "212500.0"] {
        let spoiled = text.replace("212.5", other);
        assert_ne!(spoiled, text);
        let refused = from_toml("mirror.toml", &spoiled).expect_err(other);
        let said = refused.to_string();
        assert!(said.contains("levers[0]"), "{said}");
        assert!(said.contains("1 to 100000 um"), "{said}");
    }
}
