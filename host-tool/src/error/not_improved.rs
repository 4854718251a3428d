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
        "the mirror was up to {before_um:.2} um from where it stood in the first room, which is no more than the sensor's noise, and {after_um:.2} um \
         with what was found; the board has the calibration of before"
    )]
    #[diagnostic(help(
        "nothing is to be done: the calibration is as good as two such rooms can tell. Rooms that are farther apart tell more"
    ))]
    RoomAsGood { before_um: f64, after_um: f64 },

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
        "did sensor or mirror move, or has the room become warmer or colder? Let all three come to rest, and ask again; the spots before \
         are kept"
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

#[cfg(test)]
mod tests {
    use miette::Diagnostic;

    use super::*;
    use crate::error::ToolError;

    fn help(error: ToolError) -> String {
        error.help().expect("every error says it").to_string()
    }

    #[test]
    fn a_room_that_moves_a_pose_is_among_its_causes() {
        let said = help(NotImproved::PoseDrift { drifted_um: 1.6 }.into());
        assert!(said.contains("has the room become warmer"), "{said}");
    }

    #[test]
    fn what_a_table_of_poses_lacks_is_not_told_of_spots() {
        let few = || calibration::PoseError::TooFew(3);
        assert!(help(few().into()).contains("remove the file"));
        let said = help(ToolError::PosesOfTable(few()));
        assert!(said.contains("room off"), "{said}");
        assert!(
            said.contains("the table") && !said.contains("spot"),
            "{said}"
        );
    }
}
