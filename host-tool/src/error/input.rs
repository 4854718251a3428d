//! What a file that a command reads is not.

use std::path::PathBuf;

use control_core::CHANNELS;
use quantities::Span;

/// What a file that a command reads is not.
#[derive(Debug, thiserror::Error, miette::Diagnostic, strum::IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
#[expect(missing_docs, reason = "each message says what its fields are")]
pub enum UnusableInput {
    #[error("{} is no scan of a plate: {reason}", path.display())]
    #[diagnostic(help("write lines of x, y and z in micrometres: `-50,25,101.2`"))]
    Scan { path: PathBuf, reason: String },

    #[error("{} is no list of points on a plate: {reason}", path.display())]
    #[diagnostic(help(
        "write lines of x and y in micrometres: `-50,25`, such as 5 by 5 points over 100 um"
    ))]
    Spots { path: PathBuf, reason: String },

    #[error("{} is no waveform: {reason}", path.display())]
    #[diagnostic(help(
        "write lines of seconds and micrometres: `0.5,12.3`; or a header t_s,z_um,tilt_x_deg,tilt_y_deg, and lines such as `0.5,80,0.02,-0.01`"
    ))]
    Waveform { path: PathBuf, reason: String },

    #[error(
        "{} would be driven as another course: line {line} comes {step} after the row before, and a board plays a table in equal steps of time, \
         of {least} here at least, by which rows are missed by up to {missed_um:.3} um and {missed_deg:.4} deg", path.display()
    )]
    #[diagnostic(help(
        "put its rows at whole multiples of such a step, or play it in parts: a shorter one has shorter steps"
    ))]
    TooFine {
        path: PathBuf,
        line: usize,
        step: Span,
        least: Span,
        missed_um: f64,
        missed_deg: f64,
    },

    #[error("{} is not the calibration that the board uses", file.display())]
    #[diagnostic(help(
        "`host-tool status` tells which one it uses; `host-tool load-calibration {}` has it use this one", file.display()
    ))]
    OtherCalibration { file: PathBuf },

    #[error(
        "{} is of another mirror: at rest its heaters have {} ohm, those on this board {} ohm. A room changes all four alike, and \
         actuator {actuator} differs otherwise", file.display(), listed(*there_ohm), listed(*here_ohm)
    )]
    #[diagnostic(help(
        "the board keeps the calibration that it had. Load the file of this mirror, or measure it: `host-tool calibrate`. Where \
         it is this mirror's after all, as where another board's current sense has measured it, --other-mirror takes it"
    ))]
    OtherMirror {
        file: PathBuf,
        /// Counted from 1.
        actuator: usize,
        there_ohm: [f64; CHANNELS],
        here_ohm: [f64; CHANNELS],
    },

    #[error("{} was read under another calibration", file.display())]
    #[diagnostic(help(
        "name another file, and read both rooms under the one that the board uses now"
    ))]
    OtherRoomReadings { file: PathBuf },

    #[error("{} does not hold what a sensor read in a room: {reason}", file.display())]
    #[diagnostic(help("name a file that is not there yet: it is written in the first room"))]
    RoomReadings { file: PathBuf, reason: String },

    #[error("{} does not hold what a sensor read at poses: {reason}", file.display())]
    #[diagnostic(help("name another folder, or remove the file: its spot is read again then"))]
    PoseReadings { file: PathBuf, reason: String },

    #[error("{} was read with the spot at {read_at}, where it is to be at {to_be_at}", file.display())]
    #[diagnostic(help(
        "name another folder, in which all spots are read anew; or, where the one in the file is right, leave out --spots or put that point back"
    ))]
    OtherSpot {
        file: PathBuf,
        read_at: String,
        to_be_at: String,
    },

    #[error("{} was read besides the {count} points that there are to be", file.display())]
    #[diagnostic(help(
        "remove the file, so that its spot no longer counts; or leave out --spots, where it is to count"
    ))]
    MoreSpots { file: PathBuf, count: usize },

    #[error("{} is no table of poses: {reason}", file.display())]
    #[diagnostic(help(
        "write the columns asked_z_um, asked_tilt_x_deg, asked_tilt_y_deg, held_s, z_um, tilt_x_deg, tilt_y_deg, a pose a row"
    ))]
    PoseTable { file: PathBuf, reason: String },

    #[error("{} is no whole report: {reason}", path.display())]
    #[diagnostic(help(
        "write it again with `host-tool report`, or fetch it again from whoever sent it"
    ))]
    NotAReport { path: PathBuf, reason: String },

    #[error("{} is no trial of a calibration: {reason}", path.display())]
    #[diagnostic(help("`host-tool calibrate --trial FILE` writes one"))]
    NotATrial { path: PathBuf, reason: String },
}

/// To a tenth, one after the other.
fn listed(ohm: [f64; CHANNELS]) -> String {
    ohm.map(|ohm| format!("{ohm:.1}")).join(", ")
}
