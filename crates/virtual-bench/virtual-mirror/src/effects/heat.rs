//! What changes between heat and temperature: losses that are not linear, and neighbours.

use super::catalogue::{Effect, Effects};
use crate::per_actuator::PerActuator;

/// Stefan-Boltzmann constant (W/(m2 K4)), CODATA 2018.
const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;

/// Temperature difference that free convection's strength is counted at (K).
const CONVECTION_K: f64 = 100.0;

/// How the loss departs from being proportional to the temperature.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LossLaw {
    /// Loss to the air is `g t (1 + o + t (p + q t))`.
    pub(crate) air: [f64; 3],
    /// Radiation is its area's share times `t (a + t (b + t (c + t d)))`.
    pub(crate) radiation: [f64; 4],
    /// Part of the loss to the air that free convection adds at `CONVECTION_K`.
    pub(crate) convection: f64,
    /// Exchange with each neighbour, as a part of the loss to the air.
    pub(crate) neighbour: f64,
    /// The gap between beam and substrate matters.
    gap: bool,
}

impl LossLaw {
    /// What free convection makes of a beam's coefficient of loss, in parts of the linear one: laminar, Nu as Ra^(1/4).
    pub(crate) fn convected(&self, theta: PerActuator) -> PerActuator {
        if self.convection == 0.0 {
            return PerActuator::ZERO;
        }
        theta.map(|kelvin| (kelvin.abs() / CONVECTION_K).sqrt().sqrt()) * self.convection
    }

    /// Whether it departs from nothing but a conductance to the air.
    pub(crate) fn is_linear(&self) -> bool {
        *self == Self::default()
    }

    /// The law in a room at `ambient_c`, `rise_k` above the one where the beams' loss to the air belongs.
    pub(crate) fn new(effects: &Effects, ambient_c: f64, rise_k: f64) -> Self {
        let warm = effects.strength(Effect::HeatLossTemperature);
        // Air conducts 26.3 mW/(m K) at 300 K, 30.0 at 350 K and 33.8 at 400 K (Incropera and DeWitt, Fundamentals of
        // Heat and Mass Transfer, table A.4): 2.9e-3/K at first, and the growth declines.
        let (p, q) = (3.0e-3 * warm, -2.0e-6 * warm);
        let room = ambient_c + 273.15;
        // (room + t)^4 - room^4; an emissivity of 0.7 is that of oxide much thicker than these films: an upper bound.
        let emission = 0.7 * STEFAN_BOLTZMANN * effects.strength(Effect::Radiation);
        Self {
            // The air's conductance from room to beam: u + p u^2 + q u^3 between the two, u counted from the first room.
            air: [
                rise_k * (2.0 * p + 3.0 * q * rise_k),
                p + 3.0 * q * rise_k,
                q,
            ],
            radiation: [4.0 * room.powi(3), 6.0 * room.powi(2), 4.0 * room, 1.0]
                .map(|c| emission * c),
            convection: 0.3 * effects.strength(Effect::FreeConvection),
            neighbour: 0.08 * effects.strength(Effect::Crosstalk),
            gap: effects.active(Effect::GapHeatLoss).is_some(),
        }
    }
}

/// Loss through the closing gap.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gap {
    /// Part of the air loss that goes down when the gap is open.
    part: f64,
}

impl Gap {
    /// Height of the open gap (m): the rest height of the paper's plate, 220 um, and a recess under it.
    const OPEN: f64 = 300e-6;

    pub(crate) fn new(effects: &Effects) -> Option<Self> {
        effects.active(Effect::GapHeatLoss).map(|strength| Self {
            part: 0.15 * strength,
        })
    }

    /// By what factor the air loss of a cell grows when the beam's end has moved down by `end` (m); `along` is the
    /// cell's place, 0 at the substrate and 1 at the plate.
    pub(crate) fn growth(&self, end: PerActuator, along: f64) -> PerActuator {
        let closed = end.map(|end| (end * along / Self::OPEN).clamp(-0.5, 0.85));
        PerActuator::splat(1.0) + (closed / (PerActuator::splat(1.0) - closed)) * self.part
    }
}

/// Room temperature over its first value (K), `time` seconds into the session.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AmbientDrift {
    strength: f64,
}

impl AmbientDrift {
    pub(crate) fn new(effects: &Effects) -> Option<Self> {
        effects
            .active(Effect::AmbientDrift)
            .map(|strength| Self { strength })
    }

    /// A room that warms by 1.2 K towards a new level, in 5 minutes, while its heating swings by 0.2 K every 190 s: about
    /// once in a session.
    pub(crate) fn kelvin(&self, time: f64) -> f64 {
        let warming = 1.2 * (1.0 - (-time / 300.0).exp());
        self.strength * (warming + 0.2 * (std::f64::consts::TAU * time / 190.0).sin())
    }
}

/// Air and residue around each beam, which warm up behind it and take some of its cooling away.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stagnant {
    /// How warm it gets, as a part of the beam's mean temperature.
    part: f64,
}

impl Stagnant {
    /// Time constant (s): between the beams' own milliseconds and the package's seconds.
    const TAU: f64 = 0.15;

    pub(crate) fn new(effects: &Effects) -> Option<Self> {
        effects.active(Effect::ThermalLag).map(|strength| Self {
            part: (0.12 * strength).min(0.6),
        })
    }

    /// Its temperature (K above ambient), now at `kelvin`, after `h` more seconds around beams of this mean temperature.
    pub(crate) fn advanced(&self, kelvin: PerActuator, mean: PerActuator, h: f64) -> PerActuator {
        let come = 1.0 - (-h / Self::TAU).exp();
        kelvin + (mean * self.part - kelvin) * come
    }
}
