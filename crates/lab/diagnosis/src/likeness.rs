//! How virtual mirrors are driven to be like the heater of a session: as warm, in parts of their resistance.

use crate::heater;
use crate::plan::Plan;
use mirror_model::{Parameters, Symbol};

/// What drives virtual mirrors goes no further: their rails.
const RAILS_V: f64 = 10.0;
/// Drives are scaled in steps of this ratio, so that sessions of the same drives share their virtual mirrors.
const STEP: f64 = 1.05;

/// The ratio of a session's drives and currents to those of virtual mirrors that stand for it. A mirror's session is driven
/// as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Likeness {
    /// Volts at a virtual mirror for each of the session's.
    volts: f64,
    /// Amperes of the session for each of a virtual mirror's.
    pub(crate) amperes: f64,
}

impl Likeness {
    pub(crate) fn of(plan: &Plan) -> Self {
        let Some(heater) = heater::hottest(plan) else {
            return Self {
                volts: 1.0,
                amperes: 1.0,
            };
        };
        let mirror = Parameters::PAPER;
        let growth_per_w =
            mirror.get(Symbol::ResistanceCoefficient) * mirror.get(Symbol::ThermalResistance);
        let growth = heater.growth;
        let mirror_ohm = mirror.get(Symbol::ColdResistance);
        let as_warm_v = (growth * (1.0 + growth) * mirror_ohm / growth_per_w).sqrt();
        let times = as_warm_v.min(RAILS_V) / heater.hottest_v();
        let volts = STEP.powf((times.ln() / STEP.ln()).floor());
        Self {
            volts,
            amperes: mirror_ohm / (volts * heater.cold_ohm),
        }
    }

    /// The session as the virtual mirrors have it: their drives, and the noise as large beside their currents.
    pub(crate) fn driven(&self, plan: &Plan) -> Plan {
        let mut driven = plan.clone();
        for interval in &mut driven.intervals {
            interval.from_v = interval.from_v.map(|v| v * self.volts);
            interval.to_v = interval.to_v.map(|v| v * self.volts);
        }
        if plan.is_of_heaters() {
            for observation in &mut driven.observations {
                observation.value /= self.amperes;
                observation.noise /= self.amperes;
            }
        }
        driven
    }
}
