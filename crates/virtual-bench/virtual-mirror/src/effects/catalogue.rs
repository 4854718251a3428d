//! Which effects there are, and which of them a mirror has.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

macro_rules! effects {
    ($($(#[doc = $doc:literal])* $name:ident = $id:literal, $listed:literal;)*) => {
        /// A physical effect that a mirror may have.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub enum Effect {
            $($(#[doc = $doc])* #[serde(rename = $id)] $name,)*
        }

        impl Effect {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// The name that files and commands use.
            pub fn id(self) -> &'static str {
                match self {
                    $(Self::$name => $id,)*
                }
            }

            /// Whether a diagnosis has a candidate for it; what is not listed must come out unknown.
            pub fn is_listed(self) -> bool {
                match self {
                    $(Self::$name => $listed,)*
                }
            }
        }
    };
}

effects! {
    /// Air conducts better when warm: heat loss grows faster than the temperature, less so the hotter.
    HeatLossTemperature = "heat-loss-temperature", true;
    /// Radiation from both faces of the beams, with the fourth power of the absolute temperature.
    Radiation = "radiation", true;
    /// Loss to the substrate through the gap, which closes more under the plate's end of the beam.
    GapHeatLoss = "gap-heat-loss", true;
    /// The chip frame takes up part of the lost heat and warms, and the package under it: two time constants.
    SubstrateWarming = "substrate-warming", true;
    /// Neighbouring actuators exchange heat along their whole length.
    Crosstalk = "crosstalk", true;
    /// The room warms and swings while the session runs.
    AmbientDrift = "ambient-drift", true;
    /// Air and residue around each beam warm up behind it, in tenths of a second.
    ThermalLag = "thermal-lag", true;
    /// Resistivity saturates with temperature (parallel-resistor law): a quadratic term with its tail.
    QuadraticTcr = "quadratic-tcr", true;
    /// The film's temperature coefficient is below the bulk's.
    FilmTcr = "film-tcr", true;
    /// Leads and contacts in series with every heater, not two of them alike.
    SeriesResistance = "series-resistance", true;
    /// Expansion grows with temperature, saturating.
    ExpansionTemperature = "expansion-temperature", true;
    /// The aluminium yields where it gets hottest, and stays bent.
    Softening = "softening", true;
    /// The released beams are curled up by residual stress.
    InitialCurl = "initial-curl", true;
    /// Dry internal friction (Dahl): rate-independent, with rounded corners.
    Hysteresis = "hysteresis", true;
    /// Viscoelastic films: a broad spectrum of relaxation times.
    Creep = "creep", true;
    /// The plate rings.
    Resonance = "resonance", true;
    /// The sensor's zero is off.
    SensorOffset = "sensor-offset", true;
    /// The sensor's scale is off.
    SensorGain = "sensor-gain", true;
    /// A triangulating sensor's periodic error.
    SensorNonlinearity = "sensor-nonlinearity", true;
    /// The sensor's output filter, of second order.
    SensorLag = "sensor-lag", true;
    /// Heaters age: their resistance grows with time at temperature.
    HeaterAging = "heater-aging", false;
    /// The plate snaps down near the substrate and lets go later.
    Stiction = "stiction", false;
    /// The sensor looks beside the centre: tilt is read as displacement.
    SensorAbbe = "sensor-abbe", false;
    /// One actuator's bond wire has an intermittent contact.
    LooseContact = "loose-contact", false;
    /// The driven beams attract the substrate.
    ElectrostaticPull = "electrostatic-pull", true;
    /// Warm air rises: heat loss grows with the fourth root of the temperature difference.
    FreeConvection = "free-convection", true;
}

impl Effect {
    /// The id of the physics that it is a form of, which a diagnosis names: mostly its own.
    pub fn is_a(self) -> &'static str {
        match self {
            Self::FreeConvection => Self::HeatLossTemperature.id(),
            other => other.id(),
        }
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}

/// No effect has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no effect is called `{0}`")]
pub struct UnknownEffect(String);

impl FromStr for Effect {
    type Err = UnknownEffect;

    fn from_str(id: &str) -> Result<Self, UnknownEffect> {
        Self::ALL
            .iter()
            .copied()
            .find(|effect| effect.id() == id)
            .ok_or_else(|| UnknownEffect(id.to_owned()))
    }
}

/// Which effects a mirror has, and how strong.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Effects(BTreeMap<Effect, f64>);

impl Effects {
    /// An effect's strength; 0 when it is off.
    pub fn strength(&self, effect: Effect) -> f64 {
        self.0.get(&effect).copied().unwrap_or(0.0)
    }

    /// Switches an effect on (or off, with 0).
    pub fn set(&mut self, effect: Effect, strength: f64) {
        if strength == 0.0 {
            self.0.remove(&effect);
        } else {
            self.0.insert(effect, strength);
        }
    }

    /// The effects that are on.
    pub fn iter(&self) -> impl Iterator<Item = (Effect, f64)> {
        self.0.iter().map(|(effect, strength)| (*effect, *strength))
    }

    /// Whether nothing is switched on.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// `Some(strength)` of an effect that is on.
    pub(crate) fn active(&self, effect: Effect) -> Option<f64> {
        self.0
            .get(&effect)
            .copied()
            .filter(|strength| *strength != 0.0)
    }
}
