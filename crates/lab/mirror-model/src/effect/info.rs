//! What an effect says of itself: its stage, what it changes, its parameters.

use std::borrow::Cow;
use std::fmt;

/// The stage of the chain that an effect belongs to, in the project's vocabulary.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Between the driver and the heater.
    Drive,
    /// The heater's resistance.
    Resistance,
    /// From power to temperature.
    Heat,
    /// From temperature to curvature.
    Curvature,
    /// From curvature to displacement.
    Shape,
    /// What the displacement remembers.
    Memory,
    /// Moving mass.
    Motion,
    /// What reads the displacement.
    Sensor,
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Drive => "drive",
            Self::Resistance => "resistance",
            Self::Heat => "heat",
            Self::Curvature => "curvature",
            Self::Shape => "shape",
            Self::Memory => "memory",
            Self::Motion => "motion",
            Self::Sensor => "sensor",
        })
    }
}

/// The quantity that an effect changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Acts {
    /// The voltage at one heater (V).
    Voltage,
    /// The resistance of one heater (ohm).
    Resistance,
    /// The temperature rise that one heater's power would make in the end, R_T P (K).
    Heating,
    /// The temperature rise of one actuator (K).
    Temperature,
    /// The curvature of one actuator (1/um).
    Curvature,
    /// The displacement of one actuator (um).
    Displacement,
    /// The displacement of the mirror's centre (um).
    Motion,
    /// The displacement as the sensor reads it (um).
    Reading,
}

impl Acts {
    /// Whether it is a quantity of the whole mirror rather than of each actuator.
    pub fn on_the_mirror(self) -> bool {
        matches!(self, Self::Motion | Self::Reading)
    }
}

/// What a parameter is in a session's time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Timing {
    /// A period (s); the next parameter is the phase (rad).
    Period,
    /// When it begins (s).
    Onset,
}

/// What is known of an effect, for people and for the fit.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Info {
    /// Its name in commands and files.
    pub id: Cow<'static, str>,
    /// What it is, in a few words.
    pub title: Cow<'static, str>,
    /// Where in the chain it belongs.
    pub stage: Stage,
    /// What it changes.
    pub acts: Acts,
    /// Its equation; `'` marks the changed quantity.
    pub equation: Cow<'static, str>,
    /// Its parameters, the strength first.
    pub parameters: Cow<'static, [Parameter]>,
    /// How it shows in measurements.
    pub shows: Cow<'static, str>,
    /// What separates it from its look-alikes.
    pub separates: Cow<'static, str>,
    /// Where its size and form come from.
    pub source: Cow<'static, str>,
}

/// A parameter of an effect.
///
/// A range keeps a fit away from what is no such effect, or cannot be told from nothing; it decides nothing else, and is as
/// wide as its source allows, or wider. Each says beside it where it comes from, and which of its ends are choices.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Parameter {
    /// Its symbol.
    pub symbol: Cow<'static, str>,
    /// Its unit.
    pub unit: Cow<'static, str>,
    /// A usual size.
    pub start: f64,
    /// The lowest plausible value.
    pub low: f64,
    /// The highest plausible value.
    pub high: f64,
}

/// One of an effect that is built in.
pub(super) const fn parameter(
    symbol: &'static str,
    unit: &'static str,
    start: f64,
    low: f64,
    high: f64,
) -> Parameter {
    Parameter {
        symbol: Cow::Borrowed(symbol),
        unit: Cow::Borrowed(unit),
        start,
        low,
        high,
    }
}
