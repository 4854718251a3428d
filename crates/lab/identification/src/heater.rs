//! A heater on a bench, of which voltage and current are known and no displacement: of any size and material, hundreds of
//! kelvins hot.
//!
//! Its readings alone say how large it is: the cold resistance and the first rise with power come from the coolest ones,
//! the rise in all from the hottest. Fits start from there, plausible strengths of effects are counted in it, and virtual
//! mirrors are driven until they are as warm.

use crate::dataset::{Channel, Dataset};
use crate::parameter::{BaseParameter, FreeParameter, misfit_of_measured};
use crate::prediction::{predict, standardised};
use mirror_model::effect::{Active, Heater};
use mirror_model::{ACTUATORS, Model, Symbol};

/// A current tells a resistance where it is above so many standard deviations of its noise: to 5 %.
pub const TOLD: f64 = 20.0;
/// The first rise is read off where the resistance has risen by this part of its whole rise, from so many readings at least.
const FIRST: f64 = 0.25;
const FEWEST: usize = 3;
/// The hottest reading draws this part of the highest power or more: at less, noise may look like a resistance.
const POWERFUL: f64 = 0.5;
/// A resistance that does not rise is taken to rise by this part of itself: less is not seen.
const LEAST_RISE: f64 = 1e-4;
/// Time constants that fits start from: so many, evenly in ratios, from this part of the time between readings to that part
/// of the whole session. Slower ones are a straight line in it, faster ones over before the next reading.
const TIMES: usize = 5;
const SHORTEST: f64 = 0.1;
const LONGEST: f64 = 0.3;
/// Strengths that fits with an effect start from, in parts of the plausible range.
const SHARES: [f64; 6] = [1.0, 0.6, 0.3, 0.1, 0.03, 0.01];
/// How many times warmer a heater would be without the effect that it is as warm with, in such fits.
const WARMER: [f64; 4] = [1.0, 3.0, 10.0, 30.0];
/// So many of those starts, the best ones, are worth a fit.
const WORTH_FITTING: usize = 3;

/// What the readings of one actuator's heater say of it.
#[derive(Clone, Copy, Debug)]
pub struct Readings {
    /// Resistance where nothing heats it.
    pub cold_ohm: f64,
    /// Relative growth of the resistance at its first rise (1/W).
    first_per_w: f64,
    /// Relative growth of the resistance in all.
    pub growth: f64,
    /// The same above the coolest reading, which is as cold as the room or warmer.
    least_growth: f64,
    /// Power at the hottest (W).
    hottest_w: f64,
}

/// One reading: power, resistance, and the resistance's noise.
struct Point {
    power_w: f64,
    ohm: f64,
    noise_ohm: f64,
}

impl Readings {
    /// `None` where too few currents can be told from their noise.
    pub fn of(data: &Dataset, actuator: usize) -> Option<Self> {
        let points = points(data, actuator);
        let highest_w = points.last().filter(|_| points.len() >= FEWEST)?.power_w;
        // Where readings are not settled, the highest power is drawn before the heater is hot.
        let powerful = points.iter().filter(|p| p.power_w > POWERFUL * highest_w);
        let hottest = powerful.max_by(|a, b| a.ohm.total_cmp(&b.ohm))?;
        let mut coolest: Vec<f64> = points[..FEWEST].iter().map(|p| p.ohm).collect();
        coolest.sort_by(f64::total_cmp);
        let rise = hottest.ohm - coolest[FEWEST / 2];
        let warm = points
            .iter()
            .position(|p| p.ohm > coolest[FEWEST / 2] + FIRST * rise)
            .unwrap_or(points.len());
        let (cold_ohm, slope) =
            line(&points[..warm.max(FEWEST)]).unwrap_or((coolest[FEWEST / 2], 0.0));
        let growth = (hottest.ohm / cold_ohm - 1.0).max(LEAST_RISE);
        let least_growth = (hottest.ohm / coolest[FEWEST / 2] - 1.0).max(LEAST_RISE);
        let chord = growth / hottest.power_w;
        let first = slope / cold_ohm;
        Some(Self {
            cold_ohm,
            first_per_w: if first > 0.0 { first } else { chord },
            growth,
            least_growth: least_growth.min(growth),
            hottest_w: hottest.power_w,
        })
    }

    /// The same with the cold resistance that was measured.
    fn of_cold(self, model: &Model) -> Self {
        let Some(measured) = model.measured.get(&Symbol::ColdResistance) else {
            return self;
        };
        let growth = self.cold_ohm * (1.0 + self.growth) / measured.value - 1.0;
        Self {
            cold_ohm: measured.value,
            growth: growth.max(LEAST_RISE),
            least_growth: growth.max(LEAST_RISE),
            ..self
        }
    }

    /// The drive at the hottest (V).
    pub fn hottest_v(&self) -> f64 {
        (self.hottest_w * self.cold_ohm * (1.0 + self.growth)).sqrt()
    }

    fn sets(&self, model: &mut Model, actuator: usize, data: &Dataset, growth_per_w: f64) {
        let xi = model.parameters.get(Symbol::ResistanceCoefficient);
        BaseParameter::of_actuator(Symbol::ColdResistance, actuator, data)
            .set(model, self.cold_ohm);
        BaseParameter::of_actuator(Symbol::ThermalResistance, actuator, data)
            .set(model, growth_per_w / xi);
    }
}

/// By their power.
fn points(data: &Dataset, actuator: usize) -> Vec<Point> {
    let mut points: Vec<Point> = data
        .observations
        .iter()
        .filter(|o| o.channel == Channel::Current(actuator) && o.value > TOLD * o.noise)
        .map(|o| (data.drive(o)[actuator], o))
        .filter(|&(volts, _)| volts > 0.0)
        .map(|(volts, o)| Point {
            power_w: volts * o.value,
            ohm: volts / o.value,
            noise_ohm: volts / o.value * o.noise / o.value,
        })
        .collect();
    points.sort_by(|a, b| a.power_w.total_cmp(&b.power_w));
    points
}

/// Resistance at no power, and its slope: a straight line through these points, weighed by their noise. `None` where it does
/// not rise, as where readings are not settled, or leaves next to nothing at no power.
fn line(points: &[Point]) -> Option<(f64, f64)> {
    let weigh = |of: &dyn Fn(&Point) -> f64| -> f64 {
        let terms = points.iter().map(|p| of(p) / p.noise_ohm.powi(2));
        terms.sum()
    };
    let all = weigh(&|_| 1.0);
    let (power, ohm) = (weigh(&|p| p.power_w) / all, weigh(&|p| p.ohm) / all);
    let spread = weigh(&|p| (p.power_w - power).powi(2));
    let slope = weigh(&|p| (p.power_w - power) * (p.ohm - ohm)) / spread;
    let cold = ohm - slope * power;
    (slope > 0.0 && cold > 0.5 * ohm).then_some((cold, slope))
}

fn all_readings(data: &Dataset) -> impl Iterator<Item = (usize, Readings)> {
    (0..ACTUATORS).filter_map(|actuator| Some((actuator, Readings::of(data, actuator)?)))
}

/// The heater that was driven hottest, where a session shows heaters only.
pub fn hottest(data: &Dataset) -> Option<Readings> {
    data.is_of_heaters()
        .then(|| all_readings(data).map(|(_, readings)| readings))?
        .max_by(|a, b| a.growth.total_cmp(&b.growth))
}

/// The same for what effects it may have, its cold resistance as it was measured, where it was.
pub fn heater(model: &Model, data: &Dataset) -> Option<Heater> {
    let readings = hottest(data)?.of_cold(model);
    let xi = model.parameters.get(Symbol::ResistanceCoefficient);
    Some(Heater {
        cold_resistance_ohm: readings.cold_ohm,
        resistance_coefficient_per_k: xi,
        hottest_rise_k: readings.growth / xi,
        least_rise_k: readings.least_growth / xi,
        hottest_power_w: readings.hottest_w,
    })
}

/// The model with its effects in the strengths that are plausible in this session's heater. A mirror's stay as they are.
pub fn suited(model: &Model, data: &Dataset) -> Model {
    let mut suited = model.clone();
    if let Some(heater) = heater(model, data) {
        for active in &mut suited.effects {
            *active = heater.suits_active(active);
        }
    }
    suited
}

/// A heater bends nothing.
pub fn unbent(model: &Model) -> Model {
    let mut unbent = model.clone();
    unbent.parameters.set(Symbol::CurvatureCoefficient, 0.0);
    unbent.by_actuator.remove(&Symbol::CurvatureCoefficient);
    unbent
}

/// Gives a heater's model the curvature of another one, which no current depends on.
pub fn bend_as(model: &mut Model, other: &Model) {
    let symbol = Symbol::CurvatureCoefficient;
    model.parameters.set(symbol, other.parameters.get(symbol));
    match other.by_actuator.get(&symbol) {
        Some(values) => model.by_actuator.insert(symbol, *values),
        None => model.by_actuator.remove(&symbol),
    };
}

/// Where fits of a base start: as warm at the hottest as the readings are; with effects, which share in that, also as the
/// first rise has it, and as the model is.
pub fn seeds(model: &Model, data: &Dataset) -> Vec<Model> {
    let mut model = model.clone();
    if data.is_one_heater() {
        model.by_actuator.remove(&Symbol::ColdResistance);
        model.by_actuator.remove(&Symbol::ThermalResistance);
    }
    let as_warm = |growth: fn(&Readings) -> f64| {
        let mut start = model.clone();
        for (actuator, readings) in all_readings(data) {
            let readings = readings.of_cold(&start);
            readings.sets(&mut start, actuator, data, growth(&readings));
        }
        start
    };
    let mut starts = vec![as_warm(|readings| readings.growth / readings.hottest_w)];
    if !model.effects.is_empty() {
        starts.push(as_warm(|readings| readings.first_per_w));
        starts.push(model.clone());
    }
    starts
}

/// Time constants that its fits start from (s): a heater on a bench may be as slow as it likes.
pub fn times(data: &Dataset) -> [f64; TIMES] {
    let read = data.observations.iter();
    let mut steps: Vec<f64> = read
        .map(|o| data.intervals[o.interval].duration_s)
        .collect();
    let session: f64 = steps.iter().sum();
    steps.sort_by(f64::total_cmp);
    let shortest = SHORTEST * steps[steps.len() / 2];
    let ratio = (LONGEST * session / shortest).max(1.0);
    std::array::from_fn(|time| shortest * ratio.powf(time as f64 / (TIMES - 1) as f64))
}

/// Where fits with one more effect start: from the fitted base, from the first rise, and from heaters that would be warmer than
/// this one without the effect, at strengths from small to all that is plausible, those that fit best as they are; what runs
/// away comes last.
pub fn starts(fitted: &Model, actives: &[Active], data: &Dataset) -> Vec<Model> {
    let with_growth = |growth_per_w: &dyn Fn(&Readings) -> f64| {
        let mut base = fitted.clone();
        for (actuator, readings) in all_readings(data) {
            let readings = readings.of_cold(fitted);
            readings.sets(&mut base, actuator, data, growth_per_w(&readings));
        }
        base
    };
    let cool = with_growth(&|readings| readings.first_per_w);
    let warmer = WARMER.map(|times| with_growth(&|r| times * r.growth / r.hottest_w));
    let mut starts: Vec<(f64, Model)> = [fitted, &cool]
        .into_iter()
        .chain(&warmer)
        .flat_map(|base| {
            let strong = actives.iter().flat_map(strengths);
            strong.map(move |active| {
                let mut with = base.clone();
                with.effects.push(active);
                with
            })
        })
        .map(|with| (cost(&with, data), with))
        .collect();
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    starts.truncate(WORTH_FITTING);
    starts.into_iter().map(|(_, start)| start).collect()
}

/// The sum of squares that a start leaves as it is.
fn cost(start: &Model, data: &Dataset) -> f64 {
    let Ok(predicted) = predict(start, data) else {
        return f64::INFINITY;
    };
    let left = data.observations.iter().zip(predicted);
    let left = standardised(left.map(|(o, p)| o.value - p), data);
    let own = [Symbol::ColdResistance, Symbol::ThermalResistance];
    let own = own.map(|symbol| BaseParameter::of_actuator(symbol, 0, data));
    left.norm_squared() + misfit_of_measured(start, own.map(FreeParameter::Base))
}

/// The effect as it is, and with strengths up to the ends of its range.
fn strengths(active: &Active) -> Vec<Active> {
    let strength = &active.effect.info().parameters[0];
    let ends = [strength.low, strength.high];
    let ends = ends.into_iter().filter(|end| *end != 0.0);
    let spread = ends.flat_map(|end| SHARES.map(|share| share * end));
    spread
        .map(|value| {
            let mut with = active.clone();
            with.values[0] = value;
            with
        })
        .chain([active.clone()])
        .collect()
}

#[cfg(test)]
mod tests;
