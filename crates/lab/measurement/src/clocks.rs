//! Two clocks of one file that do not go alike.

use crate::MeasurementFile;
use crate::column::Column;
use crate::error::Complaint;
use crate::plausibility::Finding;

/// An experiment's clock stands still where a host pauses, and goes no faster than the session's: half as fast again is another unit.
const FASTER: f64 = 1.5;

/// The last row, where `t_s` has gone faster from the first one on than `t_global_s`.
pub(crate) fn check(file: &MeasurementFile) -> Option<Finding> {
    let (first, last) = (file.rows.first()?, file.rows.last()?);
    let passed = |column: Column| Some(column.value(last)? - column.value(first)?);
    let (own_s, session_s) = (passed(Column::Time)?, passed(Column::GlobalTime)?);
    (own_s > FASTER * session_s).then(|| {
        let complaint = Complaint::new(
            format!("the clocks go apart: up to here t_s passes {own_s:.4} s, and t_global_s {session_s:.4} s"),
            "give both in seconds (milliseconds divided by 1000), or leave t_global_s out",
        );
        (file.rows.len() - 1, Column::Time, complaint)
    })
}
