//! What poses reach on a mirror whose actuators differ, before and after they were measured.

use anyhow::Result;
use calibration::with_assumed_levers;
use closed_loop::pose::{
    PoseErrors, calibrate_pose, level_tilts, peak_to_peak_deg, random_poses, tilts_along_a_sine,
};
use closed_loop::surroundings::Around;
use closed_loop::{calibrate, scattered};
use control_core::Calibration;
use virtual_mirror::MirrorConfig;

/// Rounds of measuring poses, as `host-tool calibrate-pose` makes them.
const ROUNDS: usize = 2;
/// Level positions from rest to the top, and random poses, with tilts up to a part of the largest.
const LEVELS: usize = 18;
const POSES: usize = 40;
const PART: f64 = 0.8;
/// The sine along which tilts are looked at (um, Hz).
const SINE: ((f64, f64), f64) = ((60.0, 100.0), 20.0);

/// The tilts that a calibration leaves.
pub(crate) struct Tilts {
    /// Peak to peak of a level mirror's, along its piston at rest and along a sine (deg).
    at_rest_deg: f64,
    sine_deg: f64,
}

/// What poses reach on one mirror.
pub(crate) struct Poses {
    /// Where its piston alone was calibrated, with the levers of the design.
    by_piston: Tilts,
    by_poses: Tilts,
    errors: PoseErrors,
}

impl Poses {
    /// Of the mirror of `config` with more scatter; the paper's has its own.
    pub(crate) fn measure(config: &MirrorConfig) -> Result<Self> {
        let is_the_papers = config.name == MirrorConfig::paper().name;
        let config = match is_the_papers {
            true => config.clone(),
            false => scattered(config.clone()),
        };
        let piston = calibrate(&config)?.calibration;
        let posed = calibrate_pose(&piston, &config, ROUNDS)?.calibration;
        Ok(Self {
            by_piston: tilts(&with_assumed_levers(&piston), &config)?,
            by_poses: tilts(&posed, &config)?,
            errors: PoseErrors::of(&random_poses(
                &posed,
                &config,
                (POSES, PART),
                Around::CALIBRATION,
            )?),
        })
    }

    /// Tilt along the piston at rest, before and after.
    pub(crate) fn at_rest(&self) -> String {
        let (before, after) = (self.by_piston.at_rest_deg, self.by_poses.at_rest_deg);
        format!("{before:.3} / {after:.4} deg")
    }

    /// Tilt along the sine, before and after.
    pub(crate) fn along_a_sine(&self) -> String {
        let (before, after) = (self.by_piston.sine_deg, self.by_poses.sine_deg);
        format!("{before:.3} / {after:.4} deg")
    }

    /// What poses that are asked for are off by.
    pub(crate) fn errors(&self) -> String {
        let (tilt, piston) = (self.errors.tilt_rms_deg, self.errors.piston_rms_um);
        format!("{tilt:.4} deg, {piston:.3} um")
    }
}

fn tilts(calibration: &Calibration, config: &MirrorConfig) -> Result<Tilts> {
    let (span, hz) = SINE;
    let (sine, _) = tilts_along_a_sine(calibration, config, span, hz)?;
    Ok(Tilts {
        at_rest_deg: peak_to_peak_deg(&level_tilts(calibration, config, LEVELS)?),
        sine_deg: peak_to_peak_deg(&sine),
    })
}
