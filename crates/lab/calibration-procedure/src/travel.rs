//! Whether a sensor reads a mirror's travel as a mirror makes it: upwards with the drive, and in micrometres.

use std::ops::RangeInclusive;

use measurement::{Row, Session, median};

/// Of what the board's calibration reaches: a mirror that goes less or more is none, and micrometres taken for another unit are a thousand
/// times as much.
const PARTS: RangeInclusive<f64> = 0.05..=20.0;
/// Rows of a drive above this part of the highest, and below the other, tell the travel.
const DRIVEN: f64 = 0.9;
const AT_REST: f64 = 0.1;

/// A travel that no mirror makes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TravelError {
    /// It goes down where it is driven.
    #[error(
        "where the mirror is driven most the sensor reads {0:.3} um less than at rest: it counts the other way round"
    )]
    Reversed(f64),
    /// It goes much less or more than any mirror.
    #[error(
        "between rest and the highest drive the sensor reads {travel_um:.4} um, where the board's calibration has {reach_um:.0} um"
    )]
    Scale {
        /// By the sensor (um).
        travel_um: f64,
        /// By the board's calibration (um).
        reach_um: f64,
    },
}

/// Whether the readings of a session are of a mirror that reaches about as far as the board's calibration.
pub(crate) fn check(session: &Session, reach_um: f64) -> Result<(), TravelError> {
    let Some(travel_um) = travel_um(session) else {
        return Ok(());
    };
    let part = travel_um / reach_um;
    if PARTS.contains(&part) {
        return Ok(());
    }
    Err(match PARTS.contains(&-part) {
        true => TravelError::Reversed(-travel_um),
        false => TravelError::Scale {
            travel_um,
            reach_um,
        },
    })
}

/// From rest to the highest drive (um); `None` where one of them was not read.
fn travel_um(session: &Session) -> Option<f64> {
    let rows = || session.files.iter().flat_map(|(_, file)| &file.rows);
    let drive_v = |row: &Row| row.voltage_v.iter().sum::<f64>();
    let highest_v = rows().map(drive_v).fold(0.0, f64::max);
    let at = |is_there: &dyn Fn(f64) -> bool| {
        let there = rows().filter(|row| is_there(drive_v(row) / highest_v));
        let read: Vec<f64> = there.filter_map(|row| row.z_um).collect();
        (!read.is_empty()).then(|| median(read))
    };
    Some(at(&|part| part > DRIVEN)? - at(&|part| part < AT_REST)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use measurement::MeasurementFile;

    /// A sweep to 160 um and back that a sensor reads so.
    fn sweep(read: impl Fn(f64) -> Option<f64>) -> Session {
        let rows = (0..=40).map(|step: i32| {
            let volts = 3.5 - f64::from((step - 20).abs()) * 0.175;
            Row {
                voltage_v: [volts; 4],
                z_um: read(160.0 * (volts / 3.5).powi(2)),
                ..Row::default()
            }
        });
        let file = MeasurementFile {
            rows: rows.collect(),
            ..MeasurementFile::default()
        };
        Session {
            files: vec![("sweep.csv".to_owned(), file)],
        }
    }

    #[test]
    fn a_travel_in_another_unit_or_downwards_is_told() {
        let said = |read: fn(f64) -> Option<f64>| check(&sweep(read), 170.0);
        assert_eq!(said(Some), Ok(()));
        assert_eq!(said(|um| Some(1000.0 + um)), Ok(()));
        assert_eq!(said(|_| None), Ok(()));
        assert!(matches!(said(|um| Some(-um)), Err(TravelError::Reversed(um)) if um > 100.0));
        for read in [
            |um| Some(1e-3 * um),
            |um| Some(1e3 * um),
            |um| Some(1e-9 * um),
        ] {
            assert!(matches!(said(read), Err(TravelError::Scale { .. })));
        }
    }
}
