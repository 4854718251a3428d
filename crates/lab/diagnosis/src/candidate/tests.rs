use super::*;
use crate::residual_space::{BaseOnly, ModelDiscrepancy};
use direction::from_all_starts;
use identification::dataset::{Channel, Dataset};
use identification::fit::{Precision, fit};
use identification::prediction::{jacobian, predict};
use mirror_model::effect::{Timing, find, forms};
use mirror_model::{Model, Preset};
use nalgebra::DMatrix;
use nalgebra::DVector;

/// A candidate of this effect with this score, above its threshold.
pub(crate) fn scored(id: &str, score: f64) -> Candidate {
    let effect = find(id).expect("a built-in effect");
    let space = ResidualSpace::new(
        &DMatrix::zeros(1, 0),
        &Arc::new(ModelDiscrepancy::new(
            &DMatrix::zeros(1, 0),
            &DVector::repeat(1, 1.0),
        )),
        vec![],
    );
    Candidate {
        threshold: 0.0,
        explanation: Some(Explanation {
            active: Active::usual(effect.clone()),
            score,
            change: space.vector(&DVector::zeros(1)),
            slope_error: 0.0,
        }),
        ..Candidate::new(effect, vec![])
    }
}

/// Four readings, of which the base takes up the first.
fn space() -> ResidualSpace<BaseOnly> {
    ResidualSpace::of_base(&DMatrix::from_column_slice(4, 1, &[1.0, 0.0, 0.0, 0.0]))
}

/// An offset of 0.3 um at its usual size changes these readings by as much.
fn direction(change: [f64; 4]) -> Direction<BaseOnly> {
    Direction {
        active: Active::usual(find("sensor-offset").expect("an effect")),
        change: space().vector(&DVector::from_row_slice(&change)),
    }
}

#[test]
fn a_scan_is_linear_least_squares_of_the_strength() {
    let residual = space().vector(&DVector::from_row_slice(&[9.0, 6.0, 4.0, 1.0]));
    let directions = [
        direction([1.0, 2.0, 0.0, 0.0]),
        direction([5.0, 0.0, 0.0, 1.0]),
    ];
    let found = Scan::new(&directions).explanation(&residual).unwrap();
    let usual = directions[0].active.values[0];
    let count = directions[0].active.values.len() as f64;
    // 6 = 3 * 2: the first direction three times explains 36 of 53.
    let p = &found.active.effect.info().parameters[0];
    let times = (3.0_f64).clamp(p.low / usual, p.high / usual);
    let drop = 2.0 * times * 12.0 - times * times * 4.0;
    // The ridge leaves 1e-9 of what the base takes up.
    assert!(
        (found.active.values[0] / usual - times).abs() < 1e-6,
        "{:?}",
        found.active
    );
    assert!(
        (found.score - (drop - PRICE * count)).abs() < 1e-6,
        "{}",
        found.score
    );
    assert!((found.slope_error - usual.abs() / 2.0).abs() < 1e-6);
    let left = &residual - &found.change;
    assert!((left.norm_squared() - (53.0 - drop)).abs() < 1e-6);
}

#[test]
fn a_strength_stays_within_its_bounds_and_is_then_not_plausible() {
    let far = space().vector(&DVector::from_row_slice(&[0.0, 1e6, 0.0, 0.0]));
    let found = Scan::new(&[direction([0.0, 1.0, 0.0, 0.0])])
        .explanation(&far)
        .unwrap();
    let strength = &found.active.effect.info().parameters[0];
    assert!((found.active.values[0] / strength.high - 1.0).abs() < 1e-12);
    assert!(!is_plausible(&found.active));
    assert!(is_plausible(&Active::usual(found.active.effect.clone())));
}

#[test]
fn what_changes_no_reading_explains_none() {
    let residual = space().vector(&DVector::from_row_slice(&[0.0, 6.0, 0.0, 0.0]));
    // The base can do all of the first reading.
    assert!(
        Scan::new(&[direction([8.0, 0.0, 0.0, 0.0])])
            .explanation(&residual)
            .is_none()
    );
}

#[test]
fn a_form_is_tried_between_its_bounds() {
    for (id, count) in [("sensor-offset", 1), ("creep", 8), ("resonance", 48)] {
        let effect = find(id).expect("an effect");
        let tried = from_all_starts(&effect, None);
        let parameters = &effect.info().parameters;
        assert_eq!(
            tried.len(),
            if parameters.len() > 1 { count } else { 1 },
            "{id}"
        );
        for active in &tried {
            assert_eq!(active.values[0], parameters[0].start);
            for (value, p) in active.values.iter().zip(parameters.iter()) {
                assert!((p.low..=p.high).contains(value), "{id} {}", p.symbol);
            }
        }
    }
}

#[test]
fn periods_are_tried_half_a_cycle_apart_in_both_phases() {
    let swing = forms(&find("ambient-drift").expect("an effect"));
    let swing = swing
        .iter()
        .find(|form| form.timing() == Some(Timing::Period));
    let swing = swing.expect("a form that swings");
    // Of 100 s: 200 s, 100 s, 66.7 s and on to the 10 s that are the shortest.
    let tried = from_all_starts(swing, Some(100.0));
    assert_eq!(tried.len(), 2 * 20);
    assert_eq!(tried[0].values[1..], [200.0, 0.0]);
    assert_eq!(tried[39].values[1..], [10.0, std::f64::consts::FRAC_PI_2]);
    // A session of an hour has a longest period, and one of a second a shortest.
    let longest = from_all_starts(swing, Some(3600.0));
    assert_eq!(longest[0].values[1], 1500.0);
    assert_eq!(from_all_starts(swing, Some(1.0)).len(), 2);
}

#[test]
fn what_follows_the_clock_changes_each_reading_by_what_it_is_then() {
    let levels = (0..=14).chain((0..14).rev());
    let held = levels.map(|level| (0.25 * f64::from(level), 2.0));
    let channels = [(Channel::Displacement, 0.02), (Channel::Current(0), 2e-6)];
    let data = Dataset::driven(held).read_at_each(&channels);
    let model = Model::from(Preset::Reconciled);
    let base = predict(&model, &data).unwrap();
    let at = Operating {
        model: &model,
        data: &data,
        base: &base,
    };
    let drifts = ["ambient-drift", "sensor-drift"].map(|id| find(id).expect("an effect"));
    for form in drifts.iter().flat_map(forms) {
        let slow = at.slow(&form).expect("a course");
        for active in from_all_starts(&form, Some(data.lasts_s())) {
            let exact = at.change(&active).unwrap();
            let off = (slow.change(&active) - &exact).norm();
            // A course of 10 s is 0.1 % behind, and a heater's power follows its resistance; as much again.
            assert!(
                off < 0.003 * exact.norm(),
                "{} {:?}: {off}",
                form.form(),
                active.values
            );
        }
    }
    assert!(at.slow(&find("creep").expect("an effect")).is_none());
}

/// The space of one reading with unit noise, which nothing is free to explain.
fn of_one_reading() -> ResidualSpace<Session> {
    let none = ModelDiscrepancy::new(&DMatrix::zeros(1, 0), &DVector::repeat(1, 1.0));
    ResidualSpace::new(&DMatrix::zeros(1, 0), &Arc::new(none), vec![])
}

#[test]
fn a_detection_limit_is_the_strength_whose_score_is_needed() {
    let mut candidate = scored("sensor-offset", 0.0);
    assert_eq!(candidate.detection_limit(), None);
    let space = of_one_reading();
    candidate.directions = vec![Direction {
        active: Active::usual(candidate.effect.clone()),
        change: space.vector(&DVector::repeat(1, 20.0)),
    }];
    candidate.threshold = 25.0;
    let start = candidate.effect.info().parameters[0].start;
    let limit = candidate.detection_limit().unwrap();
    assert!(
        (limit - (5.0 + MARGIN) / 20.0 * start.abs()).abs() < 1e-12,
        "{limit}"
    );
    candidate.threshold = 1e12;
    assert_eq!(candidate.detection_limit(), None);
}

#[test]
fn a_detection_limit_holds_at_half_of_the_starts_of_the_form_that_shows_least() {
    let listed = find("crosstalk").expect("an effect");
    let of_form = |form: &str| {
        let all = mirror_model::effect::forms(&listed);
        all.into_iter().find(|f| f.form() == form).expect("a form")
    };
    let space = of_one_reading();
    let direction = |form: &str, size: f64| Direction {
        active: Active::usual(of_form(form)),
        change: space.vector(&DVector::repeat(1, size)),
    };
    let mut candidate = scored("crosstalk", 0.0);
    candidate.threshold = 25.0;
    let usual = 0.02;
    let limit = |candidate: &Candidate| candidate.detection_limit().unwrap() / usual;
    // Of three starts of one form the second counts; at one, nothing shows.
    candidate.directions = [0.0, 20.0, 80.0]
        .map(|size| direction("plate", size))
        .into();
    assert!((limit(&candidate) - (5.0 + MARGIN) / 20.0).abs() < 1e-12);
    // A form that shows less counts in its place, one that shows more does not.
    candidate.directions.push(direction("frame", 40.0));
    assert!((limit(&candidate) - (5.0 + MARGIN) / 20.0).abs() < 1e-12);
    candidate.directions.push(direction("neighbours", 10.0));
    assert!((limit(&candidate) - (5.0 + MARGIN) / 10.0).abs() < 1e-12);
}

/// Displacement and a current at levels that go up and down.
fn data() -> Dataset {
    let levels = (0..=14).chain((0..14).rev());
    let held = levels.map(|level| (0.25 * f64::from(level), 1.0));
    Dataset::driven(held)
        .read_at_each(&[(Channel::Displacement, 0.02), (Channel::Current(0), 2e-6)])
}

#[test]
fn refining_and_refitting_find_the_values_that_made_the_readings() {
    let effect = find("softening").expect("an effect");
    let mut truth = Model::from(Preset::Reconciled);
    let mut hidden = Active::usual(effect.clone());
    hidden.values[0] *= 1.4;
    truth.effects.push(hidden.clone());
    let data = data();
    let data = data.with_values(&predict(&truth, &data).unwrap());
    let fitted = fit(&Model::from(Preset::Reconciled), &data).unwrap();
    let base = predict(&fitted.model, &data).unwrap();
    let slopes = jacobian(&fitted.model, &data, &fitted.free).unwrap();
    let rows = data.observations.len();
    let none = ModelDiscrepancy::new(&DMatrix::zeros(rows, 0), &DVector::repeat(rows, 1.0));
    let space: ResidualSpace<Session> = ResidualSpace::new(&slopes, &Arc::new(none), vec![]);
    let residual = space.vector(&fitted.standardised(&data));
    let at = Operating {
        model: &fitted.model,
        data: &data,
        base: &base,
    };
    let scanned = Scan::new(&at.directions(&effect, &space))
        .explanation(&residual)
        .unwrap();
    let refined = refine(&scanned, at, &residual, &space);
    assert!(refined.score >= scanned.score);
    let misfit = residual.norm_squared();
    let together = |active: &Active, strength: Strength| {
        let models = std::slice::from_ref(&fitted.model);
        let precision = Precision::Fine;
        refit(active, strength, models, &data, &space, misfit, precision).unwrap()
    };
    let mut less = refined.active.clone();
    less.values[0] *= 0.8;
    let (held, of_held) = together(&less, Strength::Held);
    let (refitted, refit) = together(&refined.active, Strength::Free);
    assert!(held.score < refitted.score);
    assert!(of_held.fitted.cost(&data) > refit.fitted.cost(&data));
    let held = held.explanation(refined.change.clone());
    assert_eq!(held.active.values[0], less.values[0]);
    let refitted = refitted.explanation(refined.change);
    let off = refitted.active.values[0] / hidden.values[0] - 1.0;
    // A fit ends where a step gains less than a millionth of the sum of squares.
    assert!(off.abs() < 1e-2, "{off}");
    assert!(refit.left.norm_squared() < 1e-3 * misfit, "{misfit}");
}
