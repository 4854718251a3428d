//! The heat balance of every cell.

use super::{FRAME, Field, PACKAGE, PLATE};
use crate::lanes::Lanes;

/// One cell of the four beams.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Cell {
    /// One over its heat capacity (K/J).
    pub(crate) inv_capacity: Lanes,
    /// Conductance to the next cell towards the plate; of the last cell, to the plate (W/K).
    pub(crate) to_next: Lanes,
    /// Conductance to the air (W/K).
    pub(crate) to_air: Lanes,
    /// Resistance of its piece of the heater at ambient temperature (ohm).
    pub(crate) ohm: Lanes,
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
    pub(crate) to_frame: Lanes,
    pub(crate) lumps: [LumpNode; 3],
    /// Conductance from the frame to the package (W/K).
    pub(crate) frame_to_package: f64,
    /// Local temperature coefficient of resistance (1/K).
    pub(crate) tcr: Lanes,
}

impl Network {
    /// Resistance of each heater (ohm).
    pub(crate) fn resistance(&self, at: &Field) -> Lanes {
        self.cells
            .iter()
            .zip(at.beams())
            .fold(Lanes::ZERO, |sum, (cell, theta)| {
                sum + self.ohm(cell, *theta)
            })
    }

    #[inline(always)]
    fn ohm(&self, cell: &Cell, theta: Lanes) -> Lanes {
        cell.ohm + cell.ohm * self.tcr * theta
    }

    /// Rate of change of every temperature (K/s) at `volts`.
    pub(crate) fn rate(&self, at: &Field, volts: Lanes, rate: &mut Field) {
        let current = volts / self.resistance(at);
        let heating = current * current;
        let lumps = *at.lumps();
        let theta = at.beams();
        let n = self.cells.len();
        let (cells, theta, out) = (&self.cells[..n], &theta[..n], &mut rate.rows_mut()[..=n]);

        let from_frame = self.to_frame * (Lanes::splat(lumps.0[FRAME]) - theta[0]);
        let mut inflow = from_frame;
        for i in 0..n {
            let cell = &cells[i];
            let next = if i + 1 < n {
                theta[i + 1]
            } else {
                Lanes::splat(lumps.0[PLATE])
            };
            let outflow = cell.to_next * (theta[i] - next);
            let heat = heating * self.ohm(cell, theta[i]);
            out[i] = (inflow - outflow + heat - cell.to_air * theta[i]) * cell.inv_capacity;
            inflow = outflow;
        }
        out[n] = self.lump_rates(lumps, from_frame.sum(), inflow.sum());
    }

    fn lump_rates(&self, lumps: Lanes, out_of_frame: f64, into_plate: f64) -> Lanes {
        let down = self.frame_to_package * (lumps.0[FRAME] - lumps.0[PACKAGE]);
        let gain = [into_plate, -out_of_frame - down, down]; // in the lumps' order
        let rates: [f64; 3] = std::array::from_fn(|k| {
            (gain[k] - self.lumps[k].to_room * lumps.0[k]) * self.lumps[k].inv_capacity
        });
        Lanes([rates[PLATE], rates[FRAME], rates[PACKAGE], 0.0])
    }
}
