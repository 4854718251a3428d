//! What a scan says of poses that the drives do not hold at rest. It is no reason to refuse one: what actuators share is slow, and a scan
//! that is over before it is warm, or whose piston is lower or higher in the mean than where it tilts, comes to poses that a plate at rest does
//! not. What holds a scan back for good, the board tells as `cooling` or `drive-high`.

use calibration::{Cause, PlatePose, Reach};
use experiments::Run;

use super::path::poses;
use crate::board::hardly_beyond;
use crate::commands::pose::nearest;
use crate::tilted_pose::TiltedPose;

/// The pose at which an actuator is off by most, and the nearest to it that is held; `None` where all are.
pub(super) fn warning(run: &Run, reach: &Reach) -> Option<String> {
    run.tilts.as_ref()?;
    let borne = hardly_beyond(reach);
    let not_held = |pose: PlatePose| borne.not_held(&pose).map(|it| (pose, it));
    let all = poses(run).filter_map(not_held);
    let (pose, most) = all.max_by(|(_, a), (_, b)| a.k.total_cmp(&b.k))?;
    let (pose, nearest) = (TiltedPose::from(pose), nearest(&pose, reach));
    let (actuator, k) = (most.actuator + 1, most.k);
    let why = match most.cause {
        Cause::KeptWarm => format!(
            "once what actuators share of their heat is warm, at {pose} it keeps actuator {actuator} warmer by {k:.1} K than that asks for, and a \
             heater cannot cool"
        ),
        Cause::HighestDrive => format!(
            "at {pose} the highest drive leaves actuator {actuator} less warm by {k:.1} K than that asks for"
        ),
    };
    Some(format!(
        "the drives do not hold all of these poses at rest: {why}; the nearest pose that they hold is {nearest}"
    ))
}
