//! What a measurement file begins with, and the instants and days that it names.

use measurement::MeasurementFile;

use crate::board::Board;

/// A file of an experiment in the session that began at this instant, which is time 0 on its clock.
pub(super) fn header(board: &Board, experiment: &str, session: &str) -> MeasurementFile {
    let mut file = MeasurementFile::default();
    file.keys.set("experiment", experiment);
    file.keys.set("device", &board.identity().board);
    let date = session.split('T').next().unwrap_or_default();
    file.keys.set("date", date);
    file.keys.set("session", session);
    file
}

/// This instant in UTC, as `2026-11-21T14:05:00.125Z`.
pub(super) fn now() -> String {
    chrono::Utc::now().to_rfc3339_opts(chrono::SecondsFormat::Millis, true)
}

/// Today in UTC, as `2026-11-21`.
pub(crate) fn today() -> String {
    chrono::Utc::now().format("%F").to_string()
}
