//! What tells a mirror from others: by what its heaters' resistances differ from each other.

use std::ops::RangeInclusive;

use control_core::{CHANNELS, Calibration};
use measurement::{Row, Session, median};

/// Rows of a drive about half the highest tell them: films there are as warm in any room, and currents are large.
const HALF: RangeInclusive<f64> = 0.45..=0.55;
/// Those of drives so small, as parts of the highest, tell what heaters have when they are hardly warm: a twentieth of the highest power.
const HARDLY: RangeInclusive<f64> = 0.1..=0.22;
/// By so large a part they differ at most between two measurements of one mirror: 0.4 % for currents that two boards sense (a gain of 1 % each,
/// `docs/board.md`, of which the four have most in common), and as much for heat that is not at rest. Mirrors of one kind differ by 3 %.
const SAME: f64 = 0.01;

/// Resistances of the four heaters where all have the same drive (ohm).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heaters(pub [f64; CHANNELS]);

impl Heaters {
    /// At rest, as a calibration has them; nothing where it takes all four for alike, as one that nobody measured does.
    pub fn at_rest(calibration: &Calibration) -> Option<Self> {
        let rest = calibration.actuators().each_ref();
        let rest = rest.map(|actuator| f64::from(actuator.resistance_at_rest().0));
        rest.iter().any(|ohm| *ohm != rest[0]).then_some(Self(rest))
    }

    /// What rows tell; nothing where none has all four currents at half the highest drive.
    pub(crate) fn of<'a>(rows: impl Iterator<Item = &'a Row> + Clone) -> Option<Self> {
        Self::within(HALF, rows)
    }

    /// What a session tells of them hardly warm, about as they are at rest; nothing where none of its rows has all four currents at such a drive.
    pub fn hardly_driven(session: &Session) -> Option<Self> {
        let rows = session.files.iter().flat_map(|(_, file)| &file.rows);
        Self::within(HARDLY, rows)
    }

    /// What rows tell whose drives are all within these parts of the highest that all four have.
    fn within<'a>(
        parts: RangeInclusive<f64>,
        rows: impl Iterator<Item = &'a Row> + Clone,
    ) -> Option<Self> {
        let lowest_v = |row: &Row| row.voltage_v.into_iter().fold(f64::INFINITY, f64::min);
        let most_v = rows.clone().map(lowest_v).fold(0.0, f64::max);
        let is_within = |row: &&Row| {
            let drives_v = [lowest_v(row), row.highest_v()];
            drives_v
                .iter()
                .all(|volts| parts.contains(&(volts / most_v)))
        };
        let mut told: [Vec<f64>; CHANNELS] = Default::default();
        for row in rows.filter(is_within) {
            let each = row.voltage_v.into_iter().zip(row.current_a);
            for (told, (drive_v, current_a)) in told.iter_mut().zip(each) {
                told.extend(current_a.filter(|a| *a > 0.0).map(|a| drive_v / a));
            }
        }
        let is_whole = told.iter().all(|told| !told.is_empty());
        is_whole.then(|| Self(told.map(median)))
    }

    /// The actuator whose resistance differs most from the others' beyond what it does here, and its resistances there and here (ohm); nothing
    /// where both are of one mirror. The room is none of it, for it is the same for all four.
    pub fn differ(&self, here: &Self) -> Option<(usize, f64, f64)> {
        let mean = |heaters: &Self| heaters.0.iter().sum::<f64>() / CHANNELS as f64;
        let warmer = mean(here) / mean(self);
        let apart = |i: usize| (self.0[i] * warmer / here.0[i] - 1.0).abs();
        let most = (0..CHANNELS).max_by(|a, b| apart(*a).total_cmp(&apart(*b)))?;
        (apart(most) > SAME).then_some((most, self.0[most] * warmer, here.0[most]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use control_core::Ohm;
    use measurement::MeasurementFile;
    use mirror_model::{Model, Preset};

    /// A sweep and back of heaters with these resistances when cold, in a room where they have so many times as much.
    fn swept(cold_ohm: [f64; CHANNELS], warmer: f64) -> Vec<Row> {
        let steps = (0..=36).chain((0..36).rev());
        let row = |step: i32| {
            let drive_v = f64::from(step) * 0.1;
            let hot = warmer * (1.0 + 0.02 * drive_v * drive_v);
            Row {
                voltage_v: [drive_v; CHANNELS],
                current_a: cold_ohm.map(|ohm| Some(drive_v / (ohm * hot))),
                ..Row::default()
            }
        };
        steps.map(row).collect()
    }

    fn told(cold_ohm: [f64; CHANNELS], warmer: f64) -> Heaters {
        Heaters::of(swept(cold_ohm, warmer).iter()).expect("currents at half the drive")
    }

    #[test]
    fn the_same_mirror_in_another_room_is_the_same() {
        let cold_ohm = [357.0, 376.0, 363.0, 347.0];
        let here = told(cold_ohm, 1.0);
        assert_eq!(told(cold_ohm, 1.0).differ(&here), None);
        // 10 K.
        assert_eq!(told(cold_ohm, 1.039).differ(&here), None);
        // What a converter's gain is off by.
        let gains = [1.003, 0.998, 1.004, 0.999];
        let sensed: [f64; CHANNELS] = std::array::from_fn(|i| cold_ohm[i] * gains[i]);
        assert_eq!(told(sensed, 1.0).differ(&here), None);
    }

    #[test]
    fn another_mirror_is_told_by_its_heater() {
        let here = told([357.0, 376.0, 363.0, 347.0], 1.0);
        let there = told([365.6, 375.8, 368.6, 362.4], 1.0);
        let (actuator, there_ohm, here_ohm) = there.differ(&here).expect("they differ");
        assert_eq!(actuator, 3);
        assert!(there_ohm > here_ohm * 1.01, "{there_ohm}, {here_ohm}");
    }

    #[test]
    fn a_calibration_tells_them_where_they_were_measured() {
        let mut parts = *calibration::tabulate(&Model::from(Preset::Reconciled))
            .expect("it has an inverse")
            .calibration
            .parts();
        let at_rest = |parts| Heaters::at_rest(&Calibration::new(parts).expect("a mirror's"));
        assert_eq!(at_rest(parts), None);
        let cold_ohm = [357.0, 376.0, 363.0, 347.0];
        for (actuator, cold_ohm) in parts.actuators.iter_mut().zip(cold_ohm) {
            actuator.cold_resistance = Ohm(cold_ohm);
        }
        let told = at_rest(parts).expect("measured");
        assert_eq!(told.differ(&Heaters(cold_ohm.map(f64::from))), None);
        // The line through what it has where it is driven begins elsewhere; what it has at rest counts.
        for actuator in &mut parts.actuators {
            actuator.sensed_rises.knots[0] = -10.0;
        }
        let ohm = at_rest(parts).expect("measured").0[0];
        assert!((ohm - 343.0).abs() < 1.0, "{ohm}");
    }

    #[test]
    fn heaters_that_are_hardly_driven_tell_what_they_have_at_rest() {
        let cold_ohm = [357.0, 376.0, 363.0, 347.0];
        let file = MeasurementFile {
            rows: swept(cold_ohm, 1.0),
            ..MeasurementFile::default()
        };
        let session = Session {
            files: vec![("sweep.csv".to_owned(), file)],
        };
        let told = Heaters::hardly_driven(&session).expect("currents at a small drive");
        for (told, cold) in told.0.iter().zip(cold_ohm) {
            // 0.02 times 0.6 V squared.
            assert!((told / cold - 1.0).abs() < 0.01, "{told} {cold}");
        }
        assert_eq!(Heaters::hardly_driven(&Session::default()), None);
    }

    #[test]
    fn rows_without_currents_tell_nothing() {
        let mut rows = swept([360.0; CHANNELS], 1.0);
        rows.iter_mut().for_each(|row| row.current_a[2] = None);
        assert_eq!(Heaters::of(rows.iter()), None);
        assert_eq!(Heaters::of([].iter()), None);
    }
}
