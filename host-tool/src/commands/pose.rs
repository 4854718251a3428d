//! Poses as a board tells them, in micrometres and degrees.

use std::fmt;

use calibration::{Cause, Drives, PlatePose, Reach};
use control_core::calibration::{Lever, Plate};
use control_core::{CHANNELS, Estimate, Kelvin, Micrometre};
use mirror_protocol::{Kept, Pose, SetPose, Status};
use serde::Serialize;

use crate::board::{View, hardly_beyond, lowest_um};
use crate::error::{BeyondBoard, ToolError};
use crate::report::decimal;
use crate::tilted_pose::TiltedPose;

/// A pose as a board tells it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct PlateReport {
    pub(super) z_um: f64,
    /// `None` where the calibration does not know the plate's levers.
    tilt_x_deg: Option<f64>,
    tilt_y_deg: Option<f64>,
}

impl From<&Pose> for PlateReport {
    fn from(pose: &Pose) -> Self {
        let tilt_deg = |i: usize| {
            let tilts = pose.tilt_rad;
            tilts.map(|rad| decimal(rad[i]).to_degrees())
        };
        Self {
            z_um: decimal(pose.z_um),
            tilt_x_deg: tilt_deg(0),
            tilt_y_deg: tilt_deg(1),
        }
    }
}

impl fmt::Display for PlateReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:>9.3} um", self.z_um)?;
        match (self.tilt_x_deg, self.tilt_y_deg) {
            (Some(x), Some(y)) => write!(f, "  {x:>+8.4} deg about x  {y:>+8.4} deg about y"),
            _ => f.write_str("  tilts unknown: the calibration has no levers"),
        }
    }
}

/// Where a board tells that the plate is; level where its tilts are not known.
pub(super) fn told_pose(pose: &Pose) -> PlatePose {
    let [tilt_x_rad, tilt_y_rad] = pose.tilt_rad.unwrap_or_default().map(f64::from);
    PlatePose {
        z_um: decimal(pose.z_um),
        tilt_x_rad,
        tilt_y_rad,
    }
}

/// A pose for a mirror with this reach.
///
/// # Errors
/// Where it is out of reach, or tilted and the plate's levers are not known.
pub(crate) fn reached(asked: TiltedPose, reach: &Reach) -> Result<PlatePose, BeyondBoard> {
    if !(asked.is_level() || reach.knows_tilts()) {
        return Err(BeyondBoard::LeversUnknown);
    }
    let pose = PlatePose::from(asked);
    let borne = hardly_beyond(reach);
    if borne.contains(&pose) {
        return Ok(pose);
    }
    let asked = Box::new(asked);
    let nearest = Box::new(nearest(&pose, reach));
    let is_in_range = borne.by_range().contains(&pose);
    let Some(not_held) = borne.not_held(&pose).filter(|_| is_in_range) else {
        return Err(BeyondBoard::PoseOutOfReach { asked, nearest });
    };
    let actuator = not_held.actuator + 1;
    Err(match not_held.cause {
        Cause::KeptWarm => BeyondBoard::PoseKeptWarm {
            asked,
            nearest,
            actuator,
        },
        Cause::HighestDrive => BeyondBoard::PoseBeyondDrives {
            asked,
            nearest,
            actuator,
        },
    })
}

/// The nearest pose that is reached, to the digits that are told: asked for as it is told, it is reached.
pub(super) fn nearest(pose: &PlatePose, reach: &Reach) -> TiltedPose {
    /// Digits by which tilts are made less, where rounding takes them out of reach.
    const TRIED: u8 = 8;
    let nearest = TiltedPose::from(reach.nearest(pose));
    let level_um = reach.level_um();
    (0..TRIED)
        .map(|digits| nearest.told(level_um, digits))
        .find(|told| reach.contains(&PlatePose::from(*told)))
        .unwrap_or(nearest)
}

/// A pose as it is asked of a board.
pub(crate) fn request(pose: PlatePose, lease_ms: u32) -> SetPose {
    SetPose {
        z_um: pose.z_um as f32,
        tilt_x_rad: pose.tilt_x_rad as f32,
        tilt_y_rad: pose.tilt_y_rad as f32,
        lease_ms,
    }
}

/// Where a range begins, as in `0 to 170.0 um`.
pub(super) fn from_um(low_um: f64) -> String {
    match low_um > 0.0 {
        true => format!("{low_um:.1}"),
        false => "0".to_owned(),
    }
}

/// What the mirror reaches at rest under the calibration in use, in its present surroundings. What the drives hold is not known of one
/// that is on trial: the board reads out the one before.
///
/// # Errors
/// Where the board does not answer, or refuses.
pub(crate) async fn reach(board: &View, status: &Status) -> Result<Reach, ToolError> {
    let calibration = board.calibration().await?;
    let levers: [Lever; CHANNELS] = calibration.levers.map(|lever| Lever {
        x: Micrometre(lever.x_um),
        y: Micrometre(lever.y_um),
        warp: lever.warp,
    });
    let reach = Reach::new(Plate { levers }, decimal(calibration.max_position_um))
        .above(lowest_um(&status.health));
    if calibration.kept == Kept::OnTrial {
        return Ok(reach);
    }
    let drives = board.settled_calibration().await?;
    Ok(match drives {
        Some(settled) => {
            let drives = Drives::new(settled.parts());
            reach.held_by(match compensated(status) {
                Some(surroundings) => drives.around(&surroundings),
                None => drives,
            })
        }
        None => reach,
    })
}

/// What a board knows of its surroundings, where it compensates them.
fn compensated(status: &Status) -> Option<Estimate> {
    let health = &status.health;
    let room = status.telemetry.room.filter(|_| health.compensates_room)?;
    let loss = health.loss?;
    let kelvin = |hundredths: f32| Kelvin(hundredths / 100.0);
    Some(Estimate {
        rise: kelvin(room.rise_ck.into()),
        rise_deviation: kelvin(room.deviation_ck.into()),
        loss: loss.change,
        loss_deviation: loss.deviation,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Typed as it is told, the nearest pose is reached.
        #[test]
        fn the_nearest_pose_is_reached_as_it_is_told(
            low_um in 0.0..60.0, top_um in 100.0..170.0, z_um in -20.0..190.0, tilt_x_rad in -0.5..0.5, tilt_y_rad in -0.5..0.5,
        ) {
            let reach = Reach::new(Plate::cross(Micrometre(480.0)), top_um).above(low_um);
            let told = nearest(&PlatePose { z_um, tilt_x_rad, tilt_y_rad }, &reach).to_string();
            let numbers: Vec<f64> = told.split(' ').filter_map(|word| word.parse().ok()).collect();
            let [z_um, tilt_x_deg, tilt_y_deg] = numbers[..] else {
                panic!("{told}");
            };
            let typed = PlatePose {
                z_um,
                tilt_x_rad: tilt_x_deg.to_radians(),
                tilt_y_rad: tilt_y_deg.to_radians(),
            };
            prop_assert!(reach.contains(&typed), "{}", told);
        }
    }
}
