//! Heat in lumps: a heater and a beam.

use crate::config::Factors;

/// Resistance of a heater in the room of reference (ohm), and its coefficient (1/K): a platinum film's.
const COLD_OHM: f64 = 330.0;
const TCR_PER_K: f64 = 0.003;
/// Heat that a kelvin takes to the beam, from there to the substrate, and to the air from either at 100 K (W/K): 20 mW warm the beam
/// by some 100 K, and half of them go to the air. A film heater lies on less than a micrometre of oxide, which would take 1e-2 W/K; that
/// it takes a few kelvins more than the beam's mean is its place on it.
const TO_BEAM: f64 = 2e-3;
const TO_SUBSTRATE: f64 = 0.9e-4;
const HEATER_TO_AIR: f64 = 0.3e-4;
const BEAM_TO_AIR: f64 = 0.8e-4;
/// Heat capacities (J/K): 0.5 ms and 10 ms.
const HEATER_CAPACITY: f64 = 1e-6;
const BEAM_CAPACITY: f64 = 1.2e-6;

/// Free convection: the heat transfer grows with the fourth root of the temperature difference (laminar flow; Incropera,
/// Fundamentals of Heat and Mass Transfer, eq. 9.24).
fn convection(at_100_k: f64, warmer_k: f64) -> f64 {
    at_100_k * warmer_k * (warmer_k.abs() / 100.0).sqrt().sqrt()
}

/// The numbers of one actuator.
#[derive(Clone, Debug)]
pub(crate) struct Heating {
    cold_ohm: f64,
    lead_ohm: f64,
    /// Factor on all that the air takes.
    air: f64,
    heater_capacity: f64,
    beam_capacity: f64,
}

/// Temperatures above the room (K).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Nodes {
    pub(crate) heater_k: f64,
    pub(crate) beam_k: f64,
}

/// What is around an actuator.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Around {
    /// How much warmer the room is than that of reference (K).
    pub(crate) room_k: f64,
    /// How much warmer than the room the substrate is (K).
    pub(crate) substrate_k: f64,
    /// Factor on all that the air takes.
    pub(crate) air: f64,
}

impl Heating {
    pub(crate) fn new(factors: &Factors, lead_ohm: f64, slowness: f64) -> Self {
        Self {
            cold_ohm: COLD_OHM * factors.ohm,
            lead_ohm,
            air: factors.loss,
            heater_capacity: HEATER_CAPACITY * slowness,
            beam_capacity: BEAM_CAPACITY * slowness,
        }
    }

    fn heater_ohm(&self, nodes: &Nodes, around: &Around) -> f64 {
        self.cold_ohm * (1.0 + TCR_PER_K * (nodes.heater_k + around.room_k))
    }

    /// The current at this voltage (A).
    pub(crate) fn current_a(&self, volts: f64, nodes: &Nodes, around: &Around) -> f64 {
        volts / (self.heater_ohm(nodes, around) + self.lead_ohm)
    }

    /// Heat that the substrate takes (W).
    pub(crate) fn to_substrate_w(nodes: &Nodes, around: &Around) -> f64 {
        TO_SUBSTRATE * (nodes.beam_k - around.substrate_k)
    }

    /// How fast the nodes warm (K/s).
    fn rates(&self, volts: f64, nodes: &Nodes, around: &Around) -> Nodes {
        let current_a = self.current_a(volts, nodes, around);
        let power_w = current_a * current_a * self.heater_ohm(nodes, around);
        let to_beam_w = TO_BEAM * (nodes.heater_k - nodes.beam_k);
        let air = self.air * around.air;
        let heater_w = power_w - to_beam_w - air * convection(HEATER_TO_AIR, nodes.heater_k);
        let beam_w = to_beam_w
            - Self::to_substrate_w(nodes, around)
            - air * convection(BEAM_TO_AIR, nodes.beam_k);
        Nodes {
            heater_k: heater_w / self.heater_capacity,
            beam_k: beam_w / self.beam_capacity,
        }
    }

    /// So many seconds at this voltage, by the classical method of Runge and Kutta.
    pub(crate) fn advance(&self, nodes: &mut Nodes, volts: f64, around: &Around, seconds: f64) {
        let along = |rates: Nodes, seconds: f64| Nodes {
            heater_k: nodes.heater_k + seconds * rates.heater_k,
            beam_k: nodes.beam_k + seconds * rates.beam_k,
        };
        let first = self.rates(volts, nodes, around);
        let second = self.rates(volts, &along(first, 0.5 * seconds), around);
        let third = self.rates(volts, &along(second, 0.5 * seconds), around);
        let fourth = self.rates(volts, &along(third, seconds), around);
        let mean = |of: fn(Nodes) -> f64| {
            (of(first) + 2.0 * of(second) + 2.0 * of(third) + of(fourth)) / 6.0
        };
        let rates = Nodes {
            heater_k: mean(|nodes| nodes.heater_k),
            beam_k: mean(|nodes| nodes.beam_k),
        };
        *nodes = along(rates, seconds);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALONE: Around = Around {
        room_k: 0.0,
        substrate_k: 0.0,
        air: 1.0,
    };

    fn heating() -> Heating {
        let factors = Factors {
            ohm: 1.0,
            loss: 1.0,
            bend: 1.0,
        };
        Heating::new(&factors, 10.0, 1.0)
    }

    /// At rest what the heater takes up is what air and substrate take away, and at 100 K that is known by hand.
    #[test]
    fn at_rest_the_beam_passes_on_what_it_gets() {
        let (heating, mut nodes) = (heating(), Nodes::default());
        for _ in 0..200_000 {
            heating.advance(&mut nodes, 2.8, &ALONE, 1e-5);
        }
        let current_a = heating.current_a(2.8, &nodes, &ALONE);
        let heater_w = current_a * (2.8 - 10.0 * current_a);
        let lost_w = Heating::to_substrate_w(&nodes, &ALONE)
            + convection(BEAM_TO_AIR, nodes.beam_k)
            + convection(HEATER_TO_AIR, nodes.heater_k);
        assert!((heater_w - lost_w).abs() < 1e-12, "{heater_w} and {lost_w}");
        assert!((convection(BEAM_TO_AIR, 100.0) - 8e-3).abs() < 1e-15);
        assert!((convection(BEAM_TO_AIR, 1600.0) - 16.0 * 2.0 * 8e-3).abs() < 1e-12);
    }

    /// The step is short enough: a quarter of it changes a fast mirror's warming by less than a millikelvin, 1.3 nm.
    #[test]
    fn the_steps_of_the_mirror_are_short_enough() {
        let factors = Factors {
            ohm: 1.0,
            loss: 1.0,
            bend: 1.0,
        };
        let fast = Heating::new(&factors, 10.0, 0.1);
        let warmed = |steps: u32| {
            let mut nodes = Nodes::default();
            for _ in 0..steps {
                fast.advance(&mut nodes, 3.0, &ALONE, 2e-3 / f64::from(steps));
            }
            nodes.beam_k
        };
        let mirror_steps = (2e-3 / crate::mirror::STEP_S).round() as u32;
        assert!((warmed(mirror_steps) - warmed(4 * mirror_steps)).abs() < 1e-3);
    }
}
