//! The heat balance of every cell.

use super::field::{FRAME, Field, PACKAGE, PLATE};
use crate::effects::heat::LossLaw;
use crate::per_actuator::PerActuator;

/// One cell of the four beams.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Cell {
    /// One over its heat capacity (K/J).
    pub(crate) inv_capacity: PerActuator,
    /// Conductance to the next cell towards the plate; of the last cell, to the plate (W/K).
    pub(crate) to_next: PerActuator,
    /// Conductance to the air (W/K).
    pub(crate) to_air: PerActuator,
    /// What is added to it now (W/K): nothing, unless the gap matters.
    pub(crate) to_gap: PerActuator,
    /// Radiating surface (m2).
    pub(crate) surface: f64,
    /// Resistance of its piece of the heater at ambient temperature (ohm).
    pub(crate) ohm: PerActuator,
}

/// A body that the four beams share.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LumpNode {
    /// One over its heat capacity (K/J); 0 holds it at ambient.
    pub(crate) inv_capacity: f64,
    /// Conductance to the room (W/K).
    pub(crate) to_room: f64,
}

/// Conductances, capacities and heaters.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Network {
    pub(crate) cells: Vec<Cell>,
    /// Conductance from the frame to the first cell (W/K).
    pub(crate) to_frame: PerActuator,
    pub(crate) lumps: [LumpNode; 3],
    /// Conductance from the frame to the package (W/K).
    pub(crate) frame_to_package: f64,
    /// Part of the heat lost to the air that ends in the frame.
    pub(crate) air_to_frame: f64,
    /// Temperature of the air around each beam (K above ambient), beside what the frame adds.
    pub(crate) stagnant: PerActuator,
    /// How losses depart from linear ones.
    pub(crate) loss: LossLaw,
    /// Local temperature coefficient of resistance (1/K), and its corrections of higher order.
    pub(crate) tcr: PerActuator,
    pub(crate) tcr_tail: [f64; 2],
    /// Resistance in series with the heaters (ohm).
    pub(crate) leads: PerActuator,
    /// Resistance of the heaters relative to when they were new.
    pub(crate) aged: PerActuator,
    /// Ambient temperature over its first value (K); the field's temperatures count from ambient.
    pub(crate) ambient: f64,
    /// What of that was set from outside (K).
    pub(crate) ambient_set: f64,
}

impl Network {
    /// Resistance of each actuator with its leads (ohm).
    pub(crate) fn resistance(&self, at: &Field) -> PerActuator {
        let heater =
            |sum, (cell, theta): (&Cell, &PerActuator)| sum + self.ohm::<false>(cell, *theta);
        self.leads
            + self
                .cells
                .iter()
                .zip(at.beams())
                .fold(PerActuator::ZERO, heater)
                * self.aged
    }

    /// Mean temperature of each heater (K above ambient).
    pub(crate) fn heater_mean(&self, at: &Field) -> PerActuator {
        let (mut sum, mut ohm) = (PerActuator::ZERO, PerActuator::ZERO);
        for (cell, theta) in self.cells.iter().zip(at.beams()) {
            sum += cell.ohm * *theta;
            ohm += cell.ohm;
        }
        sum / ohm
    }

    /// Resistance of a cell of a heater as new.
    #[inline(always)]
    fn ohm<const LINEAR: bool>(&self, cell: &Cell, theta: PerActuator) -> PerActuator {
        let t = theta + PerActuator::splat(self.ambient);
        if LINEAR {
            return cell.ohm * (PerActuator::splat(1.0) + self.tcr * t);
        }
        let bend = PerActuator::splat(1.0)
            + t * (PerActuator::splat(self.tcr_tail[0]) + t * self.tcr_tail[1]);
        cell.ohm * (PerActuator::splat(1.0) + self.tcr * t * bend)
    }

    /// Heat that a cell loses to the air and by radiation (W).
    #[inline(always)]
    fn lost<const LINEAR: bool>(&self, cell: &Cell, theta: PerActuator) -> PerActuator {
        if LINEAR {
            return theta * cell.to_air;
        }
        let splat = PerActuator::splat;
        let ([o, p, q], [a, b, c, d]) = (self.loss.air, self.loss.radiation);
        let air = splat(1.0 + o) + theta * (splat(p) + theta * q) + self.loss.convected(theta);
        let sky = splat(a) + theta * (splat(b) + theta * (splat(c) + theta * d));
        let between = 0.25 * cell.to_air.sum() * self.loss.neighbour;
        let shared = (theta * 2.0 - theta.neighbours()) * between;
        theta * ((cell.to_air + cell.to_gap) * air + sky * cell.surface) + shared
    }

    /// How fast a cell's balance falls with its temperature at a heating of `heating` (A2), neighbouring cells left
    /// out (W/K). A heater that warms takes less current: over the whole beam that outweighs the cell's own share twice.
    pub(crate) fn restoring(
        &self,
        cell: &Cell,
        theta: PerActuator,
        heating: PerActuator,
    ) -> PerActuator {
        let splat = PerActuator::splat;
        let ([o, p, q], [a, b, c, d]) = (self.loss.air, self.loss.radiation);
        let air = splat(1.0 + o + 2.0 * self.loss.neighbour)
            + theta * (splat(2.0 * p) + theta * (3.0 * q))
            + self.loss.convected(theta) * 1.25;
        let sky =
            splat(a) + theta * (splat(2.0 * b) + theta * (splat(3.0 * c) + theta * (4.0 * d)));
        let heater = heating * cell.ohm * self.tcr;
        (cell.to_air + cell.to_gap) * air + sky * cell.surface + heater
    }

    /// Rate of change of every temperature (K/s) at `volts`.
    pub(crate) fn rate(&self, at: &Field, volts: PerActuator, rate: &mut Field) {
        if self.loss.is_linear() && self.tcr_tail == [0.0; 2] {
            self.rate_with::<true>(at, volts, rate);
        } else {
            self.rate_with::<false>(at, volts, rate);
        }
    }

    fn rate_with<const LINEAR: bool>(&self, at: &Field, volts: PerActuator, rate: &mut Field) {
        let lumps = *at.lumps();
        let n = self.cells.len();
        let (cells, theta, out) = (
            &self.cells[..n],
            &at.beams()[..n],
            &mut rate.rows_mut()[..=n],
        );

        let mut heaters = PerActuator::ZERO;
        for i in 0..n {
            out[i] = self.ohm::<LINEAR>(&cells[i], theta[i]);
            heaters += out[i];
        }
        let current = volts / (self.leads + heaters * self.aged);
        let heating = current * current * self.aged;

        let warm_air = PerActuator::splat(self.air_to_frame * lumps.0[FRAME]) + self.stagnant;
        let from_frame = self.to_frame * (PerActuator::splat(lumps.0[FRAME]) - theta[0]);
        let mut inflow = from_frame;
        let mut into_air = PerActuator::ZERO;
        for i in 0..n {
            let cell = &cells[i];
            let next = if i + 1 < n {
                theta[i + 1]
            } else {
                PerActuator::splat(lumps.0[PLATE])
            };
            let outflow = cell.to_next * (theta[i] - next);
            let heat = heating * out[i];
            let lost = self.lost::<LINEAR>(cell, theta[i]) - cell.to_air * warm_air;
            into_air += lost;
            out[i] = (inflow - outflow + heat - lost) * cell.inv_capacity;
            inflow = outflow;
        }
        let into_frame = self.air_to_frame * into_air.sum() - from_frame.sum();
        out[n] = self.lump_rates(lumps, into_frame, inflow.sum());
    }

    fn lump_rates(&self, lumps: PerActuator, into_frame: f64, into_plate: f64) -> PerActuator {
        let down = self.frame_to_package * (lumps.0[FRAME] - lumps.0[PACKAGE]);
        let gain = [into_plate, into_frame - down, down]; // in the lumps' order
        let rates: [f64; 3] = std::array::from_fn(|k| {
            (gain[k] - self.lumps[k].to_room * lumps.0[k]) * self.lumps[k].inv_capacity
        });
        PerActuator([rates[PLATE], rates[FRAME], rates[PACKAGE], 0.0])
    }
}
