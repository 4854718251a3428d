//! Places where a model can be wrong: a quantity of the chain, and what it would have to vary with.

use mirror_model::effect::{Acts, Stage};
use serde::Serialize;
use std::fmt;

/// What a quantity varies with, beyond the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Driver {
    /// The voltage at the actuator.
    Voltage,
    /// The temperature rise of the actuator.
    Temperature,
    /// The displacement.
    Position,
    /// The time since the session began.
    Time,
    /// The power of the other actuators; for a quantity of the whole mirror that of all.
    OtherPower,
    /// The highest temperature so far.
    Peak,
    /// For how long the actuator was how hot.
    Exposure,
    /// Its own past, which fades over a time: so also its rate.
    Lag,
    /// Its own turning points, whatever the rate.
    Turning,
    /// Its rate, more or less so from place to place.
    Rate,
}

/// A quantity, and what it varies with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Place {
    /// The quantity.
    pub acts: Acts,
    /// What it varies with.
    pub driver: Driver,
}

impl Place {
    /// All that are tried. A quantity is not tried with what moves with it in every session that drives can make: the heating
    /// with the temperature says what the temperature with itself would.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        use Driver::{
            Exposure, Lag, OtherPower, Peak, Position, Rate, Temperature, Time, Turning, Voltage,
        };
        let tried: [(Acts, &[Driver]); 8] = [
            (Acts::Voltage, &[Voltage, Time, OtherPower]),
            (
                Acts::Resistance,
                &[Temperature, Voltage, Time, OtherPower, Peak, Exposure, Lag],
            ),
            (
                Acts::Heating,
                &[Temperature, Position, Time, OtherPower, Peak, Exposure],
            ),
            (Acts::Temperature, &[Time, OtherPower, Lag]),
            (
                Acts::Curvature,
                &[Temperature, Time, OtherPower, Peak, Exposure],
            ),
            (
                Acts::Displacement,
                &[Position, Voltage, Time, Peak, Lag, Turning],
            ),
            (Acts::Motion, &[Rate]),
            (Acts::Reading, &[Position, Time, OtherPower, Lag, Turning]),
        ];
        tried
            .into_iter()
            .flat_map(|(acts, drivers)| drivers.iter().map(move |&driver| Self { acts, driver }))
    }

    /// The link of the chain that it belongs to.
    pub fn stage(self) -> Stage {
        match (self.acts, self.driver) {
            // A heater knows no voltage but by its heat: what seems to vary with it lies between driver and heater.
            (Acts::Voltage, _) | (Acts::Resistance, Driver::Voltage) => Stage::Drive,
            (Acts::Resistance, _) => Stage::Resistance,
            (Acts::Heating | Acts::Temperature, _) => Stage::Heat,
            (Acts::Curvature, _) => Stage::Curvature,
            (Acts::Displacement, _) if self.is_of_time() => Stage::Memory,
            (Acts::Displacement, _) => Stage::Shape,
            (Acts::Motion, _) => Stage::Motion,
            (Acts::Reading, _) => Stage::Sensor,
        }
    }

    /// The quantity in words.
    pub(crate) fn quantity(self) -> &'static str {
        match self.acts {
            Acts::Voltage => "voltage at the heater",
            Acts::Resistance => "resistance",
            Acts::Heating => "rise that the power makes",
            Acts::Temperature => "temperature",
            Acts::Curvature => "curvature",
            Acts::Displacement => "displacement of an actuator",
            Acts::Motion => "motion of the plate",
            Acts::Reading => "reading",
        }
    }

    /// Whether a function of the driver is added to the quantity, rather than changing it in proportion: what the quantity's own
    /// chain does is, heat that comes from elsewhere, what is lost in a common supply, and a sensor's zero.
    pub(crate) fn adds(self) -> bool {
        let is_own = matches!(
            self.driver,
            Driver::Voltage | Driver::Temperature | Driver::Position
        );
        is_own
            || self.acts == Acts::Temperature
            || (self.acts == Acts::Voltage && self.driver == Driver::OtherPower)
            || (self.acts == Acts::Reading && self.driver == Driver::Time)
    }

    /// Whether time or history enter.
    pub(crate) fn is_of_time(self) -> bool {
        !matches!(
            self.driver,
            Driver::Voltage | Driver::Temperature | Driver::Position | Driver::OtherPower
        )
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let quantity = self.quantity();
        let driver = match self.driver {
            Driver::Voltage => "the drive",
            Driver::Temperature => "the temperature",
            Driver::Position => "the displacement",
            Driver::Time => "time",
            Driver::OtherPower if self.acts.on_the_mirror() => "the power of all actuators",
            Driver::OtherPower => "the power of the other actuators",
            Driver::Peak => "the highest temperature so far",
            Driver::Exposure => "how long it was how hot",
            Driver::Lag => "its own past, which fades",
            Driver::Turning => "where it last turned, at any rate",
            Driver::Rate => "its rate",
        };
        write!(f, "the {quantity} varies with {driver}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_stage_has_a_place_and_no_place_is_tried_twice() {
        let places: Vec<Place> = Place::all().collect();
        let stages: BTreeSet<Stage> = places.iter().map(|place| place.stage()).collect();
        assert_eq!(stages.len(), 8, "{stages:?}");
        let said: BTreeSet<String> = places.iter().map(Place::to_string).collect();
        assert_eq!(said.len(), places.len());
    }
}
