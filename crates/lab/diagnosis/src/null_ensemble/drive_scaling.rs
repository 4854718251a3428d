//! The scaling of the null ensemble's drive: virtual mirrors stand for a heater on a bench when their resistance rises by the
//! same part of itself, and for a mirror of another resistance when they are heated with the same power.

use std::ops::RangeInclusive;

use identification::base::coldest_resistance;
use identification::dataset::{Channel, Dataset};
use identification::heater::{self, Readings};
use mirror_model::device::{Fact, Quantity};
use mirror_model::{ACTUATORS, Device, Model, Parameters, Symbol};

/// The virtual mirrors' highest drive: the rails of the driver board (V), `docs/board.md`.
const RAILS_V: f64 = 10.0;
/// Drives are scaled in steps of this ratio, so that sessions of the same drives share an ensemble: 5 % of the drive is 10 %
/// of the heating, less than two heaters of one kind differ by.
const STEP: f64 = 1.05;
/// A mirror is driven as it is where the virtual mirrors' resistance is between these parts of its own. With less they are warmer than it is, and
/// it is judged the more carefully for that, up to twice the power; with more they are too cold to show what any mirror shows, so by no
/// more than their losses differ from one to the next (1.35, a standard deviation of 0.3 of the logarithm).
const ALIKE: RangeInclusive<f64> = 0.5..=1.3;

/// The ratio of a session's drives and currents to those of the virtual mirrors that stand for it.
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

    /// For a session.
    pub(super) fn of(data: &Dataset) -> Self {
        match heater::hottest(data) {
            Some(heater) => Self::of_heater(&heater),
            None => Self::of_mirror(data),
        }
    }

    /// With the power: a mirror's time constants, losses and bending are those of any other resistance, whose film is only thicker or thinner.
    /// Without currents nobody knows it.
    fn of_mirror(data: &Dataset) -> Self {
        let ohms = (0..ACTUATORS).filter_map(|actuator| coldest_resistance(data, actuator));
        let ohms: Vec<f64> = ohms.collect();
        let cold_ohm = ohms.iter().sum::<f64>() / ohms.len() as f64;
        let mirror_ohm = Parameters::PAPER.get(Symbol::ColdResistance);
        let ratio = mirror_ohm / cold_ohm;
        if ohms.is_empty() || ALIKE.contains(&ratio) {
            return Self::NONE;
        }
        let volts = STEP.powf((ratio.sqrt().ln() / STEP.ln()).round());
        Self {
            volts,
            amperes: mirror_ohm / (volts * cold_ohm),
        }
    }

    /// With `g` the growth of the resistance in parts of itself and `k = xi R_T` its growth per watt, the drive at which a mirror of
    /// cold resistance `R0` is as warm follows from `g = k V^2 / (R0 (1 + g))`.
    fn of_heater(heater: &Readings) -> Self {
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
        for observation in &mut driven.observations {
            let times = self.times(observation.channel);
            observation.value /= times;
            observation.noise /= times;
        }
        driven
    }

    /// A reading of the session for each of a virtual mirror's.
    pub(super) fn times(&self, channel: Channel) -> f64 {
        match channel {
            Channel::Displacement => 1.0,
            Channel::Current(_) => self.amperes,
        }
    }

    /// Ohms of a virtual mirror for each of the session's.
    fn ohms(&self) -> f64 {
        self.volts * self.amperes
    }

    /// A model of the session's mirror as one of the virtual mirrors'.
    pub(super) fn scaled(&self, model: &Model) -> Model {
        let mut scaled = model.clone();
        let symbol = Symbol::ColdResistance;
        let ohm = scaled.parameters.get(symbol);
        scaled.parameters.set(symbol, self.ohms() * ohm);
        if let Some(own) = scaled.by_actuator.get_mut(&symbol) {
            *own = own.map(|ohm| self.ohms() * ohm);
        }
        scaled
    }

    /// What is known of the virtual mirrors: the leads are as large a part of the resistance. Of a heater on a bench nothing else is
    /// theirs, too.
    pub(super) fn described(&self, data: &Dataset, device: &Device) -> Device {
        let ohms = self.ohms();
        let mut described = device.clone();
        if data.is_of_heaters() {
            described
                .facts
                .retain(|quantity, _| *quantity == Quantity::Leads);
            described.segments.clear();
        }
        if let Some(leads) = described.facts.get_mut(&Quantity::Leads) {
            *leads = Fact {
                value: ohms * leads.value,
                tolerance: ohms * leads.tolerance,
                ..leads.clone()
            };
        }
        described
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

    fn mirror(cold_ohm: f64) -> Dataset {
        let mut data = heater(cold_ohm, 0.01);
        data.observations[0].channel = Channel::Displacement;
        data
    }

    #[test]
    fn a_mirror_like_the_virtual_ones_is_driven_as_it_is() {
        for ohm in [300.0, 360.0, 700.0] {
            assert_eq!(DriveScaling::of(&mirror(ohm)), DriveScaling::NONE, "{ohm}");
        }
        let mut blind = mirror(50.0);
        let read = &mut blind.observations;
        read.retain(|o| o.channel == Channel::Displacement);
        assert_eq!(
            DriveScaling::of(&blind),
            DriveScaling::NONE,
            "without currents"
        );
    }

    #[test]
    fn a_mirror_of_another_resistance_is_heated_with_the_same_power() {
        for ohm in [50.0, 120.0, 900.0, 2000.0] {
            let data = mirror(ohm);
            let scaling = DriveScaling::of(&data);
            let powers = (5.0 * scaling.volts).powi(2) / 360.0 / (25.0 / ohm);
            // To half a step of the drive, which is 5 % of the power.
            assert!((1.0 / STEP..=STEP).contains(&powers), "{ohm}: {powers}");
            let driven = scaling.driven(&data);
            assert_eq!(driven.observations[0].value, data.observations[0].value);
            // 1 % warmer at the hottest than where it was read first.
            let virtual_ohm = driven.intervals[1].to_v[0] / driven.observations[1].value;
            assert!((virtual_ohm / 360.0 - 1.0).abs() < 0.01, "{virtual_ohm}");
            let mut model = Model::from(mirror_model::Preset::Paper);
            model.parameters.set(Symbol::ColdResistance, ohm);
            let scaled = scaling
                .scaled(&model)
                .parameters
                .get(Symbol::ColdResistance);
            assert!((scaled / 360.0 - 1.0).abs() < 0.01, "{scaled}");
        }
    }
}
