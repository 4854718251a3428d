//! The scaling of the null ensemble's drive: virtual mirrors stand for a heater on a bench when their resistance rises by the
//! same part of itself, for a mirror of another resistance when they are heated with the same power, and for one whose currents
//! nobody measured when they move as far.

use std::ops::RangeInclusive;

use identification::base::coldest_resistance;
use identification::dataset::{Channel, Dataset};
use identification::heater::{self, Readings};
use identification::heating::thermal_resistance_of_displacements;
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

/// A mirror whose currents nobody measured is driven as it is where the paper's would move as far with so many times its heating, of
/// the virtual mirrors 9 in 10: `most_virtual_mirrors_are_driven_as_they_are`.
const MOVES_ALIKE: RangeInclusive<f64> = 0.23..=2.0;
/// With so much the paper's mirror moves as far as the median one of them.
const MEDIAN_HEATING: f64 = 0.56;

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
            None if data.has_current() => Self::of_mirror(data),
            None => Self::of_displacements(data),
        }
    }

    /// With the power: a mirror's time constants, losses and bending are those of any other resistance, whose film is only thicker or thinner.
    fn of_mirror(data: &Dataset) -> Self {
        let ohms = (0..ACTUATORS).filter_map(|actuator| coldest_resistance(data, actuator));
        let ohms: Vec<f64> = ohms.collect();
        let cold_ohm = ohms.iter().sum::<f64>() / ohms.len() as f64;
        let mirror_ohm = Parameters::PAPER.get(Symbol::ColdResistance);
        let ratio = mirror_ohm / cold_ohm;
        if ohms.is_empty() || ALIKE.contains(&ratio) {
            return Self::NONE;
        }
        let volts = in_steps(ratio.sqrt());
        Self {
            volts,
            amperes: mirror_ohm / (volts * cold_ohm),
        }
    }

    /// With the way: what lumped equations leave grows with how far a mirror bends.
    fn of_displacements(data: &Dataset) -> Self {
        let paper = Parameters::PAPER;
        let Some(k_per_w) = thermal_resistance_of_displacements(&paper, data) else {
            return Self::NONE;
        };
        let heating = k_per_w / paper.get(Symbol::ThermalResistance);
        if MOVES_ALIKE.contains(&heating) {
            return Self::NONE;
        }
        let volts = in_steps((heating / MEDIAN_HEATING).sqrt());
        Self {
            volts,
            amperes: volts.recip(),
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
    pub(super) fn scaled(&self, model: &Model, data: &Dataset) -> Model {
        if data.has_current() {
            self.of_resistance(model)
        } else {
            self.of_heating(model)
        }
    }

    /// With the resistance that the currents show.
    fn of_resistance(&self, model: &Model) -> Model {
        let mut scaled = model.clone();
        let symbol = Symbol::ColdResistance;
        let ohm = scaled.parameters.get(symbol);
        scaled.parameters.set(symbol, self.ohms() * ohm);
        if let Some(own) = scaled.by_actuator.get_mut(&symbol) {
            *own = own.map(|ohm| self.ohms() * ohm);
        }
        scaled
    }

    /// Without currents nobody knows more than V^2 R_T/R0: with the virtual mirrors' resistance, as warm at their drives.
    fn of_heating(&self, model: &Model) -> Model {
        let mut scaled = model.clone();
        let [cold, thermal] = [Symbol::ColdResistance, Symbol::ThermalResistance];
        let mirror_ohm = Parameters::PAPER.get(cold);
        let heating = scaled.parameters.get(thermal) / scaled.parameters.get(cold);
        scaled.parameters.set(cold, mirror_ohm);
        let k_per_w = heating * mirror_ohm / self.volts.powi(2);
        scaled.parameters.set(thermal, k_per_w);
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

/// A ratio of drives to the next whole number of steps.
fn in_steps(ratio: f64) -> f64 {
    STEP.powf((ratio.ln() / STEP.ln()).round())
}

#[cfg(test)]
mod tests {
    use super::super::families::observe;
    use super::*;
    use mirror_model::{PistonModel, Preset};

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
            let mut model = Model::from(Preset::Paper);
            model.parameters.set(Symbol::ColdResistance, ohm);
            let scaled = scaling
                .scaled(&model, &data)
                .parameters
                .get(Symbol::ColdResistance);
            assert!((scaled / 360.0 - 1.0).abs() < 0.01, "{scaled}");
        }
    }

    /// A reading of z alone, at 4 V for each that the virtual mirrors have.
    fn of_displacements(um: f64, volts: f64) -> Dataset {
        let driven = Dataset::driven([(0.0, 1.0), (volts, 60.0)]);
        driven.reading(1, Channel::Displacement, um, 0.02)
    }

    #[test]
    fn most_virtual_mirrors_are_driven_as_they_are() {
        let read = of_displacements(0.0, 4.0);
        let mirrors = (0..240).map(|seed| observe(&read, &Device::default(), seed)[0]);
        let mut heating: Vec<f64> = mirrors
            .map(|um| {
                let data = of_displacements(um, 4.0);
                let found = thermal_resistance_of_displacements(&Parameters::PAPER, &data);
                found.unwrap() / Parameters::PAPER.get(Symbol::ThermalResistance)
            })
            .collect();
        heating.sort_by(f64::total_cmp);
        // Two digits are written.
        assert!(
            (heating[120] / MEDIAN_HEATING - 1.0).abs() < 0.01,
            "{}",
            heating[120]
        );
        assert!(
            (heating[12] / MOVES_ALIKE.start() - 1.0).abs() < 0.03,
            "{}",
            heating[12]
        );
        assert!(
            (heating[228] / MOVES_ALIKE.end() - 1.0).abs() < 0.03,
            "{}",
            heating[228]
        );
    }

    #[test]
    fn a_mirror_without_currents_is_driven_until_it_moves_as_far() {
        for ratio in [0.1, 0.3, 2.0, 5.0] {
            let data = of_displacements(170.0, 4.0 * ratio);
            let scaling = DriveScaling::of(&data);
            let volts = ratio * scaling.volts;
            let moves = PistonModel {
                parameters: Parameters::PAPER,
            }
            .displacement_at_voltage_um(4.0 * volts * MEDIAN_HEATING.sqrt());
            assert!((moves / 170.0 - 1.0).abs() < 0.05, "{moves} at {ratio}");
            let mut model = Model::from(Preset::Paper);
            let [cold, thermal] = [Symbol::ColdResistance, Symbol::ThermalResistance];
            model.parameters.set(cold, 2000.0);
            let scaled = scaling.scaled(&model, &data).parameters;
            let heating = |p: &Parameters, volts: f64| volts.powi(2) * p.get(thermal) / p.get(cold);
            let as_warm = heating(&scaled, scaling.volts) / heating(&model.parameters, 1.0);
            assert!((as_warm - 1.0).abs() < 1e-12, "{as_warm}");
        }
    }
}
