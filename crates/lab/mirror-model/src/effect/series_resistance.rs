//! A resistance outside the heater takes its share of the voltage and heats nothing that bends.

use super::{Acts, Effect, Heater, Info, Moment, Parameter, Stage, Strengths, parameter};
use std::borrow::Cow;

pub(super) struct SeriesResistance;

// A quarter more than the largest of the source.
static PARAMETERS: [Parameter; 1] = [parameter("R_s", "ohm", 5.0, 0.0, 25.0)];

static INFO: Info = Info {
    id: Cow::Borrowed("series-resistance"),
    title: Cow::Borrowed("resistance of leads and contacts"),
    stage: Stage::Drive,
    acts: Acts::Voltage,
    equation: Cow::Borrowed("V' = V R/(R + R_s)"),
    parameters: Cow::Borrowed(&PARAMETERS),
    shows: Cow::Borrowed("the current is low at every drive, and the apparent TCR falls"),
    separates: Cow::Borrowed("a four-wire (Kelvin) sense at the heater"),
    source: Cow::Borrowed("contacts and leads of 1 to 20 ohm are usual"),
};

impl Effect for SeriesResistance {
    fn info(&self) -> &Info {
        &INFO
    }

    fn output(&self, p: &[f64], x: f64, _: &[f64], m: &Moment) -> f64 {
        x * m.resistance_ohm / (m.resistance_ohm + p[0])
    }

    /// Leads of more than half of the cold heater would be the heater.
    fn strengths_in(&self, heater: &Heater) -> Option<Strengths> {
        Some(Strengths {
            usual: 0.02 * heater.cold_resistance_ohm,
            low: 0.0,
            high: 0.5 * heater.cold_resistance_ohm,
        })
    }
}
