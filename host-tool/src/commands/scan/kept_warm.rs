//! What a scan says of poses that the drives do not hold at rest. It is no reason to refuse one: what actuators share is slow, and a scan
//! that is over before it is warm, or whose piston is lower in the mean than where it tilts, comes to poses that a plate at rest does not.
//! What holds a scan back for good, the board tells as `cooling`.

use calibration::{PlatePose, Reach};
use experiments::Run;

use super::path::poses;
use crate::board::hardly_below;
use crate::commands::pose::nearest;
use crate::tilted_pose::TiltedPose;

/// The pose at which an actuator is kept warm by most, and the nearest to it that is held; `None` where all are.
pub(super) fn warning(run: &Run, reach: &Reach) -> Option<String> {
    run.tilts.as_ref()?;
    let borne = hardly_below(reach);
    let kept_warm = |pose: PlatePose| borne.kept_warm(&pose).map(|it| (pose, it));
    let all = poses(run).filter_map(kept_warm);
    let (pose, most) = all.max_by(|(_, a), (_, b)| a.k.total_cmp(&b.k))?;
    Some(format!(
        "the drives do not hold all of these poses at rest: once what actuators share of their heat is warm, at {} it keeps actuator {} \
         warmer by {:.1} K than that asks for, and a heater cannot cool; the nearest pose that they hold is {}",
        TiltedPose::from(pose),
        most.actuator + 1,
        most.k,
        nearest(&pose, reach),
    ))
}
