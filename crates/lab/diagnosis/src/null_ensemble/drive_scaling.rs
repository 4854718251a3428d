//! The scaling of the null ensemble's drive: virtual mirrors stand for a heater on a bench when their resistance rises by the
//! same part of itself.

use identification::dataset::Dataset;
use identification::heater;
use mirror_model::device::{Fact, Quantity};
use mirror_model::{Device, Parameters, Symbol};

/// The virtual mirrors' highest drive: the rails of the driver board (V), `docs/board.md`.
const RAILS_V: f64 = 10.0;
/// Drives are scaled in steps of this ratio, so that sessions of the same drives share an ensemble: 5 % of the drive is 10 %
/// of the heating, less than two heaters of one kind differ by.
const STEP: f64 = 1.05;

/// The ratio of a session's drives and currents to those of the virtual mirrors that stand for it. A mirror's session is
/// driven as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DriveScaling {
    /// Volts at a virtual mirror for each of the session's.
    volts: f64,
    /// Amperes of the session for each of a virtual mirror's.
    pub(super) amperes: f64,
}

impl DriveScaling {
    const NONE: Self = Self {
        volts: 1.0,
        amperes: 1.0,
    };

    /// For a session: with `g` the growth of the resistance in parts of itself and `k = xi R_T` its growth per watt, the
    /// drive at which a mirror of cold resistance `R0` is as warm follows from `g = k V^2 / (R0 (1 + g))`.
    pub(super) fn of(data: &Dataset) -> Self {
        let Some(heater) = heater::hottest(data) else {
            return Self::NONE;
        };
        let mirror = Parameters::PAPER;
        let growth_per_w =
            mirror.get(Symbol::ResistanceCoefficient) * mirror.get(Symbol::ThermalResistance);
        let growth = heater.growth;
        let mirror_ohm = mirror.get(Symbol::ColdResistance);
        let as_warm_v = (growth * (1.0 + growth) * mirror_ohm / growth_per_w).sqrt();
        let ratio = as_warm_v.min(RAILS_V) / heater.hottest_v();
        let volts = STEP.powf((ratio.ln() / STEP.ln()).floor());
        Self {
            volts,
            amperes: mirror_ohm / (volts * heater.cold_ohm),
        }
    }

    /// The session as the virtual mirrors have it: their drives, and the noise as large beside their currents.
    pub(super) fn driven(&self, data: &Dataset) -> Dataset {
        let mut driven = data.clone();
        for interval in &mut driven.intervals {
            interval.from_v = interval.from_v.map(|v| v * self.volts);
            interval.to_v = interval.to_v.map(|v| v * self.volts);
        }
        if data.is_of_heaters() {
            for observation in &mut driven.observations {
                observation.value /= self.amperes;
                observation.noise /= self.amperes;
            }
        }
        driven
    }

    /// What is known of the virtual mirrors. Of a heater on a bench only the leads are theirs too, as large a part of the
    /// resistance.
    pub(super) fn described(&self, data: &Dataset, device: &Device) -> Device {
        if !data.is_of_heaters() {
            return device.clone();
        }
        let ohms = self.volts * self.amperes;
        let leads = device.facts.get(&Quantity::Leads).map(|leads| Fact {
            value: ohms * leads.value,
            tolerance: ohms * leads.tolerance,
            ..leads.clone()
        });
        Device {
            facts: leads
                .map(|leads| (Quantity::Leads, leads))
                .into_iter()
                .collect(),
            segments: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use identification::dataset::Channel;

    /// A heater of `cold_ohm` that grows by `growth` at 5 V, in proportion to its power.
    fn heater(cold_ohm: f64, growth: f64) -> Dataset {
        let volts: Vec<f64> = (1..=10).map(|step| 0.5 * f64::from(step)).collect();
        let hottest_w = 25.0 / (cold_ohm * (1.0 + growth));
        let ohm_at = |v: f64| {
            // R = R0 (1 + k V^2 / R): a quadratic equation.
            let k = growth / hottest_w;
            0.5 * cold_ohm * (1.0 + (1.0 + 4.0 * k * v * v / cold_ohm).sqrt())
        };
        let driven = Dataset::driven(volts.iter().map(|&v| (v, 1.0)));
        volts.iter().enumerate().fold(driven, |data, (index, &v)| {
            data.reading(index, Channel::Current(0), v / ohm_at(v), 1e-7)
        })
    }

    #[test]
    fn a_virtual_mirror_is_driven_until_its_resistance_grows_as_much() {
        let paper = Parameters::PAPER;
        let [ohm, xi, per_w] = [
            Symbol::ColdResistance,
            Symbol::ResistanceCoefficient,
            Symbol::ThermalResistance,
        ]
        .map(|symbol| paper.get(symbol));
        let growth = 0.2;
        let data = heater(1000.0, growth);
        let scaling = DriveScaling::of(&data);
        let hottest_v = 5.0 * scaling.volts;
        let power_w = hottest_v * hottest_v / (ohm * (1.0 + growth));
        // Down to the next step of 5 % of the drive, which is 10 % of the power.
        let ratio = xi * per_w * power_w / growth;
        assert!((STEP.powi(-2)..=1.001).contains(&ratio), "{ratio}");
        assert!((scaling.amperes * scaling.volts * 1000.0 / ohm - 1.0).abs() < 1e-3);
    }

    #[test]
    fn heaters_of_one_kind_have_the_same_drives() {
        let drives = [1000.0, 1010.0].map(|ohm| {
            let data = heater(ohm, 0.2);
            DriveScaling::of(&data).driven(&data).intervals
        });
        assert_eq!(drives[0], drives[1]);
    }

    #[test]
    fn a_mirror_is_driven_as_it_is() {
        let mut data = heater(1000.0, 0.2);
        data.observations[0].channel = Channel::Displacement;
        assert_eq!(DriveScaling::of(&data), DriveScaling::NONE);
    }
}
