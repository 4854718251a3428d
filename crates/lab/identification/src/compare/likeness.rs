//! Whether all experiments are of the same four heaters: what these differ by from each other is a mirror's own, in any room and at
//! any drive that is the same for both of a pair.

use crate::dataset::{Channel, Dataset, Observation};
use mirror_model::ACTUATORS;

/// Heaters that differ from each other by so much otherwise are other heaters. The board asks as much of a mirror under another's
/// calibration (`control_core::surroundings`); fitted models leave less than the readings' noise of mirrors that lack nothing.
const UNLIKE: f64 = 0.01;
/// And by so many standard deviations of what the readings' noise leaves.
const SURE: f64 = 5.0;
/// Drives are equal that differ by less than a voltmeter's tolerance, as a part of them.
const EQUAL: f64 = 0.01;
/// Two columns are exchanged where with them in each other's place this part of the squared error is left, or less: half of it.
const LEFT_BY_AN_EXCHANGE: f64 = 0.25;

/// A row's drives (V), and its currents as measured and as modelled (A).
struct Row {
    drive: [f64; ACTUATORS],
    measured: [f64; ACTUATORS],
    modelled: [f64; ACTUATORS],
    noise: [f64; ACTUATORS],
}

/// The experiments whose heaters differ from each other otherwise than those of the others, in sentences. What is usual is told by
/// the experiment that is most like all others. The model is to be one that was fitted to them; where columns are exchanged it was fitted to
/// these, too, and nothing is told of the others.
pub fn unlike_heaters(data: &Dataset, predicted: &[f64]) -> Vec<String> {
    let experiments: Vec<(&str, Vec<Row>)> = data
        .experiments
        .iter()
        .enumerate()
        .map(|(index, name)| (name.as_str(), rows(data, predicted, index)))
        .filter(|(_, rows)| !rows.is_empty())
        .collect();
    let exchanged: Vec<String> = experiments
        .iter()
        .filter_map(|(name, rows)| {
            let [one, other] = exchanged(rows)?.map(|actuator| actuator + 1);
            Some(format!(
                "{name}: drives and currents of actuators {one} and {other} look exchanged: the model follows them in each other's columns"
            ))
        })
        .collect();
    if !exchanged.is_empty() {
        return exchanged;
    }
    let all: Vec<Ratios> = experiments.iter().map(|(_, own)| ratios(own)).collect();
    let from_all = |own: &Ratios| all.iter().map(|other| apart(own, other)).sum::<f64>();
    let told = (0..all.len()).filter(|index| all[*index].iter().any(Option::is_some));
    let usual = told
        .map(|index| (from_all(&all[index]), index))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, index)| (experiments[index].0, &all[index]));
    let Some((of, usual)) = usual else {
        return Vec::new();
    };
    let named = experiments.iter().map(|(name, _)| *name);
    let apart = named.zip(all.iter().map(|own| apart(own, usual)));
    let unlike: Vec<(&str, f64)> = apart.filter(|(_, apart)| *apart > UNLIKE).collect();
    let names: Vec<&str> = unlike.iter().map(|(name, _)| *name).collect();
    let largest = unlike.iter().map(|(_, apart)| *apart).reduce(f64::max);
    let told = largest.map(|largest| {
        format!(
            "{}: heaters differ from each other otherwise than in {of}, by up to {:.1} %: another mirror, exchanged columns, or a heater that has changed",
            names.join(", "),
            100.0 * largest
        )
    });
    told.into_iter().collect()
}

/// The rows of an experiment of which all four currents were read.
fn rows(data: &Dataset, predicted: &[f64], experiment: usize) -> Vec<Row> {
    let of_it: Vec<_> = data
        .observations
        .iter()
        .zip(predicted)
        .filter(|(o, _)| o.experiment == experiment)
        .collect();
    let of_a_row = of_it.chunk_by(|a, b| a.0.interval == b.0.interval);
    let whole = |of_a_row: &[(&Observation, &f64)]| {
        let current = |actuator| {
            let is_it = |(o, _): &&(&Observation, &f64)| o.channel == Channel::Current(actuator);
            of_a_row.iter().find(is_it).copied()
        };
        let four = [current(0)?, current(1)?, current(2)?, current(3)?];
        Some(Row {
            drive: data.drive(four[0].0),
            measured: four.map(|(o, _)| o.value),
            modelled: four.map(|(_, modelled)| *modelled),
            noise: four.map(|(o, _)| o.noise),
        })
    };
    of_a_row.filter_map(whole).collect()
}

/// The pairs of actuators.
fn pairs() -> impl Iterator<Item = [usize; 2]> {
    (0..ACTUATORS).flat_map(|one| (one + 1..ACTUATORS).map(move |other| [one, other]))
}

/// How many times the currents of one of a pair are those of the other, over the same of the model, with its relative noise; none
/// of a pair that was not driven alike throughout: what is left of an earlier drive is no other heater.
type Ratios = Vec<Option<(f64, f64)>>;

fn ratios(rows: &[Row]) -> Ratios {
    let total = |of: &dyn Fn(&Row) -> f64| rows.iter().map(of).sum::<f64>();
    let ratio = |[one, other]: [usize; 2]| {
        let apart = |row: &Row| (row.drive[one] - row.drive[other]).abs() > EQUAL * row.drive[one];
        if rows.iter().any(apart) {
            return None;
        }
        let gain = |i: usize| total(&|row| row.measured[i]) / total(&|row| row.modelled[i]);
        let noise =
            |i: usize| total(&|row| row.noise[i].powi(2)).sqrt() / total(&|row| row.modelled[i]);
        let ratio = gain(one) / gain(other);
        (ratio > 0.0 && ratio.is_finite()).then(|| (ratio, noise(one).hypot(noise(other))))
    };
    pairs().map(ratio).collect()
}

/// The largest part by which a pair differs otherwise than there, of those whose difference is not the readings' noise.
fn apart(own: &Ratios, usual: &Ratios) -> f64 {
    own.iter()
        .zip(usual)
        .filter_map(|(own, usual)| {
            let ((own, noise), (usual, its_noise)) = ((*own)?, (*usual)?);
            let apart = (own / usual).ln().abs();
            (apart > SURE * noise.hypot(its_noise)).then_some(apart)
        })
        .fold(0.0, f64::max)
}

/// The two actuators whose currents are in each other's columns, if any are.
fn exchanged(rows: &[Row]) -> Option<[usize; 2]> {
    let total = |of: &dyn Fn(&Row, usize) -> f64| -> f64 {
        let of_a_row = |row| (0..ACTUATORS).map(|i| of(row, i)).sum::<f64>();
        rows.iter().map(of_a_row).sum()
    };
    // What is common to the four is the room's, or missing in the model.
    let common = total(&|row, i| row.measured[i]) / total(&|row, i| row.modelled[i]);
    let error = |columns: [usize; ACTUATORS]| {
        total(&|row, i| (row.measured[columns[i]] - common * row.modelled[i]).powi(2))
    };
    let in_place = std::array::from_fn(|i| i);
    let noise = total(&|row, i| row.noise[i].powi(2));
    let size = total(&|row, i| row.modelled[i].powi(2));
    let as_it_is = error(in_place);
    if as_it_is < (UNLIKE.powi(2) * size).max(SURE.powi(2) * noise) {
        return None;
    }
    pairs()
        .map(|[one, other]| {
            let mut columns = in_place;
            columns.swap(one, other);
            (error(columns), [one, other])
        })
        .filter(|(left, _)| *left <= LEFT_BY_AN_EXCHANGE * as_it_is)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, pair)| pair)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_model::Interval;

    /// Four heaters (ohm) and the gains of their currents in a second experiment, in which the columns may stand in another order. In
    /// the third one actuator is driven after the other.
    fn told(
        gains: [f64; ACTUATORS],
        order: [usize; ACTUATORS],
        single: [usize; ACTUATORS],
    ) -> Vec<String> {
        let ohm = [420.0, 430.0, 440.0, 450.0];
        let mut data = Dataset {
            experiments: ["sweep", "step", "single", "repeat"]
                .map(String::from)
                .to_vec(),
            ..Dataset::default()
        };
        let mut predicted = Vec::new();
        let mut row = |experiment,
                       drive: [f64; ACTUATORS],
                       gains: [f64; ACTUATORS],
                       order: [usize; ACTUATORS]| {
            data.intervals.push(Interval::held(drive, 1.0));
            for (column, actuator) in order.into_iter().enumerate() {
                data.observations.push(Observation {
                    interval: data.intervals.len() - 1,
                    channel: Channel::Current(column),
                    value: gains[actuator] * drive[actuator] / ohm[actuator],
                    noise: 2e-6,
                    experiment,
                    t_s: 0.0,
                });
                predicted.push(drive[column] / ohm[column]);
            }
        };
        let in_place = [0, 1, 2, 3];
        // The room is another one, which is common to the four.
        for volts in [1.0, 2.0, 3.0] {
            row(0, [volts; ACTUATORS], [0.98; ACTUATORS], in_place);
            row(1, [volts; ACTUATORS], gains, order);
            row(3, [volts; ACTUATORS], [1.0; ACTUATORS], in_place);
        }
        for actuator in 0..ACTUATORS {
            let mut drive = [0.2; ACTUATORS];
            drive[actuator] = 2.0;
            // What is still warm from before is no other heater.
            let mut gains = [1.0; ACTUATORS];
            gains[(actuator + 1) % ACTUATORS] = 0.97;
            row(2, drive, gains, single);
        }
        unlike_heaters(&data, &predicted)
    }

    #[test]
    fn heaters_of_another_mirror_and_columns_in_each_others_place_are_told() {
        let in_place = [0, 1, 2, 3];
        let one = [1.0; ACTUATORS];
        assert_eq!(told(one, in_place, in_place), [""; 0]);
        assert_eq!(told([1.0, 1.006, 1.0, 1.0], in_place, in_place), [""; 0]);
        let said = told([1.0, 1.02, 1.0, 0.99], in_place, in_place);
        assert!(
            said[0].contains("step: heaters differ") && said[0].contains("by up to 3.0 %"),
            "{said:?}"
        );
        let said = told(one, in_place, [0, 3, 2, 1]);
        assert!(
            said[0].contains("single: drives and currents of actuators 2 and 4 look exchanged"),
            "{said:?}"
        );
        let said = told(one, [2, 1, 0, 3], in_place);
        assert!(
            said[0].contains("step: drives and currents of actuators 1 and 3"),
            "{said:?}"
        );
        let said = told(one, [1, 0, 3, 2], in_place);
        assert!(said[0].contains("step: heaters differ"), "{said:?}");
    }
}
