//! What a calibration found, and how well the board positions before and after it.

use std::fmt;
use std::path::PathBuf;

use calibration_procedure::{Figures, ReadingCounts};
use control_core::design::COLD_RESISTANCE_TOLERANCE;
use identification::Identification;
use serde::Serialize;

use super::room_unknown::RoomUnknown;
use crate::commands::lab::Identified;
use crate::commands::range_end::RangeEnd;
use crate::report::row;
use crate::tried::{Figure, figures};

#[derive(Serialize)]
pub(super) struct CalibrateReport {
    pub(super) device: String,
    pub(super) date: String,
    pub(super) model_hash: String,
    /// Resistance of each heater at ambient, as it was measured.
    pub(super) cold_resistance_ohm: [f64; 4],
    /// How far temperatures could be off before that; `None` where it had been measured before.
    pub(super) uncertainty_before_k: Option<[f64; 4]>,
    pub(super) identified: Identification,
    /// Effects of the model that the board does not invert.
    pub(super) not_inverted: Vec<String>,
    /// What the stages that were refined leave of the displacement on the way, root mean square; only a sensor that is read at
    /// every tick tells.
    pub(super) refined_rms_um: Option<f64>,
    pub(super) rest_um: f64,
    /// How far a plate that is asked to be level may tilt in the middle of its range, by what the currents and a square plate of half a
    /// millimetre tell (95 %): a sensor at one spot tells no tilt.
    pub(super) tilt_uncertainty_deg: f64,
    pub(super) range: RangeEnd,
    /// Why the board does not tell the room under the new calibration; `None` where it does.
    pub(super) room_unknown: Option<RoomUnknown>,
    /// By how much the mirror moved from the beginning to the end at the same drives; 0 where that is no more than any mirror does.
    pub(super) moved_um: f64,
    /// What the sensor read on the way, and what of it bore no weight.
    pub(super) readings: ReadingCounts,
    /// The calibration that the board had before.
    pub(super) calibrated_before: String,
    pub(super) before: Figures,
    pub(super) after: Figures,
    #[serde(flatten)]
    pub(super) written: Written,
}

/// The files that were written.
#[derive(Serialize)]
pub(super) struct Written {
    pub(super) calibration: Option<PathBuf>,
    pub(super) model: Option<PathBuf>,
    pub(super) picture: Option<PathBuf>,
    pub(super) trial: Option<PathBuf>,
}

impl fmt::Display for CalibrateReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "mirror     {}, {}, model {}",
            self.device, self.date, self.model_hash
        )?;
        writeln!(f, "before     {}", self.calibrated_before)?;
        writeln!(f, "cold       {}", row(self.cold_resistance_ohm, 1, "Ω"))?;
        if let Some([before_k, ..]) = self.uncertainty_before_k {
            writeln!(
                f,
                "           measured; before, it was known to {:.0} ohm, and temperatures to {before_k:.1} K",
                COLD_RESISTANCE_TOLERANCE.0
            )?;
        }
        write!(f, "{}", Identified(&self.identified))?;
        for left in &self.not_inverted {
            writeln!(f, "  not inverted by the board: {left}")?;
        }
        writeln!(f, "{:<30} {:>10} {:>10}", "", "before", "after")?;
        for figure in figures(&self.before, &self.after) {
            let Figure {
                what,
                unit,
                before,
                after,
            } = figure;
            writeln!(f, "{what:<30} {before:>10.3} {after:>10.3} {unit}")?;
        }
        if let Some(left) = self.refined_rms_um {
            writeln!(
                f,
                "left by the refined stages while moving: {left:.3} um rms"
            )?;
        }
        write!(f, "{}", self.range)?;
        if let Some(why) = &self.room_unknown {
            writeln!(
                f,
                "room       not told under this calibration, and positions are not compensated for it: {why}"
            )?;
        }
        if self.rest_um != 0.0 {
            writeln!(
                f,
                "rest       {:+.2} um from where it was at the beginning, which positions count from, for films were hot for the first time, or relax: \
                 calibrate again, and positions count from where the mirror rests now",
                self.rest_um
            )?;
        }
        writeln!(
            f,
            "tilt       not measured, for one spot tells none: a level plate may tilt by ±{:.1} deg in the middle of the range and twice that at its \
             top if its actuators bend alike to a few percent, by more if one of them is weak; `host-tool calibrate-pose` measures it",
            self.tilt_uncertainty_deg
        )?;
        let beyond = self.after.rests_at_the_highest_drive;
        if beyond > 0 {
            writeln!(
                f,
                "top        {beyond} of the positions at rest took more than the highest drive, for the mirror had not warmed through: they do not count"
            )?;
        }
        if self.moved_um > 0.0 {
            writeln!(
                f,
                "moved      by {:.2} um from the beginning to the end at the same drives: what the board tells of its positions is as much wider; \
                 let sensor, mirror and room come to rest and calibrate again",
                self.moved_um
            )?;
        }
        let counts = &self.readings;
        if counts.without_weight() > 0 {
            writeln!(
                f,
                "sensor     of {} readings {} bore no weight: {counts}",
                counts.asked,
                counts.without_weight()
            )?;
        }
        let files = [
            ("calibration", &self.written.calibration),
            ("model", &self.written.model),
            ("picture", &self.written.picture),
            ("trial", &self.written.trial),
        ];
        for (what, file) in files {
            if let Some(file) = file {
                writeln!(f, "{what:<12} in {}", file.display())?;
            }
        }
        Ok(())
    }
}
