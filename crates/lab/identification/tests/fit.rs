//! What a fit says that data cannot separate, by what was measured.

use identification::prediction::predict;
use identification::{Dataset, FitReport, fit_and_report};
use measurement::{MeasurementFile, Row, Session};
use mirror_model::{Model, Preset};

/// A sweep of a mirror that has the paper's corrected parameters, fitted from those of the paper.
fn fitted(with_z: bool, with_currents: bool) -> (Model, FitReport) {
    let rows = (0..=14)
        .chain((0..14).rev())
        .enumerate()
        .map(|(index, step)| Row {
            t_s: 1.0 + index as f64,
            voltage_v: [0.25 * f64::from(step); 4],
            z_um: with_z.then_some(0.0),
            current_a: [with_currents.then_some(0.0); 4],
            ..Row::default()
        });
    let file = MeasurementFile {
        rows: rows.collect(),
        ..MeasurementFile::default()
    };
    let mut data = Dataset::new(&Session {
        files: vec![("sweep.csv".into(), file)],
    });
    let values = predict(&Model::from(Preset::Reconciled), &data).expect("an answer");
    for (observation, value) in data.observations.iter_mut().zip(values) {
        observation.value = value;
    }
    fit_and_report(&Model::from(Preset::Paper), &data, &["sweep.csv".into()]).expect("a fit")
}

fn says(report: &FitReport, words: &[&str]) -> bool {
    let mut sentences = report.inseparable.iter();
    sentences.any(|sentence| words.iter().all(|word| sentence.contains(word)))
}

#[test]
fn voltage_and_current_give_products_with_xi_only() {
    let (_, report) = fitted(false, true);
    assert!(
        says(&report, &["only the products xi dT and xi R_T"]),
        "{report}"
    );
    assert!(says(&report, &["R_T, xi", "1 number only"]), "{report}");
    let product = &report.parameters["xi*R_T"];
    approx(product.value, 3.92e-3 * 5.7e3);
    assert_eq!(product.unit, "1/W");
    approx(report.parameters["R0"].value, 360.0);
    assert!(
        !report
            .parameters
            .keys()
            .any(|name| name.starts_with("R_T") || name == "beta_b")
    );
}

#[test]
fn without_currents_the_heating_has_one_number() {
    let (model, report) = fitted(true, false);
    assert!(
        says(&report, &["R0, xi and R_T act through one heating"]),
        "{report}"
    );
    assert!(says(&report, &["beta_b", "d_alpha"]), "{report}");
    // The data lie on the model: a tenth of what lumped equations are not asked to follow, 0.1 um.
    assert!(
        report.residual_rms_um.is_some_and(|um| um < 0.01),
        "{report}"
    );
    assert_eq!(report.residual_rms_ma, None);
    assert!(model.by_actuator.is_empty());
}

#[test]
fn a_sweep_with_both_says_nothing_of_times() {
    let (_, report) = fitted(true, true);
    assert!(
        !report.parameters.keys().any(|name| name.starts_with("tau")),
        "{report}"
    );
    approx(report.parameters["R_T.2"].value, 5.7e3);
    assert!(
        says(&report, &["R_T, xi, beta_b, d_alpha, t_b"]),
        "{report}"
    );
}

/// To where a fit without noise ends: a step that gains less than a millionth, of a parameter with the prior's pull.
fn approx(value: f64, truth: f64) {
    assert!((value / truth - 1.0).abs() < 1e-3, "{value} is not {truth}");
}
