//! The rows of a session that are worth simulating, and their drives as they were held.
//!
//! A fit simulates every row some hundred times, and what poles do in a hold is smooth in the logarithm of time. So of a dense
//! file the rows next to a jump of the drive are kept, and others ever further apart.

use crate::noise::Noise;
use measurement::held::{Held, held};
use measurement::{ACTUATORS, MeasurementFile, Row, Session, Settled};
use std::borrow::Cow;

/// A file with more rows is thinned.
pub(super) const DENSE_ROWS: usize = 1500;
/// A session has so many readings at most: what is computed with 240 virtual mirrors of each takes 40 MB then.
const MOST_READINGS: usize = 20_000;
/// Rows that are kept of a held drive lie apart by one of these ratios of the time since its jump, from 24 to 4 a decade: what poles do there
/// is smooth in the logarithm of time. The first with which no more rows are kept than a diagnosis simulates in a minute.
const THINNING: [f64; 4] = [1.1, 1.2, 1.4, 1.8];
const MOST_HELD: usize = 5000;
/// Straight lines between the rows that are kept of a moving drive are off by this part of its range at most (root mean square):
/// what a sine of 20 rows a period leaves.
const STRAIGHT: f64 = 0.01;
/// Rows that end before this part of a file are its beginning only: a choice.
const BEGINNING: f64 = 0.9;

/// A session of which nothing needs to be left out any more.
#[derive(Clone, Debug)]
pub struct Thinned<'a> {
    /// What is left. Its files state in their keys what the rows that were left out told of noise.
    pub session: Cow<'a, Session>,
    /// Rows that were left out.
    pub rows_left_out: usize,
    /// Sentences on what was done.
    pub notes: Vec<String>,
}

/// A session as a fit takes it.
pub fn thinned(session: &Session) -> Thinned<'_> {
    let mut notes = Vec::new();
    let steadied = steadied(session, &mut notes);
    let rows = |session: &Session| -> usize {
        session.files.iter().map(|(_, file)| file.rows.len()).sum()
    };
    let is_dense = |(_, file): &(String, MeasurementFile)| file.rows.len() > DENSE_ROWS;
    if !steadied.files.iter().any(is_dense) && readings(&steadied) <= MOST_READINGS {
        return Thinned {
            session: steadied,
            rows_left_out: 0,
            notes,
        };
    }
    let before = rows(&steadied);
    let mut thinned = steadied.into_owned();
    Noise::of(&thinned).is_stated_in(&mut thinned);
    for (name, file) in thinned.files.iter_mut().filter(|file| is_dense(file)) {
        let (all, kept) = (file.rows.len(), thin(file));
        let end_s = file.rows[all - 1].t_s;
        *file = kept;
        notes.push(format!(
            "of {all} rows in `{name}` {} are simulated: {}",
            file.rows.len(),
            reason(file, end_s)
        ));
    }
    let left = readings(&thinned);
    if left > MOST_READINGS {
        let every = left.div_ceil(MOST_READINGS);
        read_every(&mut thinned, every);
        notes.push(format!(
            "of {left} readings every {every}th row's are compared: more would tell no more"
        ));
    }
    Thinned {
        rows_left_out: before - rows(&thinned),
        session: Cow::Owned(thinned),
        notes,
    }
}

/// The session with its drives as they were held.
fn steadied<'a>(session: &'a Session, notes: &mut Vec<String>) -> Cow<'a, Session> {
    let mut steadied = Cow::Borrowed(session);
    for (index, (name, file)) in session.files.iter().enumerate() {
        let keys = &file.keys;
        let is_exact = keys.drive_noise_v().is_some() || keys.drive_is_interpolated();
        if keys.is_steady() || is_exact {
            continue;
        }
        let Some(found) = held(&file.rows) else {
            continue;
        };
        notes.push(format!("in `{name}` {}", found.sentence()));
        takes(&mut steadied.to_mut().files[index].1, &found);
    }
    steadied
}

fn takes(file: &mut MeasurementFile, held: &Held) {
    let drives = file.rows.iter_mut().zip(&held.volts);
    drives.for_each(|(row, volts)| row.voltage_v = *volts);
    let millivolts = format!("{:?}", 1e3 * held.noise_v);
    file.keys.set("noise_V_mV", &millivolts);
}

fn readings(session: &Session) -> usize {
    let rows = session.files.iter().flat_map(|(_, file)| &file.rows);
    let of_a_row = |row: &Row| {
        let currents = row.current_a.iter().flatten().count();
        currents + usize::from(row.z_um.is_some())
    };
    rows.map(of_a_row).sum()
}

/// Leaves the readings of one row in so many, and the drives of all.
fn read_every(session: &mut Session, every: usize) {
    for (_, file) in &mut session.files {
        let rows = file.rows.iter_mut().enumerate();
        for (_, row) in rows.filter(|(index, _)| !index.is_multiple_of(every)) {
            (row.z_um, row.current_a) = (None, [None; ACTUATORS]);
        }
    }
}

/// What is worth simulating of a dense file.
fn thin(file: &MeasurementFile) -> MeasurementFile {
    let mut keys = file.keys.clone();
    let rows = if keys.is_steady() {
        binned(&file.rows).states_in(&mut keys)
    } else if keys.drive_is_interpolated() {
        straight(&file.rows)
    } else {
        let mut kept = about_jumps(&file.rows, THINNING[0]);
        if kept.len() > file.rows.len() / 2 && kept.len() > DENSE_ROWS {
            keys.set("drive", "ramp");
            straight(&file.rows)
        } else {
            for ratio in &THINNING[1..] {
                if kept.len() > MOST_HELD {
                    kept = about_jumps(&file.rows, *ratio);
                }
            }
            kept
        }
    };
    MeasurementFile {
        keys,
        notes: file.notes.clone(),
        rows,
    }
}

/// Which rows these are of a file that ended at that time.
fn reason(file: &MeasurementFile, end_s: f64) -> String {
    let last_s = file.rows.last().map_or(end_s, |row| row.t_s);
    if file.keys.is_steady() {
        "means of settled readings at one drive".into()
    } else if !file.keys.drive_is_interpolated() {
        "those next to a step of the drive, and others ever further apart".into()
    } else if last_s > BEGINNING * end_s {
        "the drive moves all the time, and runs straight between them".into()
    } else {
        format!(
            "the drive moves too fast to leave many out, so that the first {last_s:.3} s stand for all"
        )
    }
}

/// Means of settled readings, in order of their drives, over drives that are as good as equal.
fn binned(rows: &[Row]) -> Settled {
    let highest = rows.iter().flat_map(|row| row.voltage_v);
    let width = highest.fold(0.0, f64::max) / DENSE_ROWS as f64;
    let mut first = rows[0].voltage_v;
    Settled::of(rows.chunk_by(|_, row| {
        let near = first.iter().zip(row.voltage_v);
        let is_near = near.into_iter().all(|(a, b)| (a - b).abs() <= width);
        if !is_near {
            first = row.voltage_v;
        }
        is_near
    }))
}

/// Those next to a jump of the drive or of the stage, and others ever further apart, by this ratio of the time since.
fn about_jumps(rows: &[Row], ratio: f64) -> Vec<Row> {
    let (mut kept, mut jumped_at, mut next) = (Vec::new(), rows[0].t_s, 0.0);
    for (index, row) in rows.iter().enumerate() {
        let moves = |before: &Row| {
            (row.voltage_v, row.reference_um) != (before.voltage_v, before.reference_um)
        };
        let jumps = index > 0 && moves(&rows[index - 1]);
        if jumps {
            jumped_at = rows[index - 1].t_s;
            next = 0.0;
            if kept.last() != Some(&(index - 1)) {
                kept.push(index - 1);
            }
        }
        let since = row.t_s - jumped_at;
        if since >= next || index + 1 == rows.len() {
            kept.push(index);
            next = since * ratio;
        }
    }
    kept.into_iter().map(|index| rows[index]).collect()
}

/// Rows at equal steps, between which the drive runs straight; of the beginning only, where that takes more than a fit can bear.
fn straight(rows: &[Row]) -> Vec<Row> {
    let mut stride = rows.len().div_ceil(DENSE_ROWS);
    while stride > 1 && !is_straight(rows, stride) {
        stride = stride.div_ceil(2);
    }
    rows.iter()
        .step_by(stride)
        .take(DENSE_ROWS)
        .copied()
        .collect()
}

/// Whether lines between rows so far apart are as good as the drive.
fn is_straight(rows: &[Row], stride: usize) -> bool {
    (0..ACTUATORS).all(|actuator| {
        let volts = |index: usize| rows[index].voltage_v[actuator];
        let (low, high) = (0..rows.len())
            .map(volts)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            });
        let (mut squares, mut count) = (0.0, 0usize);
        for begin in (0..rows.len().saturating_sub(stride)).step_by(stride) {
            let slope = (volts(begin + stride) - volts(begin)) / stride as f64;
            for between in 1..stride {
                let line = volts(begin) + slope * between as f64;
                squares += (volts(begin + between) - line).powi(2);
                count += 1;
            }
        }
        squares <= (STRAIGHT * (high - low)).powi(2) * count as f64
    })
}
