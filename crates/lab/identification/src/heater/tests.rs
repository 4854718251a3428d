use super::*;
use mirror_model::Preset;
use mirror_model::effect::find;

/// What rounding leaves of numbers of order 1 after a line through ten points.
const ROUNDING: f64 = 1e-9;

/// 300 ohm cold, half as much again at 1 W: ten readings up to there.
fn straight() -> Dataset {
    let ohm = |watt: f64| 300.0 * (1.0 + 0.5 * watt);
    let points: Vec<_> = (1..=10)
        .map(|tenth| f64::from(tenth) / 10.0)
        .map(|watt| (watt, ohm(watt)))
        .collect();
    Dataset::of_a_heater(&points, 1e-9)
}

#[test]
fn a_resistance_that_grows_with_power_is_read_off_as_a_straight_line() {
    let read = Readings::of(&straight(), 0).expect("ten readings");
    assert!((read.cold_ohm - 300.0).abs() < 300.0 * ROUNDING);
    assert!((read.growth - 0.5).abs() < ROUNDING);
    assert!((read.first_per_w - 0.5).abs() < ROUNDING);
    // 1 W at 450 ohm.
    assert!((read.hottest_v() - 450f64.sqrt()).abs() < 1e-6);
}

#[test]
fn a_rise_that_flattens_has_its_first_slope_from_the_coolest_readings() {
    // R = 100 (1 + P) up to 0.3 W, and then no more.
    let points: Vec<_> = (1..=10)
        .map(|tenth| f64::from(tenth) / 10.0)
        .map(|watt| (watt, 100.0 * (1.0 + watt.min(0.3))))
        .collect();
    let read = Readings::of(&Dataset::of_a_heater(&points, 1e-9), 0).expect("ten readings");
    assert!((read.first_per_w - 1.0).abs() < ROUNDING, "{read:?}");
    assert!((read.growth - 0.3).abs() < ROUNDING && read.hottest_w > 0.999);
}

#[test]
fn a_resistance_that_stays_is_taken_to_rise_by_less_than_is_seen() {
    let points = [0.1, 0.2, 0.4].map(|watt| (watt, 50.0));
    let read = Readings::of(&Dataset::of_a_heater(&points, 1e-9), 0).expect("three readings");
    assert_eq!(read.growth, LEAST_RISE);
    // A rise of `LEAST_RISE` over 0.4 W is 2.5e-4 a watt.
    assert!(read.first_per_w > 0.0 && read.first_per_w < 1e-3);
}

#[test]
fn currents_in_their_noise_and_too_few_of_them_say_nothing() {
    // 18 to 47 mA: four of ten are above 20 times 2 mA, and none above 20 times 3 mA.
    let noisy = |noise_a| {
        let mut data = straight();
        for observation in &mut data.observations {
            observation.noise = noise_a;
        }
        data
    };
    assert!(Readings::of(&noisy(2e-3), 0).is_some());
    assert!(Readings::of(&noisy(3e-3), 0).is_none());
    assert!(Readings::of(&straight(), 1).is_none(), "not measured");
}

#[test]
fn fits_start_as_warm_as_the_readings_are() {
    let model = Model::from(Preset::Paper);
    let xi = model.parameters.get(Symbol::ResistanceCoefficient);
    let [start] = &seeds(&model, &straight())[..] else {
        panic!("one start without effects");
    };
    let thermal = start.parameters.get(Symbol::ThermalResistance);
    assert!((thermal * xi - 0.5).abs() < ROUNDING);
    assert!((start.parameters.get(Symbol::ColdResistance) - 300.0).abs() < 300.0 * ROUNDING);
    let mut with_effect = model;
    let effect = find("radiation").expect("an effect");
    with_effect.effects.push(Active::usual(effect));
    assert_eq!(seeds(&with_effect, &straight()).len(), 3);
}

#[test]
fn its_size_counts_plausible_strengths() {
    let model = Model::from(Preset::Paper);
    let found = heater(&model, &straight()).expect("a heater");
    let xi = model.parameters.get(Symbol::ResistanceCoefficient);
    assert!((found.hottest_rise_k * xi - 0.5).abs() < ROUNDING);
    assert!((found.hottest_power_w - 1.0).abs() < ROUNDING);
    let of_a_mirror = straight().reading(0, Channel::Displacement, 0.0, 0.02);
    assert!(heater(&model, &of_a_mirror).is_none());
}

#[test]
fn time_constants_start_about_the_time_between_readings() {
    // Ten readings, a second each: 0.1 s to 3 s.
    let times = times(&straight());
    assert!((times[0] - 0.1).abs() < ROUNDING && (times[TIMES - 1] - 3.0).abs() < ROUNDING);
    assert!(times.is_sorted());
}

#[test]
fn starts_with_an_effect_are_the_best_of_its_strengths() {
    let data = straight();
    let model = seeds(&Model::from(Preset::Paper), &data).swap_remove(0);
    let radiation = Active::usual(find("radiation").expect("an effect"));
    let starts = starts(&model, &[radiation], &data);
    assert_eq!(starts.len(), WORTH_FITTING);
    assert!(starts.iter().all(|start| start.effects.len() == 1));
    // These readings radiate nothing: the weakest fits best.
    let strength = |start: &Model| start.effects[0].values[0];
    assert!(strength(&starts[0]) <= strength(&starts[1]));
}
