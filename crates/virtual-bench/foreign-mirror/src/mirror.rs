//! Four actuators under a plate.

use crate::config::ForeignConfig;
use crate::heat::{Around, Heating, Nodes};
use crate::memory::{Creep, Friction};
use crate::ringing::Ringing;

/// Longest step (s): an eighth of the fastest heater's time, and a 25th of the fastest resonance's period.
pub(crate) const STEP_S: f64 = 12.5e-6;
/// A lever's length (um), the angle at which it lies cold, and what a kelvin of its beam turns it by (rad): 100 K lower the plate by
/// 130 um.
const LEVER_UM: f64 = 600.0;
const COLD_RAD: f64 = 0.3;
const RAD_PER_K: f64 = 2.2e-3;
/// The angle over which friction's part is counted (rad): that of 125 K.
const SPAN_RAD: f64 = 0.275;
/// Part of the lever that lies under the heater.
const UNDER_HEATER: f64 = 0.25;
/// Where the levers hold the plate, from its centre (um).
const HOLD_UM: f64 = 500.0;
/// How much faster than the piston the tilts ring.
const TILTS_FASTER: f64 = 1.4;
/// Temperature of the room of reference (degC).
const REFERENCE_C: f64 = 22.0;
/// The substrate's heat capacity (J/K), and what a kelvin of it passes on (W/K): it warms by some 4 K under all four, in 8 s.
const SUBSTRATE_CAPACITY: f64 = 0.08;
const SUBSTRATE_LOSS: f64 = 0.01;

#[derive(Clone, Debug)]
struct Lever {
    heating: Heating,
    nodes: Nodes,
    rad_per_k: f64,
    friction: Friction,
    creep: Creep,
}

impl Lever {
    /// How far its end has moved (um) after so many seconds at this voltage.
    fn follow(&mut self, volts: f64, around: &Around, seconds: f64) -> f64 {
        self.heating
            .advance(&mut self.nodes, volts, around, seconds);
        let Nodes { heater_k, beam_k } = self.nodes;
        let mean_k = UNDER_HEATER * heater_k + (1.0 - UNDER_HEATER) * beam_k + around.room_k;
        let there = self.friction.follow(self.rad_per_k * mean_k);
        let turned = self.creep.follow(there, seconds);
        LEVER_UM * (COLD_RAD.sin() - (COLD_RAD - turned).sin())
    }
}

/// A mirror being driven.
#[derive(Clone, Debug)]
pub struct ForeignMirror {
    levers: [Lever; 4],
    around: Around,
    /// Piston, and the two tilts as the difference of opposite levers (um), where the plate has inertia.
    coordinates: Option<[Ringing; 3]>,
    now_um: [f64; 3],
    volts: [f64; 4],
}

impl ForeignMirror {
    /// A mirror at rest.
    pub fn new(config: &ForeignConfig) -> Self {
        let (factors, creep_s) = config.drawn();
        let lever = |i: usize| Lever {
            heating: Heating::new(&factors[i], config.lead_ohm, config.slowness),
            nodes: Nodes::default(),
            rad_per_k: RAD_PER_K * factors[i].bend,
            friction: Friction::new(config.friction, SPAN_RAD),
            creep: Creep::new(config.creep, creep_s),
        };
        let ringing = |faster: f64| Ringing::new(faster * config.resonance_hz, config.quality);
        Self {
            levers: std::array::from_fn(lever),
            around: Around {
                room_k: 0.0,
                substrate_k: 0.0,
                air: 1.0,
            },
            coordinates: Some([1.0, TILTS_FASTER, TILTS_FASTER].map(ringing)),
            now_um: [0.0; 3],
            volts: [0.0; 4],
        }
    }

    /// So many seconds (s) at four voltages (V); one that is no number is 0 V.
    pub fn step(&mut self, volts: [f64; 4], seconds: f64) {
        self.volts = volts.map(|volts| if volts.is_finite() { volts } else { 0.0 });
        let steps = (seconds / STEP_S - 1e-9).ceil().max(0.0);
        for _ in 0..steps as u64 {
            self.advance(seconds / steps);
        }
    }

    fn advance(&mut self, seconds: f64) {
        let (volts, around) = (self.volts, self.around);
        let mut levers = self.levers.iter_mut().zip(volts);
        let ends_um: [f64; 4] = std::array::from_fn(|_| {
            levers
                .next()
                .map_or(0.0, |(lever, volts)| lever.follow(volts, &around, seconds))
        });
        let [right, upper, left, lower] = ends_um;
        let rest_um = [
            0.25 * ends_um.iter().sum::<f64>(),
            upper - lower,
            right - left,
        ];
        self.now_um = match &mut self.coordinates {
            None => rest_um,
            Some(coordinates) => {
                std::array::from_fn(|i| coordinates[i].follow(rest_um[i], seconds))
            }
        };
        let levers = self.levers.iter();
        let gained_w: f64 = levers
            .map(|lever| Heating::to_substrate_w(&lever.nodes, &around))
            .sum();
        let kept_w = gained_w - SUBSTRATE_LOSS * around.substrate_k;
        self.around.substrate_k += kept_w / SUBSTRATE_CAPACITY * seconds;
    }

    /// The room is so much warmer than that of reference from now on (K).
    pub fn set_ambient(&mut self, rise_k: f64) {
        self.around.room_k = rise_k;
    }

    /// The air takes so many times the heat from now on.
    pub fn set_air_loss(&mut self, factor: f64) {
        self.around.air = factor;
    }

    /// Displacement of the plate's centre from where it was in the room of reference at rest, towards the substrate (um).
    pub fn z_um(&self) -> f64 {
        self.now_um[0]
    }

    /// Tilts about the x and the y axis (deg): positive where the +y and the +x edge is nearer to the substrate.
    pub fn tilts_deg(&self) -> [f64; 2] {
        let [_, x, y] = self.now_um;
        [x, y].map(|apart_um| (apart_um / (2.0 * HOLD_UM)).atan().to_degrees())
    }

    /// The four currents (A).
    pub fn current_a(&self) -> [f64; 4] {
        std::array::from_fn(|i| {
            let lever = &self.levers[i];
            lever
                .heating
                .current_a(self.volts[i], &lever.nodes, &self.around)
        })
    }

    /// Temperature of the room (degC).
    pub fn ambient_c(&self) -> f64 {
        REFERENCE_C + self.around.room_k
    }

    /// How much warmer than the room each heater is (K).
    pub fn heater_k(&self) -> [f64; 4] {
        self.levers.each_ref().map(|lever| lever.nodes.heater_k)
    }

    /// The same mirror without its inertia: it is at once where its levers hold it.
    pub fn without_inertia(mut self) -> Self {
        self.coordinates = None;
        self
    }
}
