//! Heaters without a displacement sensor: the sessions of `data/heaters`, asked about as a user asks. One of them, and all
//! where a long run asks for what is long.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::common::no_boards;
use crate::{json, lab};

/// The one that is always asked about. What lacks nothing is `a_resistor_lacks_nothing` of the diagnosis's tests, too.
const SHORT: &str = "wire";

/// A set of more effects than this says nothing.
const SET: usize = 3;

fn file(name: &str) -> PathBuf {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/heaters");
    directory.join(name)
}

/// Model file and measurement of a heater.
fn heater(name: &str) -> [String; 2] {
    ["toml", "csv"].map(|kind| file(&format!("{name}.{kind}")).display().to_string())
}

/// What each heater lacks.
fn answers() -> Vec<(String, Vec<String>)> {
    let answers = std::fs::read_to_string(file("answers.toml")).expect("answers");
    let answers: toml::Table = answers.parse().expect("answers in TOML");
    answers
        .into_iter()
        .map(|(name, lacks)| (name, lacks.try_into().expect("a list of effects")))
        .collect()
}

fn strings(list: &Value) -> Vec<String> {
    let list = list.as_array().expect("a list").iter();
    list.map(|item| item.as_str().expect("an id").to_owned())
        .collect()
}

#[test]
fn what_a_heater_lacks_is_named_and_nothing_else_and_the_error_falls() {
    let place = no_boards();
    let is_asked = |name: &str| long_runs::are_asked_for() || name == SHORT;
    for (name, lacks) in answers().into_iter().filter(|(name, _)| is_asked(name)) {
        let [model, readings] = heater(&name);
        let found = json(&["diagnose", &model, &readings]);
        let effects = strings(&found["effects"]);
        println!("{name}: {lacks:?}, {} {effects:?}", found["verdict"]);
        let ranked = found["ranking"].as_array().expect("a ranking");
        for ranked in ranked.iter().map(|ranked| &ranked["effect"]) {
            assert!(
                !["gap-heat-loss", "hysteresis", "creep", "sensor-offset"]
                    .contains(&ranked.as_str().expect("an id")),
                "{name}: {ranked} cannot show in currents"
            );
        }
        let Some(missing) = lacks.first() else {
            assert_eq!(found["verdict"], "none", "{name}: {found}");
            continue;
        };
        assert!(
            effects.contains(missing) && effects.len() <= SET,
            "{name}: {effects:?}"
        );
        let with = place.path().join(format!("{name}.toml"));
        let with = with.display().to_string();
        let edit = json(&["effect", "add", missing, &model, &readings, "-o", &with]);
        let rms = |when: &str| edit[when]["rms"].as_f64().expect("an error");
        // Noise, and what the real form and the model's differ by, leave 4 % at most.
        assert!(
            rms("after") < 0.1 * rms("before"),
            "{name}: {}",
            edit["advice"]
        );
        // The model's effects are fitted again in the range of this heater, and found where they were.
        let again = place.path().join(format!("{name}-again.toml"));
        let again = again.display().to_string();
        json(&["fit", &with, &readings, "-o", &again]);
        let refitted = json(&["compare", &again, &readings]);
        // The same minimum from another start, and a tenth of a microampere where hardly anything is left.
        assert!(refitted["rms"].as_f64().expect("an error") < 1.1 * rms("after") + 1e-4);
    }
}

#[test]
fn a_fit_says_what_voltage_and_current_tell_of_a_heater() {
    let place = no_boards();
    // Cold resistance, growth per kelvin, and loss per kelvin that it was made with.
    for (name, ohm, per_kelvin, watt_per_kelvin) in [
        ("poly", 900.0, 1.1e-3, 5e-5),
        ("kilohm-12v", 1000.0, 1e-3, 3e-4),
        ("one-ohm", 1.0, 3.9e-3, 6e-3),
    ] {
        let [model, readings] = heater(name);
        let output = place.path().join(format!("{name}.toml"));
        let fitted = json(&[
            "fit",
            &model,
            &readings,
            "-o",
            &output.display().to_string(),
        ]);
        let near = |parameter: &str, truth: f64| {
            let value = fitted["parameters"][parameter]["value"].as_f64();
            let value = value.unwrap_or_else(|| panic!("{name}: no {parameter} in {fitted}"));
            // Twice what an ammeter's offset makes of the growth of one of them, 1.1 %.
            assert!(
                (value / truth - 1.0).abs() < 0.022,
                "{name}: {parameter} {value}, {truth}"
            );
        };
        near("R0", ohm);
        near("xi*R_T", per_kelvin / watt_per_kelvin);
        assert!(
            fitted["inseparable"]
                .to_string()
                .contains("only the products")
        );
    }
}

#[test]
fn a_comparison_speaks_of_milliamperes_and_kelvins() {
    let [model, readings] = heater("lamp");
    let said = lab(&["compare", &model, &readings]);
    assert_eq!(said.code, 0, "{}", said.err);
    for words in ["mA", "K of warming", "at equal power"] {
        assert!(said.out.contains(words), "{words}: {}", said.out);
    }
}
