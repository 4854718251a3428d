//! The model in time: four actuators on the drives of a measurement, with thermal poles and effects.

mod actuator;
mod fixed_point;
mod heat;
mod pole;
mod running;

use crate::effect::Acts;
use crate::{ACTUATORS, Deflection, Model};
use actuator::Actuator;
use running::{Running, advance, change};
use thiserror::Error;

/// A temperature rise beyond this is a runaway (K). It lies above what a resistance that grows with temperature settles at for
/// any drive of a heater on a bench, so that a model of a heater that is far too hot can still be compared and fitted: with
/// `R0 (1 + xi T) T = R_T V^2`, 1 ohm at 230 V with 1e-3 /K and the paper's `R_T` comes to 6e5 K.
const RUNAWAY_K: f64 = 1e6;

/// A piece of drive: held where both ends are equal, a straight line otherwise. What is around the mirror stands still in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Interval {
    /// How long it lasts.
    pub duration_s: f64,
    /// The drives at its start.
    pub from_v: [f64; ACTUATORS],
    /// The drives at its end.
    pub to_v: [f64; ACTUATORS],
    /// Temperature rise of the surroundings above those that the cold resistances and the displacement's zero belong to (K).
    pub ambient_k: f64,
    /// How far a stage has moved the sensor's target, the whole mirror, towards the substrate (um).
    pub reference_um: f64,
}

impl Interval {
    /// These drives held for a time, in the surroundings of rest.
    pub fn held(drive_v: [f64; ACTUATORS], duration_s: f64) -> Self {
        Self {
            duration_s,
            from_v: drive_v,
            to_v: drive_v,
            ..Self::default()
        }
    }

    /// The drives when this share of it has passed (V).
    pub fn drive_at(&self, share: f64) -> [f64; ACTUATORS] {
        std::array::from_fn(|i| self.from_v[i] + share * (self.to_v[i] - self.from_v[i]))
    }
}

/// What the model shows at the end of an interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Output {
    /// The displacement as the sensor reads it, counted from rest, with what a stage adds.
    pub z_um: f64,
    /// The displacement of each actuator, counted from rest; their mean moves the mirror's centre.
    pub actuator_z_um: [f64; ACTUATORS],
    /// The current of each actuator; 0 where it is not driven.
    pub current_a: [f64; ACTUATORS],
    /// The temperature rise of each actuator, with that of its surroundings.
    pub temperature_rise_k: [f64; ACTUATORS],
}

/// The model has no finite answer.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("the model runs away {}: {what}", self.place())]
pub struct Runaway {
    /// Time from the start of the simulation.
    pub t_s: f64,
    /// The first reading that it has no answer for, in words, where readings are known.
    pub reading: Option<String>,
    /// What became infinite, or not a number.
    pub what: String,
}

impl Runaway {
    fn place(&self) -> String {
        match &self.reading {
            Some(reading) => reading.clone(),
            None => format!("at {:.3} s", self.t_s),
        }
    }
}

/// Runs the model from rest over the intervals, one output at the end of each.
///
/// `resolution` is the longest step in units of the time since the last jump of the drive (and of the fastest pole just
/// after it): 0.3 is good to some nanometres; halving it tells how good.
///
/// # Errors
/// [`Runaway`] when something stops being finite, as a user's formula can make it.
pub fn simulate(
    model: &Model,
    intervals: &[Interval],
    resolution: f64,
) -> Result<Vec<Output>, Runaway> {
    let mut simulation = Simulation::new(model, resolution);
    intervals
        .iter()
        .map(|interval| simulation.run(interval))
        .collect()
}

fn are_equal(drives_v: &[f64; ACTUATORS]) -> bool {
    drives_v.iter().all(|drive_v| *drive_v == drives_v[0])
}

/// A model while it runs, from rest, one interval after the other.
pub struct Simulation<'a> {
    actuators: [Actuator; ACTUATORS],
    effects: Vec<Running<'a>>,
    /// How many actuators are computed: the first stands for all as long as they are alike and driven alike.
    computed: usize,
    /// Whether anything depends on where the mirror was on the way to a reading.
    way_matters: bool,
    resolution: f64,
    fastest_s: f64,
    t_s: f64,
    since_jump_s: f64,
    last_v: [f64; ACTUATORS],
    ambient_k: f64,
    reference_um: f64,
    /// Displacement of each actuator, and what it was at rest.
    actuator_z_um: [f64; ACTUATORS],
    actuator_rest_um: [f64; ACTUATORS],
    /// Displacement of the centre without sensor effects, and what it was at rest.
    centre_um: f64,
    rest_um: f64,
    reading_um: f64,
}

impl<'a> Simulation<'a> {
    /// A model at rest; for `resolution` see [`simulate`].
    pub fn new(model: &'a Model, resolution: f64) -> Self {
        let effects: Vec<Running> = model.effects.iter().map(Running::new).collect();
        let actuators =
            std::array::from_fn(|index| Actuator::new(model.actuator(index).parameters));
        let fastest_s = actuators
            .iter()
            .map(|actuator: &Actuator| actuator.taus_s[0])
            .fold(f64::INFINITY, f64::min)
            .max(1e-5);
        let alike = |actuator: &Actuator| actuator.parameters == actuators[0].parameters;
        let mut simulation = Self {
            computed: if actuators.iter().all(alike) {
                1
            } else {
                ACTUATORS
            },
            actuators,
            way_matters: effects.iter().any(Running::sees_the_way),
            effects,
            resolution,
            fastest_s,
            t_s: 0.0,
            since_jump_s: 0.0,
            last_v: [0.0; ACTUATORS],
            ambient_k: 0.0,
            reference_um: 0.0,
            actuator_z_um: [0.0; ACTUATORS],
            actuator_rest_um: [0.0; ACTUATORS],
            centre_um: 0.0,
            rest_um: 0.0,
            reading_um: 0.0,
        };
        simulation.settle_at_rest();
        simulation
    }

    /// Shape effects may move the cold mirror; z is counted from there, and no state shall see it as a step.
    fn settle_at_rest(&mut self) {
        self.heat([0.0; ACTUATORS], 0.0);
        self.shape(0.0);
        self.rest_um = self.centre_um;
        self.actuator_rest_um = self.actuator_z_um;
        self.shape(0.0);
    }

    /// Runs it over one more interval.
    ///
    /// # Errors
    /// As [`simulate`].
    pub fn run(&mut self, interval: &Interval) -> Result<Output, Runaway> {
        let mut done_s = 0.0;
        let moved =
            (self.ambient_k, self.reference_um) != (interval.ambient_k, interval.reference_um);
        if moved || interval.from_v != self.last_v {
            self.since_jump_s = 0.0;
        }
        (self.ambient_k, self.reference_um) = (interval.ambient_k, interval.reference_um);
        if ![interval.from_v, interval.to_v].iter().all(are_equal) {
            self.compute_each();
        }
        let held = interval.from_v == interval.to_v;
        while done_s < interval.duration_s {
            let left = interval.duration_s - done_s;
            let h = self.step_s(held, interval.duration_s).min(left);
            let h = if left - h < 1e-9 * interval.duration_s {
                left
            } else {
                h
            };
            let share = (done_s + h) / interval.duration_s;
            let voltage = interval.drive_at(share);
            if done_s == 0.0 {
                self.heat(interval.from_v, 0.0);
            }
            self.t_s += h;
            self.heat(voltage, h);
            done_s += h;
            if self.way_matters || done_s >= interval.duration_s {
                self.shape(h);
            }
            self.check()?;
            self.since_jump_s += h;
        }
        self.last_v = interval.to_v;
        Ok(self.output())
    }

    /// From here on each actuator is computed, and begins where the first one is.
    fn compute_each(&mut self) {
        if self.computed < ACTUATORS {
            self.actuators = self.each().map(|actuator| *actuator);
            self.computed = ACTUATORS;
            self.effects.iter_mut().for_each(Running::follow_the_first);
        }
    }

    /// The actuators, or what stands for them.
    fn each(&self) -> [&Actuator; ACTUATORS] {
        std::array::from_fn(|i| &self.actuators[if i < self.computed { i } else { 0 }])
    }

    fn step_s(&self, held: bool, interval_s: f64) -> f64 {
        if held {
            self.resolution * (self.since_jump_s + self.fastest_s)
        } else {
            interval_s * (2.0 * self.resolution).min(1.0)
        }
    }

    fn shape(&mut self, h: f64) {
        let computed = &mut self.actuators[..self.computed];
        for (index, actuator) in computed.iter_mut().enumerate() {
            let p = &actuator.parameters;
            let plain = Deflection::curvature_per_um(p, actuator.now.temperature_rise_k);
            advance(
                &mut self.effects,
                &[Acts::Curvature],
                index,
                plain,
                &actuator.now,
                h,
            );
            let curvature = change(&self.effects, Acts::Curvature, index, plain, &actuator.now);
            actuator.now.z_um = Deflection::of(p, curvature).z_um;
            advance(
                &mut self.effects,
                &[Acts::Displacement],
                index,
                actuator.now.z_um,
                &actuator.now,
                h,
            );
            self.actuator_z_um[index] = change(
                &self.effects,
                Acts::Displacement,
                index,
                actuator.now.z_um,
                &actuator.now,
            );
        }
        let (computed, others) = self.actuator_z_um.split_at_mut(self.computed);
        others.fill(computed[0]);
        let mut moment = self.actuators[0].now;
        moment.z_um = self.actuator_z_um.iter().sum::<f64>() / ACTUATORS as f64;
        advance(
            &mut self.effects,
            &[Acts::Motion],
            0,
            moment.z_um,
            &moment,
            h,
        );
        self.centre_um = change(&self.effects, Acts::Motion, 0, moment.z_um, &moment);
        let counted = self.centre_um - self.rest_um + self.reference_um;
        moment.z_um = counted;
        advance(&mut self.effects, &[Acts::Reading], 0, counted, &moment, h);
        self.reading_um = change(&self.effects, Acts::Reading, 0, counted, &moment);
    }

    fn check(&self) -> Result<(), Runaway> {
        let hot = self
            .each()
            .map(|actuator| actuator.now.temperature_rise_k)
            .into_iter()
            .find(|rise| rise.is_nan() || rise.abs() > RUNAWAY_K);
        let what = match hot {
            Some(rise) => format!("a temperature rise of {rise:.3e} K"),
            None if !self.reading_um.is_finite() => {
                format!("a displacement of {} um", self.reading_um)
            }
            None => return Ok(()),
        };
        Err(Runaway {
            t_s: self.t_s,
            reading: None,
            what,
        })
    }

    fn output(&self) -> Output {
        Output {
            z_um: self.reading_um,
            actuator_z_um: std::array::from_fn(|i| {
                self.actuator_z_um[i] - self.actuator_rest_um[i]
            }),
            current_a: self.each().map(|actuator| actuator.current_a),
            temperature_rise_k: self.each().map(|actuator| actuator.now.temperature_rise_k),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Preset;
    use crate::effect::{Active, built_in, forms};

    /// Steps of all actuators, a ramp, a pause, and drives that differ in the end.
    fn drives() -> Vec<Interval> {
        let ramp = Interval {
            from_v: [2.0; ACTUATORS],
            to_v: [0.5; ACTUATORS],
            duration_s: 0.02,
            ..Interval::default()
        };
        vec![
            Interval::held([2.0; ACTUATORS], 3e-3),
            Interval::held([2.0; ACTUATORS], 0.5),
            ramp,
            Interval::held([0.0; ACTUATORS], 0.1),
            Interval::held([1.0, 2.0, 0.0, 1.5], 2e-3),
            Interval::held([1.5; ACTUATORS], 0.3),
        ]
    }

    #[test]
    fn what_stands_for_all_goes_where_each_goes() {
        for effect in built_in().iter().flat_map(forms) {
            let mut model = Model::from(Preset::Paper);
            model.effects = vec![Active::usual(effect.clone())];
            let mut alike = Simulation::new(&model, 0.3);
            let mut each = Simulation::new(&model, 0.3);
            each.compute_each();
            for interval in drives() {
                assert_eq!(
                    alike.run(&interval).expect("finite"),
                    each.run(&interval).expect("finite"),
                    "{}",
                    effect.info().id
                );
            }
            assert_eq!(alike.computed, ACTUATORS);
        }
    }
}
