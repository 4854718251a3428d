//! A probe: one basis function of a quantity's free-form dependence on a driver, as an effect that the model can be run with.

use super::place::{Driver, Place};
use identification::dataset::Dataset;
use identification::prediction::RESOLUTION;
use mirror_model::effect::{Acts, Effect, Info, Moment, Parameter, Step};
use mirror_model::{Deflection, Model, Runaway, simulate};
use std::borrow::Cow;

/// Knots of a function of what the chain does, from 0 (exclusive) to the most that the session shows. Linear B-splines
/// between them (C. de Boor, "A Practical Guide to Splines" (1978)). As many as tell a threshold to an eighth of the range.
const KNOTS: usize = 8;
/// The same of time and history, of which a session shows less.
const FEW: usize = 4;
/// Times over which a past fades (s): from the plate's ringing to the package's warming.
const FADING_S: [f64; 5] = [1e-3, 1e-2, 0.1, 1.0, 10.0];
/// The time over which a rate is taken (s): that of the plate's ringing and damping.
const RATE_S: f64 = 1e-3;
/// Half of the play between a quantity and what follows it, in parts of its range.
const PLAYS: [f64; 3] = [0.01, 0.04, 0.16];
/// Temperatures above which exposure counts, in parts of the highest.
const EXPOSED: [f64; 3] = [0.0, 0.5, 0.8];
/// A probe of strength 1 changes its quantity by this part of its range, where the predictions are as good as linear in it.
const AMPLITUDE: f64 = 0.01;

/// How far the session drives the model: the most of each quantity.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Reach {
    pub(crate) voltage_v: f64,
    pub(crate) resistance_ohm: f64,
    pub(crate) temperature_k: f64,
    pub(crate) curvature_per_um: f64,
    pub(crate) z_um: f64,
    pub(crate) time_s: f64,
    pub(crate) power_w: f64,
}

impl Reach {
    /// Of a model on a session's drives.
    pub(crate) fn of(model: &Model, data: &Dataset) -> Result<Self, Runaway> {
        let parameters = model.actuator(0).parameters;
        let mut reach = Self {
            resistance_ohm: parameters.cold_resistance_ohm,
            time_s: data.intervals.iter().map(|i| i.duration_s).sum(),
            ..Self::default()
        };
        let outputs = simulate(model, &data.intervals, RESOLUTION)?;
        for (interval, output) in data.intervals.iter().zip(outputs) {
            let powers = interval.to_v.iter().zip(output.current_a);
            reach.power_w = reach.power_w.max(powers.map(|(v, a)| v * a).sum());
            reach.z_um = reach.z_um.max(output.z_um.abs());
            for (voltage_v, kelvin) in interval.to_v.iter().zip(output.temperature_rise_k) {
                reach.voltage_v = reach.voltage_v.max(*voltage_v);
                reach.temperature_k = reach.temperature_k.max(kelvin);
            }
        }
        reach.curvature_per_um = Deflection::curvature_per_um(&parameters, reach.temperature_k);
        Ok(reach)
    }

    /// The range of a quantity, in its unit.
    fn of_quantity(&self, acts: Acts) -> f64 {
        match acts {
            Acts::Voltage => self.voltage_v,
            Acts::Resistance => self.resistance_ohm,
            Acts::Heating | Acts::Temperature => self.temperature_k,
            Acts::Curvature => self.curvature_per_um,
            Acts::Displacement | Acts::Motion | Acts::Reading => self.z_um,
        }
    }

    /// What strength 1 of a probe at a place stands for: an amount in the quantity's unit, a part of the quantity, or of exposure a
    /// part a second.
    pub(crate) fn of_probe(&self, place: Place) -> f64 {
        match place.driver {
            Driver::Lag | Driver::Turning | Driver::Rate => AMPLITUDE,
            Driver::Exposure => AMPLITUDE / self.time_s,
            _ if place.adds() => AMPLITUDE * self.of_quantity(place.acts),
            _ => AMPLITUDE,
        }
    }

    /// The most of a driver, in its unit (of power the root of a watt, which is proportional to the drive); of a lag and of turning
    /// points there is none.
    pub(crate) fn of_driver(&self, driver: Driver) -> f64 {
        match driver {
            Driver::Voltage => self.voltage_v,
            Driver::Temperature | Driver::Peak | Driver::Exposure => self.temperature_k,
            Driver::Position | Driver::Rate => self.z_um,
            Driver::Time => self.time_s,
            Driver::OtherPower => self.power_w.sqrt(),
            Driver::Lag | Driver::Turning => 0.0,
        }
    }
}

/// How a probe makes something of its driver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Basis {
    /// A linear B-spline about a knot, 0 one spacing away; the last one stays 1 above its knot.
    Hat { knot: f64, spacing: f64, last: bool },
    /// What fades over a time (s).
    Fading { tau_s: f64 },
    /// What fades over a millisecond, in parts of a linear B-spline of the displacement (um): damping that depends on the place.
    Damped { knot: f64, spacing: f64 },
    /// What follows with a play of this on either side, in the quantity's unit.
    Following { play: f64 },
    /// The time for which it was warmer than this (K), each second counting by how much, as a part of the whole session at the
    /// highest temperature.
    Exposed {
        above_k: f64,
        top_k: f64,
        duration_s: f64,
    },
}

impl Basis {
    /// Those of a driver, from the lowest knot or the shortest time.
    pub(crate) fn all(place: Place, reach: &Reach) -> Vec<Self> {
        let most = reach.of_driver(place.driver);
        let hats = |count: usize| {
            let spacing = most / count as f64;
            let hat = |index: usize| Self::Hat {
                knot: index as f64 * spacing,
                spacing,
                last: index == count,
            };
            (1..=count).map(hat).collect()
        };
        let range = reach.of_quantity(place.acts);
        match place.driver {
            Driver::Voltage | Driver::Temperature | Driver::Position => hats(KNOTS),
            Driver::Time | Driver::OtherPower | Driver::Peak => hats(FEW),
            Driver::Exposure => EXPOSED
                .map(|part| Self::Exposed {
                    above_k: part * most,
                    top_k: most,
                    duration_s: reach.time_s,
                })
                .into(),
            Driver::Lag => FADING_S.map(|tau_s| Self::Fading { tau_s }).into(),
            Driver::Rate => {
                let spacing = reach.z_um / (FEW - 1) as f64;
                let knots = (0..FEW).map(|index| index as f64 * spacing);
                knots.map(|knot| Self::Damped { knot, spacing }).collect()
            }
            Driver::Turning => PLAYS
                .map(|part| Self::Following { play: part * range })
                .into(),
        }
    }
}

/// One basis function at a place.
pub(crate) struct Probe {
    info: Info,
    place: Place,
    basis: Basis,
    /// What strength 1 adds (in the quantity's unit); none where it multiplies the quantity.
    added: Option<f64>,
}

impl Probe {
    pub(crate) fn new(place: Place, basis: Basis, reach: &Reach) -> Self {
        let strength = Parameter {
            symbol: Cow::Borrowed("q"),
            unit: Cow::Borrowed("1"),
            start: 1.0,
            low: f64::NEG_INFINITY,
            high: f64::INFINITY,
        };
        Self {
            info: Info {
                id: Cow::Borrowed("probe"),
                title: Cow::Borrowed(""),
                stage: place.stage(),
                acts: place.acts,
                equation: Cow::Borrowed(""),
                parameters: Cow::Owned(vec![strength]),
                shows: Cow::Borrowed(""),
                separates: Cow::Borrowed(""),
                source: Cow::Borrowed(""),
            },
            place,
            basis,
            added: place.adds().then(|| reach.of_probe(place)),
        }
    }

    fn driver(&self, state: &[f64], m: &Moment) -> f64 {
        match self.place.driver {
            Driver::Voltage => m.voltage_v,
            Driver::Temperature => m.temperature_rise_k,
            Driver::Position => m.z_um,
            Driver::Time => m.t_s,
            Driver::OtherPower if self.place.acts.on_the_mirror() => m.total_power_w.sqrt(),
            Driver::OtherPower => (m.total_power_w - m.power_w).max(0.0).sqrt(),
            Driver::Peak => state[0],
            Driver::Exposure | Driver::Lag | Driver::Turning | Driver::Rate => 0.0,
        }
    }
}

impl Effect for Probe {
    fn info(&self) -> &Info {
        &self.info
    }

    fn output(&self, parameters: &[f64], input: f64, state: &[f64], moment: &Moment) -> f64 {
        let strength = parameters[0];
        let function = match self.basis {
            Basis::Fading { .. } | Basis::Following { .. } => {
                return input + strength * AMPLITUDE * (state[0] - input);
            }
            Basis::Damped { knot, spacing } => {
                let part = hat(moment.z_um, knot, spacing, false);
                return input + strength * AMPLITUDE * part * (state[0] - input);
            }
            // Where nothing is driven nothing is drawn from the supply.
            _ if self.place.acts == Acts::Voltage && input == 0.0 => return input,
            Basis::Hat {
                knot,
                spacing,
                last,
            } => hat(self.driver(state, moment), knot, spacing, last),
            Basis::Exposed {
                top_k, duration_s, ..
            } => state[0] / (top_k * duration_s),
        };
        match self.added {
            Some(added) => input + strength * added * function,
            None => input * (1.0 + strength * AMPLITUDE * function),
        }
    }

    fn looks_at_displacement(&self) -> bool {
        matches!(self.place.driver, Driver::Position | Driver::Rate)
    }

    fn states(&self) -> usize {
        let remembers = matches!(
            self.place.driver,
            Driver::Peak | Driver::Exposure | Driver::Lag | Driver::Turning | Driver::Rate
        );
        usize::from(remembers)
    }

    fn is_of_time(&self) -> bool {
        self.place.is_of_time()
    }

    fn advance(&self, _parameters: &[f64], state: &mut [f64], step: &Step) {
        let now_k = step.moment.temperature_rise_k;
        state[0] = match self.basis {
            Basis::Hat { .. } => state[0].max(now_k),
            Basis::Fading { tau_s } => step.relax(state[0], tau_s),
            Basis::Damped { .. } => step.relax(state[0], RATE_S),
            Basis::Following { play } => state[0].clamp(step.to - play, step.to + play),
            Basis::Exposed { above_k, .. } => {
                state[0] + (now_k - above_k).max(0.0) * step.duration_s
            }
        };
    }
}

/// A linear B-spline.
fn hat(at: f64, knot: f64, spacing: f64, last: bool) -> f64 {
    if last && at > knot {
        1.0
    } else {
        (1.0 - (at - knot).abs() / spacing).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hats_add_up_to_one_from_the_first_knot_on() {
        let knots = [1.0, 2.0, 3.0];
        for at in [1.0, 1.3, 2.0, 2.9, 3.0, 7.0] {
            let sum: f64 = knots
                .map(|knot| hat(at, knot, 1.0, knot == 3.0))
                .iter()
                .sum();
            assert!((sum - 1.0).abs() < 1e-12, "{sum} at {at}");
        }
        assert_eq!(hat(0.0, 1.0, 1.0, false), 0.0);
    }
}
