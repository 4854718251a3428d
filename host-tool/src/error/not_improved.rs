//! Why a command that calibrates leaves a calibration as it was.

/// Why a command that calibrates leaves a calibration as it was.
#[derive(Debug, thiserror::Error, miette::Diagnostic, strum::IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
#[expect(missing_docs, reason = "each message says what its fields are")]
pub enum NotImproved {
    #[error("{asked_um:.1} um is limited here: {limit}")]
    #[diagnostic(help("`host-tool explain {limit}` says what that is; nothing was changed"))]
    RoomLimited { asked_um: f64, limit: &'static str },

    #[error("the board does not tell its room")]
    #[diagnostic(help(
        "run `host-tool calibrate`, which measures the heaters' resistances; nothing was changed"
    ))]
    RoomUnknown,

    #[error(
        "the mirror was up to {before_um:.2} um from where it stood in the first room, and {after_um:.2} um with what was found; \
         the board has the calibration of before"
    )]
    #[diagnostic(help(
        "did mirror or sensor move between the rooms, or the room while it was read? Begin again with another file"
    ))]
    RoomNotBetter { before_um: f64, after_um: f64 },

    #[error(
        "with what was found the mirror is still up to {after_um:.2} um from where it stood in the first room, so the room is not all \
         that has moved it; the board has the calibration of before"
    )]
    #[diagnostic(help(
        "did mirror or sensor move between the rooms, or the room while it was read? Begin again with another file"
    ))]
    RoomUnexplained { after_um: f64 },

    #[error("the sensor did not see the plate under the spot at x {x} um, y {y} um: {reason}")]
    #[diagnostic(help(
        "look whether it is on, on the plate and within its range; remove that spot's file and ask again"
    ))]
    PoseSensor { x: f64, y: f64, reason: String },

    #[error(
        "the same pose was read {drifted_um:.2} um apart at the beginning and at the end of a spot"
    )]
    #[diagnostic(help(
        "did sensor or mirror move? Let both warm up, and ask again; the spots before are kept"
    ))]
    PoseDrift { drifted_um: f64 },

    #[error(
        "the plate was {before_um:.3} um rms from where it was asked to be under the last spot, and {after_um:.3} um with what was \
         found; the board has the calibration of before"
    )]
    #[diagnostic(help("was the spot moved since? Begin again with another folder"))]
    PoseNotBetter { before_um: f64, after_um: f64 },

    #[error(
        "with what was found the plate was {after_um:.3} um rms from where it was asked to be under the last spot, where \
         {promised_um:.3} um were promised, and {before_um:.3} um before; the board has the calibration of before"
    )]
    #[diagnostic(help(
        "was the sensor or the spot moved since? Begin again with another folder, and a longer --settle: what still creeps or warms \
         is taken for the plate's"
    ))]
    PosePromiseBroken {
        before_um: f64,
        after_um: f64,
        promised_um: f64,
    },
}
