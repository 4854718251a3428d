//! What no drive depends on: how far the plate may be from where it should be, and when it will be there.

use super::{Controller, turns_since_own};
use crate::CHANNELS;
use crate::design::TICK;
use crate::limits::Limits;
use crate::settling::{LONGEST, NEVER};
use crate::shape::SEGMENTS;
use crate::uncertainty::Uncertainty;
use crate::units::{Kelvin, Micrometre, Second};

impl Controller<'_> {
    /// How far the plate may be from [`Self::pose`] once it is settled, with 95 % confidence; `None` under a calibration that does not
    /// say what it leaves unknown.
    pub fn uncertainty(&self) -> Option<Uncertainty> {
        self.budget.uncertainty()
    }

    /// The lowest position of a level plate: where the surroundings alone hold the actuator that they bend most, for a heater cannot cool.
    /// 0 where they are not warmer than at calibration, or not compensated.
    pub fn lowest(&self) -> Micrometre {
        let higher =
            |lowest: Micrometre, at: &Micrometre| if at.0 > lowest.0 { *at } else { lowest };
        self.lowest.iter().fold(Micrometre(0.0), higher)
    }

    /// How long it will take until the plate has come to where it stays, to within what calibration left; 0: it is settled. `None` where
    /// no position is asked for, where the bounds hold an actuator for ever, and under a calibration that nobody has tried.
    pub fn settles_in(&self) -> Option<Second> {
        let is_asked = !self.target.z.0.is_nan() && self.budget.near().is_some();
        let longest = |longest: f32, ticks: &f32| if *ticks > longest { *ticks } else { longest };
        let arrival = self.arrivals.iter().fold(0.0, longest);
        // Its bounds hold it short of where its poles would take it.
        let is_held = arrival > 0.0 && self.since_arrival >= LONGEST;
        let path = self.path.ticks_left();
        let learning = self.surroundings.ticks_to_learn(self.since_arrival);
        let ticks = longest(path + learning, &arrival);
        (is_asked && !is_held && ticks < NEVER).then_some(Second(ticks * TICK.0))
    }

    /// Finds out what no drive depends on, [`Self::uncertainty`], [`Self::lowest`] and [`Self::settles_in`]: a piece after each step, all of it in
    /// 16, and what the four make of each other's change in 32.
    pub fn foresee(&mut self) {
        self.since_arrival = match self.path.ticks_left() > 0.0 {
            true => 0,
            false => self.since_arrival.saturating_add(1),
        };
        let (actuator, round) = (self.turn % CHANNELS, self.turn / CHANNELS);
        let state = &self.actuators[actuator].memory;
        self.budget.remember((actuator, round), &self.memory, state);
        match turns_since_own(self.turn) {
            0 => self.foresee_warmth(actuator),
            1 => self.foresee_arrival(actuator),
            2 => {
                let is_true = self.sense_limits == Limits::NONE;
                self.budget.combine(&self.plate, self.path.now(), is_true);
            }
            _ if self.surroundings.is_sharing_unknown() => {
                let warmer = self.warmer_than_level(actuator);
                self.surroundings.pass_unevenly(actuator, warmer);
            }
            _ => {}
        }
    }

    /// Just before the actuator's slow poles have their turn.
    fn foresee_warmth(&mut self, actuator: usize) {
        let shape = &self.calibration.actuators()[actuator].shape;
        let place = Micrometre(self.path.now()[actuator]);
        let asked = shape.temperature_rise(place);
        let compensation = (self.budget.ambient_ratio(), !self.is_by_voltage);
        let unknown = self.surroundings.uncertainty(actuator, asked, compensation);
        let to_come = self.actuators[actuator].unsettled(&self.heat, &self.shared);
        self.lowest[actuator] = shape.position(self.surroundings.lowest(actuator));
        let um_per_kelvin = 1.0 / shape.slope(place);
        let micrometres = |kelvin: Kelvin| Micrometre(kelvin.0 * um_per_kelvin);
        self.budget.drift(micrometres(unknown.drifted));
        self.budget.warm(
            actuator,
            [unknown.of_all, unknown.own, to_come].map(micrometres),
        );
    }

    /// How much warmer an actuator is than on a level plate at the mean height of the four.
    fn warmer_than_level(&self, actuator: usize) -> Kelvin {
        let mean = |four: &[f32; CHANNELS]| four.iter().sum::<f32>() / CHANNELS as f32;
        let places = self.path.now();
        let actuators = self.calibration.actuators();
        let kelvin_per_um = actuators[actuator]
            .shape
            .slope(Micrometre(places[actuator]));
        let within = (places[actuator] - mean(places)) * kelvin_per_um;
        if !self.is_by_voltage {
            return Kelvin(within);
        }
        // Voltages may take it beyond its table.
        let beyond: [f32; CHANNELS] = core::array::from_fn(|i| {
            let beyond = self.asked[i].0 - actuators[i].shape.knots()[SEGMENTS];
            if beyond > 0.0 { beyond } else { 0.0 }
        });
        Kelvin(within + beyond[actuator] - mean(&beyond))
    }

    fn foresee_arrival(&mut self, actuator: usize) {
        let Some(near) = self.budget.near() else {
            return;
        };
        let shape = &self.calibration.actuators()[actuator].shape;
        let place = Micrometre(self.path.target()[actuator]);
        let x = self.actuators[actuator].memory.displacement(place);
        if x.0 < -near.0 {
            // What creep and hysteresis hold up no heater brings down.
            self.arrivals[actuator] = NEVER;
            return;
        }
        let x = if x.0 > self.highest.0 {
            self.highest
        } else {
            x
        };
        let target = self
            .surroundings
            .target(actuator, shape.going_on_straight(x));
        let near = Kelvin(near.0 * shape.slope(place));
        if target.0 < -near.0 {
            // What the surroundings hold up neither.
            self.arrivals[actuator] = NEVER;
            return;
        }
        let target = Kelvin(if target.0 > 0.0 { target.0 } else { 0.0 });
        let this = &self.actuators[actuator];
        let heating = this.heating_to(target, near, &self.rails, &self.heat);
        self.heatings[actuator] = heating;
        let heatings = (heating, self.heat.shared_heating(&self.heatings));
        self.arrivals[actuator] = this.arrival(target, near, heatings, (&self.decay, &self.shared));
    }
}
