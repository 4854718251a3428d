//! What a sensor read at poses, spot by spot.

use std::array;
use std::path::{Path, PathBuf};

use calibration::{PlatePose, SpotHeights};
use serde::{Deserialize, Serialize};

use crate::commands::following::mean_and_rms;
use crate::error::{NotImproved, ToolError, UnusableInput};
use crate::new_file::NewFile;

/// Of the files.
const FORMAT: u32 = 2;
/// Without the course; a session that has such files goes on without one.
const WITHOUT_A_COURSE: u32 = 1;
/// A sensor that sees less than this part of what the plate was moved by is off, or not on the plate.
const SEEN: f64 = 0.5;
/// Readings that are the same to this (um) though poses are not are at the end of a sensor's range; its noise is more.
const SAME_UM: f64 = 1e-4;
/// Spots that are the same to this (um) are one: rounding of a file in mm, and no stage's step.
const SAME_SPOT_UM: f64 = 1e-3;
/// Poses are so far apart (um).
const APART_UM: f64 = 1.0;

/// One reading of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AtPose {
    /// From rest under the same spot (um).
    pub(super) z_um: f64,
    /// After so long (s).
    pub(super) held_s: f64,
    /// A limit held the plate elsewhere.
    pub(super) is_limited: bool,
    /// Temperature rises that the heaters' resistances told (K), where all of them told one.
    #[serde(default)]
    pub(super) told_k: Option<[f64; 4]>,
}

/// What the sensor read along a part of the course.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AlongPart {
    /// The pose at which it begins was held so long before it (s).
    pub(super) held_s: f64,
    /// At each step, from rest under the same spot (um); `None` where nothing was read, or a limit held the plate back.
    pub(super) z_um: Vec<Option<f64>>,
}

/// What was read under one spot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Spot {
    format: u32,
    /// From the plate's centre (um).
    pub(super) at_um: [f64; 2],
    /// Piston (um) and tilts (rad) that were asked for.
    asked: Vec<[f64; 3]>,
    pub(super) read: Vec<AtPose>,
    /// What was read along the parts of the course after them; empty where it was not.
    #[serde(default)]
    pub(super) course: Vec<AlongPart>,
}

/// The spots that are whole.
#[derive(Debug)]
pub(super) struct PoseSession {
    folder: PathBuf,
    asked: Vec<[f64; 3]>,
    pub(super) spots: Vec<Spot>,
}

impl Spot {
    pub(super) fn new(at_um: [f64; 2], read: Vec<AtPose>, course: Vec<AlongPart>) -> Self {
        Self {
            format: FORMAT,
            at_um,
            asked: Vec::new(),
            read,
            course,
        }
    }

    pub(super) fn heights(&self) -> SpotHeights {
        SpotHeights {
            at_um: self.at_um,
            z_um: self.read.iter().map(|at| at.z_um).collect(),
        }
    }

    /// The same spot with some of what was read under it.
    pub(super) fn with_read(&self, read: Vec<AtPose>) -> Self {
        Self::new(self.at_um, read, Vec::new())
    }

    /// How far the plate was from where it was asked to be under the spot, where no limit held it (um, root mean square). The rest that readings
    /// count from is each time another one, for hysteresis holds the plate off it: what all of them are off by is not counted.
    pub(super) fn off_um(&self, poses: &[PlatePose]) -> f64 {
        let pairs = self.read.iter().zip(poses);
        let off = pairs
            .filter(|(at, _)| !at.is_limited)
            .map(|(at, pose)| at.z_um - pose.height_um(self.at_um));
        let (_, about_mean_um) = mean_and_rms(off);
        about_mean_um
    }

    /// Whether a sensor that was on and within its range read this.
    pub(super) fn check(&self, poses: &[PlatePose]) -> Result<(), ToolError> {
        let pairs: Vec<_> = self
            .read
            .iter()
            .zip(poses)
            .map(|(at, pose)| (at.z_um, pose.height_um(self.at_um)))
            .collect();
        let read = range(pairs.iter().map(|(um, _)| *um));
        let asked = range(pairs.iter().map(|(_, height_um)| *height_um));
        let bad = |reason: String| {
            let [x, y] = self.at_um;
            Err(NotImproved::PoseSensor { x, y, reason }.into())
        };
        // A sensor that reads the same everywhere is off.
        if let Some(end) = range_ends(&pairs).first()
            && !is_same(read.0, read.1)
        {
            return bad(format!(
                "it is at the end of its range, {end:.2} um from rest"
            ));
        }
        // Not so for NaN.
        let is_seen = read.1 - read.0 > SEEN * (asked.1 - asked.0);
        if !is_seen {
            return bad(format!(
                "it saw {:.2} um of a plate that was moved by {:.1} um",
                read.1 - read.0,
                asked.1 - asked.0
            ));
        }
        Ok(())
    }
}

impl PoseSession {
    /// The spots that earlier calls have left in a folder, under the same poses.
    pub(super) fn load(folder: &Path, poses: &[PlatePose]) -> Result<Self, ToolError> {
        let asked = poses
            .iter()
            .map(|pose| [pose.z_um, pose.tilt_x_rad, pose.tilt_y_rad])
            .collect();
        let mut session = Self {
            folder: folder.to_owned(),
            asked,
            spots: Vec::new(),
        };
        loop {
            let file = spot_file(folder, session.spots.len() + 1);
            if !file.exists() {
                return Ok(session);
            }
            let spot = session.read(&file)?;
            session.spots.push(spot);
        }
    }

    fn read(&self, file: &Path) -> Result<Spot, ToolError> {
        let text = input_file::read_text(file, input_file::MOST_WRITTEN)?;
        let bad = |reason: String| {
            ToolError::from(UnusableInput::PoseReadings {
                file: file.to_owned(),
                reason,
            })
        };
        let spot: Spot = serde_json::from_str(&text).map_err(|error| bad(error.to_string()))?;
        if ![WITHOUT_A_COURSE, FORMAT].contains(&spot.format) {
            return Err(bad(format!("it has format {}, not {FORMAT}", spot.format)));
        }
        if spot.asked != self.asked || spot.read.len() != self.asked.len() {
            return Err(bad(
                "it was read at the poses of another calibration, or of another mirror".into(),
            ));
        }
        Ok(spot)
    }

    /// Whether the spots that were read are those that are to be: all of a file's, or none where they are typed.
    pub(super) fn check_spots(&self, to_be: &[[f64; 2]]) -> Result<(), UnusableInput> {
        for ((number, spot), [x, y]) in (1..).zip(&self.spots).zip(to_be) {
            let [read_x, read_y] = spot.at_um;
            if f64::hypot(read_x - x, read_y - y) > SAME_SPOT_UM {
                return Err(UnusableInput::OtherSpot {
                    file: spot_file(&self.folder, number),
                    read_at: format!("x {read_x} um, y {read_y} um"),
                    to_be_at: format!("x {x} um, y {y} um"),
                });
            }
        }
        match to_be.len() {
            0 => Ok(()),
            count if count >= self.spots.len() => Ok(()),
            count => Err(UnusableInput::MoreSpots {
                file: spot_file(&self.folder, count + 1),
                count,
            }),
        }
    }

    /// Keeps a spot that is whole.
    pub(super) fn keep(&mut self, mut spot: Spot) -> Result<(), ToolError> {
        spot.asked.clone_from(&self.asked);
        let file = NewFile::create(spot_file(&self.folder, self.spots.len() + 1), false)?;
        file.write(&serde_json::to_string_pretty(&spot).expect("plain data"))?;
        self.spots.push(spot);
        Ok(())
    }

    /// How long a pose was held, in the mean of the spots (s).
    pub(super) fn held_s(&self, pose: usize) -> f64 {
        let held = self.spots.iter().map(|spot| spot.read[pose].held_s);
        held.sum::<f64>() / self.spots.len() as f64
    }

    /// What the resistances told at a pose in the mean of all spots (K), where they told it at each.
    pub(super) fn told_k(&self, pose: usize) -> Option<[f64; 4]> {
        let mut mean = [0.0; 4];
        for spot in &self.spots {
            let told_k = spot.read[pose].told_k?;
            mean = array::from_fn(|i| mean[i] + told_k[i] / self.spots.len() as f64);
        }
        Some(mean)
    }

    pub(super) fn is_limited(&self, pose: usize) -> bool {
        self.spots.iter().any(|spot| spot.read[pose].is_limited)
    }
}

/// Readings (um) at which a sensor stands still, its lowest or its highest, while heights are apart: of pairs of what it read and the height
/// that was asked for.
pub(super) fn range_ends(pairs: &[(f64, f64)]) -> Vec<f64> {
    let (lowest, highest) = range(pairs.iter().map(|(um, _)| *um));
    let stands_still = |end: &f64| {
        let there = pairs.iter().filter(|(um, _)| is_same(*um, *end));
        let (low, high) = range(there.map(|(_, height_um)| *height_um));
        high - low > APART_UM
    };
    [lowest, highest].into_iter().filter(stands_still).collect()
}

/// Whether two readings are the same (um).
pub(super) fn is_same(a: f64, b: f64) -> bool {
    (a - b).abs() < SAME_UM
}

/// The lowest and the highest.
fn range(of: impl Iterator<Item = f64>) -> (f64, f64) {
    of.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), um| {
        (low.min(um), high.max(um))
    })
}

/// Where a spot's file is.
fn spot_file(folder: &Path, number: usize) -> PathBuf {
    folder.join(format!("spot-{number}.json"))
}

/// Takes a straight line of time out of readings that begin and end at the same pose; returns what it went by (um).
pub(super) fn without_drift(read: &mut [AtPose]) -> f64 {
    let (Some(first), Some(last)) = (read.first(), read.last()) else {
        return 0.0;
    };
    let drifted_um = last.z_um - first.z_um;
    let intervals = read.len().saturating_sub(1).max(1) as f64;
    for (i, at) in read.iter_mut().enumerate() {
        at.z_um -= drifted_um * i as f64 / intervals;
    }
    drifted_um
}

#[cfg(test)]
mod tests {
    use super::*;

    fn poses() -> Vec<PlatePose> {
        let at = |z_um: f64, tilt_x_rad: f64| PlatePose {
            z_um,
            tilt_x_rad,
            tilt_y_rad: 0.0,
        };
        vec![at(60.0, 0.0), at(20.0, 0.0), at(100.0, 0.01), at(60.0, 0.0)]
    }

    fn at(z_um: f64) -> AtPose {
        AtPose {
            z_um,
            held_s: 2.0,
            is_limited: false,
            told_k: None,
        }
    }

    #[test]
    fn drift_goes_out_as_a_straight_line() {
        let mut read = [60.0, 20.1, 101.2, 60.3].map(at);
        assert!((without_drift(&mut read) - 0.3).abs() < 1e-9);
        for (read, expected) in read.iter().zip([60.0, 20.0, 101.0, 60.0]) {
            assert!((read.z_um - expected).abs() < 1e-9, "{read:?}");
        }
    }

    #[test]
    fn a_sensor_that_is_off_or_at_its_end_is_told() {
        let said = |z_um: [f64; 4]| {
            let spot = Spot::new([0.0, 100.0], z_um.map(at).to_vec(), Vec::new());
            spot.check(&poses()).map_err(|error| error.to_string())
        };
        assert_eq!(said([60.0, 20.0, 101.0, 60.3]), Ok(()));
        assert!(
            said([0.01, 0.0, 0.02, 0.01])
                .expect_err("off")
                .contains("it saw 0.02 um")
        );
        assert!(said([f64::NAN; 4]).is_err());
        let clipped = said([60.0, 20.0, 60.0, 60.0]).expect_err("clipped");
        assert!(clipped.contains("end of its range"), "{clipped}");
    }

    #[test]
    fn spots_that_were_read_elsewhere_than_a_file_has_them_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut session = PoseSession::load(folder.path(), &poses()).expect("empty");
        for at_um in [[0.0, 100.0], [-100.0, 173.0]] {
            let read = [60.0, 20.0, 101.0, 60.3].map(at).to_vec();
            let spot = Spot::new(at_um, read, Vec::new());
            session.keep(spot).expect("written");
        }
        let said = |to_be: &[[f64; 2]]| {
            let checked = session.check_spots(to_be);
            checked.map_err(|error| error.to_string())
        };
        assert_eq!(said(&[]), Ok(()));
        assert_eq!(
            said(&[[0.0, 100.0], [-100.0, 173.0 + 1e-9], [5.0, 5.0]]),
            Ok(())
        );
        let other = said(&[[0.0, 100.0], [-100.0, 137.0]]).expect_err("corrected");
        for words in ["spot-2.json", "x -100 um, y 173 um", "x -100 um, y 137 um"] {
            assert!(other.contains(words), "{other}");
        }
        let fewer = said(&[[0.0, 100.0]]).expect_err("one line is gone");
        assert!(fewer.contains("spot-2.json"), "{fewer}");
    }

    #[test]
    fn spots_are_kept_for_the_next_call_and_those_of_another_mirror_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut session = PoseSession::load(folder.path(), &poses()).expect("empty");
        let read = [60.0, 20.0, 101.0, 60.3].map(at).to_vec();
        let spot = Spot::new([0.0, 100.0], read, Vec::new());
        session.keep(spot).expect("written");
        let again = PoseSession::load(folder.path(), &poses()).expect("whole");
        assert_eq!(again.spots, session.spots);
        // Earlier versions wrote no course.
        let file = spot_file(folder.path(), 1);
        let whole = std::fs::read_to_string(&file).expect("written");
        let earlier = whole
            .replace("\"format\": 2", "\"format\": 1")
            .replace(",\n  \"course\": []", "");
        assert!(!earlier.contains("course"), "{earlier}");
        std::fs::write(&file, &earlier).expect("written");
        let earlier = PoseSession::load(folder.path(), &poses()).expect("whole");
        assert_eq!(earlier.spots[0].read, session.spots[0].read);
        // Resistances are known where each spot has them; earlier versions wrote none.
        assert_eq!(again.told_k(1), None);
        let heard = [60.0, 20.0, 101.0, 60.3].map(|z_um| AtPose {
            told_k: Some([1.0, 2.0, 3.0, z_um]),
            ..at(z_um)
        });
        session.spots[0].read = heard.to_vec();
        assert_eq!(session.told_k(1), Some([1.0, 2.0, 3.0, 20.0]));
        session.spots = again.spots;
        let mut other = poses();
        other[1].z_um += 1.0;
        let refused = PoseSession::load(folder.path(), &other).expect_err("another");
        assert!(refused.to_string().contains("another mirror"), "{refused}");
        std::fs::write(&file, &whole[..whole.len() / 2]).expect("written");
        assert!(PoseSession::load(folder.path(), &poses()).is_err());
    }
}
