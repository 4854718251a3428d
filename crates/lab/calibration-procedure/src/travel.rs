//! Whether a sensor reads a mirror's travel as a mirror makes it: upwards with the drive, in micrometres, and from rest on.

use std::ops::RangeInclusive;

use measurement::{MeasurementFile, Row, Session, median};

/// Of what the board's calibration reaches: a mirror that goes less or more is none, and micrometres taken for another unit are a thousand
/// times as much.
const PARTS: RangeInclusive<f64> = 0.05..=20.0;
/// Rows of a drive above this part of the highest, and below the other, tell the travel.
const DRIVEN: f64 = 0.9;
const AT_REST: f64 = 0.1;
/// On a way up from rest whose drives are each held so long (s), the first reading above this part of the travel, and the one of half as much
/// power at most, lie on a line through rest. On the mirrors of `data/hidden` it ends 1.4 % of the higher reading below rest at most; four
/// times that are a mirror three times as slow.
const HELD_S: f64 = 0.2;
const NOT_DRIVEN: f64 = 0.01;
/// Fewer drives than this are those of a coarse sweep, which is measured of a mirror that is still warm.
const DRIVES: usize = 10;
const NEAR_REST: f64 = 0.04;
const BELOW_REST: f64 = 0.06;
/// Three standard deviations of where it ends, in those of one reading: of twice the lower one, of the higher one and of rest.
const CHANCE: f64 = 3.0 * 2.45;

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
    /// It reads rest where the mirror moves already.
    #[error(
        "near rest the sensor reads less than the mirror moves: what it reads further up begins {0:.2} um below what it reads at rest"
    )]
    Begins(f64),
}

/// Whether the readings of a session are of a mirror that reaches about as far as the board's calibration.
pub(crate) fn check(session: &Session, reach_um: f64) -> Result<(), TravelError> {
    let Some(travel_um) = travel_um(session) else {
        return Ok(());
    };
    let part = travel_um / reach_um;
    if PARTS.contains(&part) {
        let begins = session.files.iter().find_map(|(_, file)| begins_um(file));
        return begins.map_or(Ok(()), |um| Err(TravelError::Begins(um)));
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

/// How far below rest the line through a way's first readings begins (um), where that is more than a mirror and chance make.
fn begins_um(file: &MeasurementFile) -> Option<f64> {
    let way = way_up(file).filter(|way| way.len() >= DRIVES)?;
    let highest_um = way.last()?.z_um;
    let above = way
        .iter()
        .find(|held| held.z_um >= NEAR_REST * highest_um)?;
    let is_below = |held: &&Held| held.power > 0.0 && held.power <= 0.5 * above.power;
    let below = way.iter().rfind(is_below)?;
    let slope = (above.z_um - below.z_um) / (above.power - below.power);
    let begins_um = slope * below.power - below.z_um;
    let noise_um = file.keys.displacement_noise_um().unwrap_or(0.0);
    (begins_um > BELOW_REST * above.z_um + CHANCE * noise_um).then_some(begins_um)
}

/// A drive that was held: its power, as the squares of the drives where no current was read, and how far from rest the sensor reads.
struct Held {
    power: f64,
    z_um: f64,
}

/// The drives of a file from its first row on, for as long as they go up; `None` where they do not begin at rest.
fn way_up(file: &MeasurementFile) -> Option<Vec<Held>> {
    let drive_v = |row: &Row| row.voltage_v.iter().sum::<f64>();
    let has_currents = (file.rows.iter()).all(|row| row.current_a.iter().all(Option::is_some));
    let power = |row: &Row| {
        let each = row.voltage_v.iter().zip(&row.current_a);
        let power = each.map(|(v, a)| v * if has_currents { a.unwrap_or(0.0) } else { *v });
        power.fold(0.0, |sum, of| sum + of)
    };
    let held = file.rows.chunk_by(|a, b| drive_v(a) == drive_v(b));
    let last_read = held.filter_map(|rows| rows.iter().rfind(|row| row.z_um.is_some()));
    let mut way: Vec<&Row> = Vec::new();
    for row in last_read {
        let goes_up = way
            .last()
            .is_none_or(|before| drive_v(row) > drive_v(before) && row.t_s - before.t_s >= HELD_S);
        if !goes_up {
            break;
        }
        way.push(row);
    }
    let (rest, highest) = (way.first()?, way.last()?);
    let rest_um = rest
        .z_um
        .filter(|_| drive_v(rest) < NOT_DRIVEN * drive_v(highest))?;
    let of = |row: &&Row| {
        Some(Held {
            power: power(row),
            z_um: row.z_um? - rest_um,
        })
    };
    way.iter().map(of).collect()
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
                t_s: f64::from(step),
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

    #[test]
    fn a_range_that_begins_above_rest_is_told() {
        let said = |read: fn(f64) -> Option<f64>| check(&sweep(read), 170.0);
        for (read, begins_um) in [
            ((|um| Some(um.max(1.0))) as fn(f64) -> Option<f64>, 1.0),
            (|um| Some(7.0 + (um - 5.0).max(0.0)), 5.0),
        ] {
            let Err(TravelError::Begins(um)) = said(read) else {
                panic!("{begins_um} um are not told");
            };
            assert!((um - begins_um).abs() < 0.5 * begins_um, "{um}");
        }
        // Loss by free convection, and as the heat of a mirror that has come up by nine tenths.
        assert_eq!(said(|um| Some(160.0 * (um / 160.0).powf(0.8))), Ok(()));
        assert_eq!(said(|um| Some(um - 0.1 * um.sqrt())), Ok(()));
    }
}
