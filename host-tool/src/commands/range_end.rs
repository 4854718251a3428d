//! Where positions end under a new calibration, and why they end earlier than before.

use std::fmt;

use calibration::Drives;
use control_core::shape::SEGMENTS;
use control_core::{CHANNELS, Calibration};
use serde::Serialize;

use crate::report::decimal;

/// A range that ends so much earlier (um) is told: more than a calibration moves it by for what it finds of one mirror again.
const TOLD_UM: f64 = 2.0;
/// An actuator takes the highest drive where it takes this part of it: resistances are refined after tables are made.
const HIGHEST: f64 = 0.98;

/// The ends of the range, and what ends it now.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct RangeEnd {
    before_um: f64,
    after_um: f64,
    /// Up to here the mirror was measured.
    tried_um: f64,
    /// From 1: which takes the highest drive at rest at the end of the range, on a level plate.
    actuator: usize,
    drive_v: f64,
    highest_drive_v: f64,
    /// From 1: which is warmest there.
    warmest: usize,
    rise_k: f64,
    highest_rise_k: f64,
}

impl RangeEnd {
    /// Of a new calibration; the range of the one before ended at `before_um`.
    pub(crate) fn new(before_um: f64, calibration: &Calibration) -> Self {
        let parts = calibration.parts();
        let (actuator, drive_v) = highest(Drives::new(parts).at_top_v());
        let tops = parts
            .actuators
            .each_ref()
            .map(|it| it.shape.knots()[SEGMENTS]);
        let (warmest, rise_k) = highest(tops.map(decimal));
        Self {
            before_um,
            after_um: decimal(calibration.max_position().0),
            tried_um: decimal(parts.residual.tried.0),
            actuator,
            drive_v,
            highest_drive_v: decimal(calibration.max_drive().0),
            warmest,
            rise_k,
            highest_rise_k: decimal(parts.bounds.rise.0),
        }
    }
}

/// The actuator, from 1, that has most, and what it has.
fn highest(each: [f64; CHANNELS]) -> (usize, f64) {
    let all = (1..).zip(each);
    all.max_by(|(_, a), (_, b)| a.total_cmp(b))
        .unwrap_or_default()
}

/// As lines of a report; nothing where the range has not become shorter and was measured.
impl fmt::Display for RangeEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            before_um,
            after_um,
            tried_um,
            actuator,
            drive_v,
            highest_drive_v,
            warmest,
            rise_k,
            highest_rise_k,
        } = self;
        if before_um - after_um > TOLD_UM {
            write!(
                f,
                "range      to {after_um:.1} um, before to {before_um:.1} um: "
            )?;
            if *drive_v >= HIGHEST * highest_drive_v {
                writeln!(
                    f,
                    "actuator {actuator} takes {drive_v:.2} V there at rest, and {highest_drive_v:.2} V is the highest drive; \
                     `host-tool set-drive {highest_drive_v}V` takes the others further, with a tilt"
                )?;
            } else if *rise_k >= HIGHEST * highest_rise_k {
                writeln!(
                    f,
                    "actuator {warmest} is {rise_k:.0} K warm there at rest, and {highest_rise_k:.0} K is the highest rise that the calibration allows"
                )?;
            } else {
                writeln!(
                    f,
                    "the tables end there, though no actuator takes more than {drive_v:.2} V of {highest_drive_v:.2} V; \
                     `host-tool set-drive` goes further, and `host-tool load-calibration` with the file of before brings that range back"
                )?;
            }
        }
        if after_um - tried_um > TOLD_UM {
            writeln!(
                f,
                "above      {tried_um:.1} um, up to {after_um:.1} um, nothing was measured yet, and positions say so; called again, with another \
                 folder and this calibration, it measures there too"
            )?;
        }
        Ok(())
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
            tried_um: 156.2,
            actuator: 2,
            drive_v: 3.49,
            highest_drive_v: 3.5,
            warmest: 3,
            rise_k: 130.1,
            highest_rise_k: 140.2,
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
        assert!(line.contains("tables end there"), "{line}");
        let hot = RangeEnd {
            rise_k: 140.1,
            ..early
        };
        let line = hot.to_string();
        assert!(line.contains("actuator 3 is 140 K warm"), "{line}");
        let nearly = RangeEnd {
            after_um: 172.0,
            tried_um: 172.0,
            ..end
        };
        assert_eq!(nearly.to_string(), "");
        let further = RangeEnd {
            tried_um: 160.0,
            ..nearly
        };
        let line = further.to_string();
        assert!(
            line.starts_with("above      160.0 um, up to 172.0 um"),
            "{line}"
        );
    }
}
