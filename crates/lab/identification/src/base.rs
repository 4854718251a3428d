//! The parameters of eqs. 3-9 and of the thermal poles that a session can identify, as a vector to fit.

use crate::heater;
use crate::plan::{Channel, Plan};
use mirror_model::{ACTUATORS, Model, Symbol};

/// A parameter that is fitted: one that the actuators share, or one actuator's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Free {
    /// The same in all actuators.
    Shared(Symbol),
    /// One actuator's.
    Own(Symbol, usize),
}

impl Free {
    /// Its name for people: `R0`, or `R0.1` for the first actuator's.
    pub fn name(self) -> String {
        match self {
            Self::Shared(symbol) => symbol.to_string(),
            Self::Own(symbol, actuator) => format!("{symbol}.{}", actuator + 1),
        }
    }

    /// Which parameter it is.
    pub fn symbol(self) -> Symbol {
        match self {
            Self::Shared(symbol) | Self::Own(symbol, _) => symbol,
        }
    }

    /// Its value in a model.
    pub fn get(self, model: &Model) -> f64 {
        match self {
            Self::Shared(symbol) => model.parameters.get(symbol),
            Self::Own(symbol, actuator) => model.actuator(actuator).parameters.get(symbol),
        }
    }

    /// Changes it in a model.
    pub fn set(self, model: &mut Model, value: f64) {
        match self {
            Self::Shared(symbol) => model.parameters.set(symbol, value),
            Self::Own(symbol, actuator) => {
                let shared = model.parameters.get(symbol);
                model
                    .by_actuator
                    .entry(symbol)
                    .or_insert([shared; ACTUATORS])[actuator] = value;
            }
        }
    }

    /// Lowest and highest value that a fit may reach.
    pub fn range(self) -> (f64, f64) {
        let (low, high) = self.symbol().entry().range;
        match self.symbol() {
            Symbol::FastTime | Symbol::SlowTime => (1e-6, high),
            // Beams and plate follow within that; what is slower is the chip or the films, and worth a name.
            Symbol::MiddleTime => (1e-6, 0.3),
            Symbol::MiddleWeight | Symbol::SlowWeight => (1e-4, 0.8),
            _ => (low, high),
        }
    }
}

/// What this session can identify. Without currents nothing is known of the actuators' heaters, without a displacement
/// nothing of their bending; a session of steady points only says nothing of time constants. A heater on a bench may be as
/// slow as it likes.
pub fn identifiable(plan: &Plan) -> Vec<Free> {
    let mut free = Vec::new();
    let measured = |actuator| {
        plan.observations
            .iter()
            .any(|o| o.channel == Channel::Current(actuator))
    };
    if plan.is_one_heater() {
        free.extend([Symbol::ColdResistance, Symbol::ThermalResistance].map(Free::Shared));
    } else if plan.has_current() {
        for symbol in [Symbol::ColdResistance, Symbol::ThermalResistance] {
            free.extend(
                (0..ACTUATORS)
                    .filter(|&a| measured(a))
                    .map(|a| Free::Own(symbol, a)),
            );
        }
    } else {
        free.push(Free::Shared(Symbol::ThermalResistance));
    }
    if plan.has_displacement() && (plan.has_current() || distinct_drives(plan) > 2) {
        free.push(Free::Shared(Symbol::CurvatureCoefficient));
    }
    let fastest = plan
        .intervals
        .iter()
        .map(|i| i.duration_s)
        .fold(f64::INFINITY, f64::min);
    let transient = plan.observations.len() > 50;
    if transient && fastest < 0.01 {
        free.extend([Symbol::FastTime, Symbol::MiddleWeight, Symbol::MiddleTime].map(Free::Shared));
    } else if plan.is_of_heaters() {
        free.push(Free::Shared(Symbol::FastTime));
    }
    free
}

/// An actuator's own parameter, or that of the one heater which all of them stand for.
pub fn own(symbol: Symbol, actuator: usize, plan: &Plan) -> Free {
    if plan.is_one_heater() {
        Free::Shared(symbol)
    } else {
        Free::Own(symbol, actuator)
    }
}

/// The median of V/I over the smaller half of the drives that a current can be told from its noise at.
fn coldest_resistance(plan: &Plan, actuator: usize) -> Option<f64> {
    let readings = plan
        .observations
        .iter()
        .filter(|o| o.channel == Channel::Current(actuator) && o.value > 20.0 * o.noise)
        .filter(|o| plan.intervals[o.interval].ambient_k == 0.0);
    let mut pairs: Vec<(f64, f64)> = readings
        .map(|o| (plan.drive(o)[actuator], o.value))
        .filter(|&(v, _)| v > 0.0)
        .collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut ohms: Vec<f64> = pairs
        .iter()
        .take(pairs.len().div_ceil(4))
        .map(|(v, i)| v / i)
        .collect();
    ohms.sort_by(f64::total_cmp);
    ohms.get(ohms.len() / 2).copied()
}

fn distinct_drives(plan: &Plan) -> usize {
    let mut drives: Vec<_> = plan
        .observations
        .iter()
        .map(|o| (plan.drive(o)[0] * 1e3) as i64)
        .filter(|&mv| mv > 0)
        .collect();
    drives.sort_unstable();
    drives.dedup();
    drives.len()
}

/// Fast time (s), weight and time (s) of the middle pole that fits start from: mirrors differ in them by orders of magnitude,
/// and a fit that starts far off stays there.
const TIMES: [(f64, f64, f64); 3] = [(8e-3, 0.2, 0.04), (2e-3, 0.3, 0.02), (0.02, 0.3, 0.2)];

/// Where fits start: usual sizes for the time constants that the model leaves at 0, and cold resistances read off the
/// smallest drives, since heaters differ by orders of magnitude.
pub fn seeds(model: &Model, free: &[Free], plan: &Plan) -> Vec<Model> {
    let timeless =
        |symbol| free.contains(&Free::Shared(symbol)) && Free::Shared(symbol).get(model) <= 0.0;
    let times = match (timeless(Symbol::FastTime), timeless(Symbol::MiddleTime)) {
        (true, true) => TIMES.to_vec(),
        (true, false) if plan.is_of_heaters() => heater::times(plan)
            .map(|fast_s| (fast_s, 0.0, 0.0))
            .to_vec(),
        _ => vec![TIMES[0]],
    };
    let models = if plan.is_of_heaters() {
        heater::seeds(model, plan)
    } else {
        vec![with_own_resistances(model, plan)]
    };
    models
        .iter()
        .flat_map(|model| times.iter().map(|&times| seed(model, free, times)))
        .collect()
}

/// A fitted model with each of the sets of time constants that fits start from: the best fit without an effect may lie far
/// from the best one with it.
pub fn restarts(fitted: &Model, free: &[Free]) -> Vec<Model> {
    TIMES
        .iter()
        .map(|&times| {
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

fn usual(symbol: Symbol, (fast_s, weight, middle_s): (f64, f64, f64)) -> Option<f64> {
    match symbol {
        Symbol::FastTime => Some(fast_s),
        Symbol::MiddleWeight => Some(weight),
        Symbol::MiddleTime => Some(middle_s),
        _ => None,
    }
}

/// The model with the cold resistances that can be read off these numbers.
pub fn with_own_resistances(model: &Model, plan: &Plan) -> Model {
    let mut model = model.clone();
    for actuator in 0..ACTUATORS {
        if let Some(ohm) = coldest_resistance(plan, actuator) {
            own(Symbol::ColdResistance, actuator, plan).set(&mut model, ohm);
        }
    }
    model
}

fn seed(model: &Model, free: &[Free], times: (f64, f64, f64)) -> Model {
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
