//! Rows in the order of their times, and those of one instant.

use super::error::ImportError;
use crate::settled::mean;
use crate::{ACTUATORS, Row};

/// Drives of one instant that are nearer to each other than this part of the highest are one, read twice: a choice, above the noise of a
/// meter.
const ALIKE: f64 = 0.01;

/// A clock that is set back by an hour at the end of summer falls by this less the step between rows (s): a choice, for steps of up to
/// ten minutes.
const NEARLY_AN_HOUR_S: f64 = 3000.0;

/// Rows of the same instant become one, and are brought into the order of time.
///
/// # Errors
/// Where rows of one instant have different drives.
pub(super) fn at_their_times(
    mut rows: Vec<Row>,
    notes: &mut Vec<String>,
) -> Result<Vec<Row>, ImportError> {
    if !rows.is_sorted_by(|a, b| a.t_s <= b.t_s) {
        let falls = rows.windows(2).map(|pair| pair[0].t_s - pair[1].t_s);
        let most_s = falls.fold(0.0, f64::max);
        let why = match most_s > NEARLY_AN_HOUR_S {
            true => format!(
                ", which fall by {most_s} s: if the clock was set back there, write the later times without that, or import them apart"
            ),
            false => String::new(),
        };
        notes.push(format!(
            "the rows are brought into the order of their times{why}"
        ));
        rows.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
    }
    let drives = rows.iter().flat_map(|row| row.voltage_v);
    let alike_v = ALIKE * drives.fold(0.0, |most: f64, volts| most.max(volts.abs()));
    let is_another = |a: &Row, b: &Row| {
        (0..ACTUATORS).any(|i| (a.voltage_v[i] - b.voltage_v[i]).abs() > alike_v)
    };
    let mut pairs = rows.windows(2);
    if let Some(pair) =
        pairs.find(|pair| pair[0].t_s == pair[1].t_s && is_another(&pair[0], &pair[1]))
    {
        return Err(different(&pair[0], &rows[0]));
    }
    let instants: Vec<Row> = rows.chunk_by(|a, b| a.t_s == b.t_s).map(mean).collect();
    if instants.len() < rows.len() {
        notes.push(format!(
            "{} rows share their time with another one: means are taken",
            rows.len() - instants.len()
        ));
    }
    Ok(instants)
}

/// That rows of this one's time have different drives, in a table that begins with the first.
fn different(row: &Row, first: &Row) -> ImportError {
    ImportError::new(
        format!(
            "rows of one time, {} s after the first, have different drives",
            row.t_s - first.t_s
        ),
        "their order in time is not told: where each drive was held until its readings had settled, say --settled; else record times with \
         more decimals",
    )
}

#[cfg(test)]
mod tests {
    use super::super::{ImportError, Imported, Table, guesses, import};

    fn made(text: &str, settled: bool) -> Result<Imported, ImportError> {
        let table = Table::read(text.as_bytes()).expect("a table");
        import(&table, &guesses(&table), settled)
    }

    #[test]
    fn rows_of_one_time_and_different_drives_are_no_reading() {
        let text = "Time,V (V),z (um)\n13:00:00,0,0\n13:00:00,1,18\n13:00:01,2,60\n13:00:01,2,62\n13:00:02,3,120\n";
        let refused = made(text, false).expect_err("different drives");
        let told = "rows of one time, 0 s after the first, have different drives";
        assert_eq!(refused.to_string(), told);
        assert_eq!(
            made(text, true).expect("settled readings").file.rows.len(),
            4
        );
    }

    #[test]
    fn a_clock_that_may_have_been_set_back_is_told() {
        let text = "Time,V,z\n02:59:56,0,0\n02:59:58,1,18\n02:00:00,2,62\n02:00:02,3,120\n";
        let notes = made(text, false).expect("a measurement").notes.join("\n");
        assert!(
            notes.contains("order of their times, which fall by 3598 s"),
            "{notes}"
        );
    }

    #[test]
    fn a_meter_s_noise_is_no_other_drive() {
        let text = "t (s),V (V),z (um)\n0,0,0\n1,2.001,60\n1,1.999,62\n2,3,120\n";
        let rows = made(text, false).expect("a measurement").file.rows;
        assert_eq!((rows.len(), rows[1].z_um), (3, Some(61.0)));
    }
}
