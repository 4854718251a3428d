//! The heating of a mirror of which only displacements are known: as much as moves it so far.

use crate::dataset::{Channel, Dataset, Observation};
use mirror_model::{ACTUATORS, MeasuredPoint, Parameters, Symbol, identify};

/// The thermal resistance (K/W) with which these parameters' mirror moves as far as this one; `None` with currents, which tell the
/// heating themselves, and where nothing driven was read.
///
/// The steady displacement counts; one that is read before it is there makes the heating a little less. Mirrors of other resistances,
/// whose drives heat a hundred times less or more, begin where they are.
pub fn thermal_resistance_of_displacements(parameters: &Parameters, data: &Dataset) -> Option<f64> {
    if data.has_current() {
        return None;
    }
    let farthest = farthest(data)?;
    let squares = data.drive(farthest).map(|v| v * v);
    let point = MeasuredPoint {
        voltage_v: (squares.iter().sum::<f64>() / ACTUATORS as f64).sqrt(),
        z_um: farthest.value.abs(),
        uncertainty_um: farthest.noise,
    };
    // The least heating: a beam that is bent beyond a right angle is as far a second time.
    let symbol = Symbol::ThermalResistance;
    let mut cold = *parameters;
    cold.set(symbol, symbol.entry().range.0);
    identify(symbol, &cold, &point).map(|identified| identified.value)
}

/// The displacement that is farthest from rest, of those that drives alone lead to.
fn farthest(data: &Dataset) -> Option<&Observation> {
    let is_driven = |o: &&Observation| {
        let interval = &data.intervals[o.interval];
        let is_alone = interval.ambient_k == 0.0 && interval.reference_um == 0.0;
        o.channel == Channel::Displacement && is_alone && data.drive(o) != [0.0; ACTUATORS]
    };
    let driven = data.observations.iter().filter(is_driven);
    driven.max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_model::PistonModel;

    /// A mirror of this cold resistance and otherwise the paper's, at two drives, with or without a current.
    fn read(cold_ohm: f64, volts: f64, channels: &[Channel]) -> Dataset {
        let mut parameters = Parameters::PAPER;
        parameters.set(Symbol::ColdResistance, cold_ohm);
        let z_um = PistonModel { parameters }.displacement_at_voltage_um(volts);
        let data = Dataset::driven([(0.0, 1.0), (volts, 1.0)]);
        channels
            .iter()
            .fold(data, |data, &channel| data.reading(1, channel, z_um, 0.02))
    }

    #[test]
    fn a_mirror_of_another_resistance_is_heated_by_as_much_less_or_more() {
        let paper = Parameters::PAPER;
        for (ohm, volts) in [(5.0, 0.4), (50.0, 1.3), (360.0, 3.5), (5000.0, 10.0)] {
            let data = read(ohm, volts, &[Channel::Displacement]);
            let found = thermal_resistance_of_displacements(&paper, &data).unwrap();
            let ratio = found / paper.get(Symbol::ThermalResistance);
            // A root to the last digits.
            assert!((ratio * ohm / 360.0 - 1.0).abs() < 1e-6, "{ratio}");
        }
    }

    #[test]
    fn displacements_say_nothing_beside_currents_or_at_rest() {
        let found = |data: &Dataset| thermal_resistance_of_displacements(&Parameters::PAPER, data);
        let both = [Channel::Displacement, Channel::Current(0)];
        assert_eq!(found(&read(360.0, 3.0, &both)), None);
        assert_eq!(found(&read(360.0, 0.0, &both[..1])), None);
        let mut oven = read(360.0, 3.0, &both[..1]);
        oven.intervals[1].ambient_k = 20.0;
        assert_eq!(found(&oven), None);
    }
}
