//! The parameters of eqs. 3-9 and of the thermal poles that a session can identify, and where fits of them start.

use crate::dataset::{Channel, Dataset};
use crate::heater;
use crate::heating::thermal_resistance_of_displacements;
use crate::parameter::BaseParameter;
use mirror_model::{ACTUATORS, Model, Symbol};

/// Time constants can be identified from more observations than this whose shortest interval is below `FAST_S`: the fast
/// pole's time constant of such mirrors is some milliseconds (`TIMES`).
const TRANSIENT_OBSERVATIONS: usize = 50;
const FAST_S: f64 = 0.01;
/// Displacements alone tell the curvature from the heating only by the form of their curve, which takes more drives than this.
const FEW_DRIVES: usize = 2;
/// The cold resistance is read off one in so many of the readings, those at the lowest drives.
const COLDEST: usize = 4;

/// What this session can identify. Without currents nothing is known of the actuators' heaters, without a displacement
/// nothing of their bending; a session of steady points only says nothing of time constants. A heater on a bench may be as
/// slow as it likes.
pub fn identifiable(data: &Dataset) -> Vec<BaseParameter> {
    let mut free = Vec::new();
    let heaters = [Symbol::ColdResistance, Symbol::ThermalResistance];
    if data.is_one_heater() {
        free.extend(heaters.map(BaseParameter::Shared));
    } else if data.has_current() {
        let measured = |actuator: &usize| {
            let current = Channel::Current(*actuator);
            data.observations.iter().any(|o| o.channel == current)
        };
        for symbol in heaters {
            let actuators = (0..ACTUATORS).filter(measured);
            free.extend(actuators.map(|actuator| BaseParameter::Own(symbol, actuator)));
        }
    } else {
        free.push(BaseParameter::Shared(Symbol::ThermalResistance));
    }
    if data.has_displacement() && (data.has_current() || distinct_drives(data) > FEW_DRIVES) {
        free.push(BaseParameter::Shared(Symbol::CurvatureCoefficient));
    }
    let durations = data.intervals.iter().map(|interval| interval.duration_s);
    let shortest_s = durations.fold(f64::INFINITY, f64::min);
    if data.is_steady {
        return free;
    }
    if data.observations.len() > TRANSIENT_OBSERVATIONS && shortest_s < FAST_S {
        free.extend(poles(data).map(BaseParameter::Shared));
    } else if data.is_of_heaters() {
        free.push(BaseParameter::Shared(Symbol::FastTime));
    }
    free
}

/// Time and weight of the poles that transients show: of a mirror the fast one and the middle one, whose time is bounded, as
/// beams and plate bound it; of a heater on a bench, which may be as slow as it likes, the slow one.
fn poles(data: &Dataset) -> [Symbol; 3] {
    if data.is_of_heaters() {
        [Symbol::FastTime, Symbol::SlowWeight, Symbol::SlowTime]
    } else {
        [Symbol::FastTime, Symbol::MiddleWeight, Symbol::MiddleTime]
    }
}

/// The median of V/I over the quarter of readings at the lowest drives, of those whose current can be told from its noise, in
/// the surroundings that the cold resistance belongs to (ohm).
pub fn coldest_resistance(data: &Dataset, actuator: usize) -> Option<f64> {
    let readings = data
        .observations
        .iter()
        .filter(|o| o.channel == Channel::Current(actuator) && o.value > heater::TOLD * o.noise)
        .filter(|o| data.intervals[o.interval].ambient_k == 0.0);
    let mut pairs: Vec<(f64, f64)> = readings
        .map(|o| (data.drive(o)[actuator], o.value))
        .filter(|&(v, _)| v > 0.0)
        .collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let coldest = pairs.iter().take(pairs.len().div_ceil(COLDEST));
    let mut ohms: Vec<f64> = coldest.map(|(v, i)| v / i).collect();
    ohms.sort_by(f64::total_cmp);
    ohms.get(ohms.len() / 2).copied()
}

/// How many drives of the first actuator above 0 were observed, to a millivolt.
fn distinct_drives(data: &Dataset) -> usize {
    let mut drives: Vec<_> = data
        .observations
        .iter()
        .map(|o| (data.drive(o)[0] * 1e3) as i64)
        .filter(|&mv| mv > 0)
        .collect();
    drives.sort_unstable();
    drives.dedup();
    drives.len()
}

/// Fast time (s), weight and time (s) of the second pole.
type Times = (f64, f64, f64);

/// Those of a mirror that fits start from: mirrors differ in them by orders of magnitude, and a fit that starts far off stays
/// there. They span those of the null ensemble's families (`diagnosis`), on which `cargo xtask bench diagnose` benches them.
const TIMES: [Times; 3] = [(8e-3, 0.2, 0.04), (2e-3, 0.3, 0.02), (0.02, 0.3, 0.2)];
/// Of a heater the second pole's weight, and how many times slower than the first it is, that fits start from.
const HEATER_WEIGHT: f64 = 0.3;
const HEATER_RATIO: f64 = 10.0;

/// The sets of time constants that fits to these data start from.
fn times(data: &Dataset) -> Vec<Times> {
    if !data.is_of_heaters() {
        return TIMES.to_vec();
    }
    heater::times(data)
        .map(|fast_s| (fast_s, HEATER_WEIGHT, HEATER_RATIO * fast_s))
        .to_vec()
}

/// Where fits start: usual sizes for the time constants that the model leaves at 0, cold resistances read off the smallest
/// drives, or without currents the heating that moves a mirror so far, since heaters differ by orders of magnitude, and what was
/// measured of other parameters.
pub fn seeds(model: &Model, free: &[BaseParameter], data: &Dataset) -> Vec<Model> {
    let fast = BaseParameter::Shared(Symbol::FastTime);
    let mut times = times(data);
    if !free.contains(&fast) || fast.get(model) > 0.0 {
        times.truncate(1);
    }
    let models = if data.is_of_heaters() {
        heater::seeds(model, data)
    } else {
        vec![with_own_heating(with_own_resistances(model, data), data)]
    };
    models
        .iter()
        .map(|model| as_measured(model, free))
        .flat_map(|model| {
            let seed = |&times: &Times| seed(&model, free, times);
            times.iter().map(seed).collect::<Vec<_>>()
        })
        .collect()
}

/// The model with what was measured of its free parameters.
fn as_measured(model: &Model, free: &[BaseParameter]) -> Model {
    let mut known = model.clone();
    for &parameter in free {
        if let Some(measured) = model.measured.get(&parameter.symbol()) {
            parameter.set(&mut known, measured.value);
        }
    }
    known
}

/// A fitted model with each of the sets of time constants that fits start from: the best fit without an effect may lie far
/// from the best one with it.
pub fn restarts(fitted: &Model, free: &[BaseParameter], data: &Dataset) -> Vec<Model> {
    times(data)
        .into_iter()
        .map(|times| {
            let mut model = fitted.clone();
            for &parameter in free {
                if let Some(usual) = usual(parameter.symbol(), times) {
                    parameter.set(&mut model, usual);
                }
            }
            model
        })
        .collect()
}

fn usual(symbol: Symbol, (fast_s, weight, second_s): Times) -> Option<f64> {
    match symbol {
        Symbol::FastTime => Some(fast_s),
        Symbol::MiddleWeight | Symbol::SlowWeight => Some(weight),
        Symbol::MiddleTime | Symbol::SlowTime => Some(second_s),
        _ => None,
    }
}

/// The model with the cold resistances that can be read off these numbers.
pub fn with_own_resistances(model: &Model, data: &Dataset) -> Model {
    let mut model = model.clone();
    for actuator in 0..ACTUATORS {
        if let Some(ohm) = coldest_resistance(data, actuator) {
            BaseParameter::of_actuator(Symbol::ColdResistance, actuator, data).set(&mut model, ohm);
        }
    }
    model
}

/// The model with the heating that moves it as far as the readings without currents say.
fn with_own_heating(mut model: Model, data: &Dataset) -> Model {
    let found = thermal_resistance_of_displacements(&model.parameters, data);
    if let Some(k_per_w) = found {
        BaseParameter::Shared(Symbol::ThermalResistance).set(&mut model, k_per_w);
    }
    model
}

fn seed(model: &Model, free: &[BaseParameter], times: Times) -> Model {
    let mut model = model.clone();
    for &parameter in free {
        if let Some(usual) = usual(parameter.symbol(), times)
            && parameter.get(&model) <= 0.0
        {
            parameter.set(&mut model, usual);
        }
    }
    model
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_model::Preset;

    fn names(data: &Dataset) -> Vec<String> {
        identifiable(data)
            .into_iter()
            .map(BaseParameter::name)
            .collect()
    }

    /// Currents of these actuators, and displacements if asked for, at 0.1 V to 0.8 V held for this long each.
    fn measured(actuators: &[usize], displacement: bool, seconds: f64) -> Dataset {
        let volts = |step: usize| 0.1 * (step + 1) as f64;
        let mut data = Dataset::driven((0..8).map(|step| (volts(step), seconds)));
        for step in 0..8 {
            for &actuator in actuators {
                let amperes = volts(step) / (100.0 * (actuator + 1) as f64 + step as f64);
                data = data.reading(step, Channel::Current(actuator), amperes, 1e-9);
            }
            if displacement {
                data = data.reading(step, Channel::Displacement, 0.0, 0.02);
            }
        }
        data
    }

    #[test]
    fn currents_identify_each_actuator_that_has_one() {
        assert_eq!(
            names(&measured(&[0, 3], true, 1.0)),
            ["R0.1", "R0.4", "R_T.1", "R_T.4", "beta_b"]
        );
    }

    #[test]
    fn a_displacement_alone_identifies_the_heating_and_with_three_drives_the_curvature() {
        assert_eq!(names(&measured(&[], true, 1.0)), ["R_T", "beta_b"]);
        let mut two = measured(&[], true, 1.0);
        two.observations.truncate(2);
        assert_eq!(names(&two), ["R_T"]);
    }

    #[test]
    fn one_heater_has_shared_parameters_and_may_be_slow() {
        assert_eq!(
            names(&measured(&[0], false, 1.0)),
            ["R0", "R_T", "tau_fast"]
        );
    }

    #[test]
    fn poles_take_many_readings_and_short_intervals() {
        let poles = |seconds, times: usize| {
            let mut data = measured(&[0, 1, 2, 3], true, seconds);
            data.observations = data.observations.repeat(times);
            names(&data).len() - names(&measured(&[0, 1, 2, 3], true, 1.0)).len()
        };
        // 40 readings, or 80.
        assert_eq!([poles(1e-3, 1), poles(1e-3, 2), poles(1.0, 2)], [0, 3, 0]);
    }

    #[test]
    fn cold_resistances_are_medians_of_the_quarter_at_the_lowest_drives() {
        let model = Model::from(Preset::Paper);
        let own = with_own_resistances(&model, &measured(&[1, 2], true, 1.0));
        // Two of eight readings are the quarter, 200 and 201 ohm; the upper is the median.
        let cold = |actuator: usize| own.actuator(actuator).parameters.cold_resistance_ohm;
        assert!((cold(1) - 201.0).abs() < 1e-9 && (cold(2) - 301.0).abs() < 1e-9);
        assert_eq!(cold(0), model.parameters.cold_resistance_ohm);
    }

    #[test]
    fn a_model_without_time_constants_starts_from_all_of_the_usual_ones() {
        let model = Model::from(Preset::Paper);
        let free = [Symbol::FastTime, Symbol::MiddleWeight, Symbol::MiddleTime];
        let free = free.map(BaseParameter::Shared);
        let data = measured(&[0, 1, 2, 3], true, 1e-3);
        let of = |model: &Model| free.map(|parameter| parameter.get(model));
        let starts = seeds(&model, &free, &data);
        let all: Vec<_> = starts.iter().map(of).collect();
        assert_eq!(
            all,
            TIMES.map(|(fast, weight, middle)| [fast, weight, middle])
        );
        let mut known = starts[1].clone();
        known.parameters.fast_s = 5e-3;
        assert_eq!(of(&seeds(&known, &free, &data)[0]), [5e-3, 0.3, 0.02]);
        let restarts = restarts(&known, &free, &data);
        assert_eq!(restarts.len(), TIMES.len());
        assert_eq!(of(&restarts[0]), all[0]);
    }
}
