//! Where positions end under a new calibration, and why they end earlier than before.

use std::fmt;

use calibration::Drives;
use control_core::{CHANNELS, Calibration};
use serde::Serialize;

use crate::report::decimal;

/// A range that ends so much earlier (um) is told: more than a calibration moves it by for what it finds of one mirror again.
const TOLD_UM: f64 = 2.0;
/// An actuator takes the highest drive where it takes this part of it: resistances are refined after tables are made.
const HIGHEST: f64 = 0.98;

/// The ends of the range, and the actuator that ends it now.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct RangeEnd {
    before_um: f64,
    after_um: f64,
    /// From 1.
    actuator: usize,
    /// What it takes at rest at the end of the range, on a level plate.
    drive_v: f64,
    highest_drive_v: f64,
}

impl RangeEnd {
    /// Of a new calibration whose range ends with the actuator that takes the highest drive there.
    pub(crate) fn by_drive(before_um: f64, calibration: &Calibration) -> Self {
        let drives_v = Drives::new(calibration.parts()).at_top_v();
        let highest = (0..CHANNELS).max_by(|a, b| drives_v[*a].total_cmp(&drives_v[*b]));
        Self::new(
            before_um,
            calibration,
            &drives_v,
            highest.unwrap_or_default(),
        )
    }

    /// Of one whose range ends with this actuator, from 0.
    pub(crate) fn by_actuator(before_um: f64, calibration: &Calibration, actuator: usize) -> Self {
        let drives_v = Drives::new(calibration.parts()).at_top_v();
        Self::new(before_um, calibration, &drives_v, actuator)
    }

    fn new(
        before_um: f64,
        calibration: &Calibration,
        drives_v: &[f64; CHANNELS],
        actuator: usize,
    ) -> Self {
        Self {
            before_um,
            after_um: decimal(calibration.max_position().0),
            actuator: actuator + 1,
            drive_v: drives_v[actuator],
            highest_drive_v: decimal(calibration.max_drive().0),
        }
    }
}

/// As a line of a report; nothing where the range has not become shorter.
impl fmt::Display for RangeEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            before_um,
            after_um,
            actuator,
            drive_v,
            highest_drive_v,
        } = self;
        if before_um - after_um <= TOLD_UM {
            return Ok(());
        }
        write!(
            f,
            "range      to {after_um:.1} um, before to {before_um:.1} um: "
        )?;
        if *drive_v >= HIGHEST * highest_drive_v {
            writeln!(
                f,
                "actuator {actuator} takes {drive_v:.2} V there at rest, and {highest_drive_v:.2} V is the highest drive; \
                 `host-tool set-drive {highest_drive_v}V` takes the others further, with a tilt"
            )
        } else {
            writeln!(
                f,
                "the table of actuator {actuator} ends there, though it takes {drive_v:.2} V of {highest_drive_v:.2} V; \
                 `host-tool set-drive` goes further, and `host-tool load-calibration` with the file of before brings that range back"
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_that_became_shorter_is_told_with_its_cause() {
        let end = RangeEnd {
            before_um: 173.7,
            after_um: 156.2,
            actuator: 2,
            drive_v: 3.49,
            highest_drive_v: 3.5,
        };
        let line = end.to_string();
        for words in [
            "to 156.2 um, before to 173.7 um",
            "actuator 2 takes 3.49 V there at rest",
            "set-drive 3.5V",
        ] {
            assert!(line.contains(words), "{words}: {line}");
        }
        let early = RangeEnd {
            drive_v: 3.03,
            ..end
        };
        let line = early.to_string();
        assert!(line.contains("table of actuator 2 ends there"), "{line}");
        let nearly = RangeEnd {
            after_um: 172.0,
            ..end
        };
        assert_eq!(nearly.to_string(), "");
    }
}
