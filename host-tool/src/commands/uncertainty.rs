//! How far the plate may be from where it is asked to be, and when it will have settled, as the board tells.

use std::fmt;

use control_core::{Limit, Limits};
use mirror_protocol::Telemetry;
use serde::Serialize;

/// What a sample tells of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Uncertainty {
    /// Half the width of the interval that holds the piston in 95 of 100 cases; `None` where the calibration does not say what it
    /// leaves, and where a limit keeps the mirror away from what was asked for, for good or until it has cooled.
    pub(crate) z_um: Option<f64>,
    /// The same of either tilt, where the plate's levers are known.
    pub(crate) tilt_deg: Option<f64>,
    /// Until the plate has settled; 0: it has. `None` where no position is asked for, where a limit keeps it away, and where
    /// the calibration was never tried on the mirror.
    pub(crate) settles_in_s: Option<f64>,
    /// The mirror comes down no faster than it cools, and nobody can tell when it will be there.
    #[serde(skip)]
    pub(crate) cools: bool,
    /// The same two once it is there.
    #[serde(skip)]
    pub(crate) once_cooled: Option<(f64, Option<f64>)>,
    /// A limit keeps the mirror away for good.
    #[serde(skip)]
    pub(crate) is_away: bool,
}

/// The highest number that a board tells stands for more as well (`mirror_protocol::Uncertainty`), and so does what rounds to it.
const MOST_UM: f64 = 65.0;

/// Limits under which the mirror is, or will be, where it was asked to be.
const NOT_AWAY: [Limit; 3] = [
    Limit::Cooling,
    Limit::ResistanceUnknown,
    Limit::CalibrationDrifted,
];

impl From<&Telemetry> for Uncertainty {
    fn from(sample: &Telemetry) -> Self {
        let limits = Limits::from_bits(sample.limits);
        let is_away =
            sample.settles_in_ms.is_none() && limits.iter().any(|limit| !NOT_AWAY.contains(&limit));
        let told = sample.uncertainty.filter(|_| !is_away).map(|told| {
            let tilt_deg = (f64::from(told.tilt_urad) * 1e-6).to_degrees();
            let tilt_deg = sample.pose.tilt_rad.map(|_| tilt_deg);
            (f64::from(told.z_nm) * 1e-3, tilt_deg)
        });
        let cools = limits.contains(Limit::Cooling);
        let (now, once_cooled) = match cools && sample.settles_in_ms.is_none() {
            true => (None, told),
            false => (told, None),
        };
        Self {
            z_um: now.map(|(z_um, _)| z_um),
            tilt_deg: now.and_then(|(_, tilt_deg)| tilt_deg),
            settles_in_s: sample.settles_in_ms.map(|ms| f64::from(ms) * 1e-3),
            cools,
            once_cooled,
            is_away,
        }
    }
}

impl Uncertainty {
    /// The same of a position that was asked for: heaters that are not driven and do not settle are warmer than it asks, by however little.
    pub(crate) fn of_position(sample: &Telemetry) -> Self {
        let told = Self::from(sample);
        let is_undriven = sample.drive_v.iter().all(|v| *v == 0.0);
        Self {
            cools: told.cools || (told.settles_in_s.is_none() && is_undriven),
            ..told
        }
    }

    /// Of piston and tilt, once the plate is where no limit keeps it from for good.
    pub(crate) fn once_there(&self) -> Option<(f64, Option<f64>)> {
        let now = self.z_um.map(|z_um| (z_um, self.tilt_deg));
        now.or(self.once_cooled)
    }

    /// When it settles, in words.
    pub(crate) fn settling(&self) -> Option<String> {
        self.settles_in_s.map(|settles_in_s| {
            if settles_in_s > 0.0 {
                format!("settles in {:.0} ms", 1e3 * settles_in_s)
            } else {
                "settled".to_owned()
            }
        })
    }
}

/// As the line of a report.
impl fmt::Display for Uncertainty {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_away {
            return f.write_str("a limit holds the mirror elsewhere than where it was asked to be");
        }
        let Some((z_um, tilt_deg)) = self.once_there() else {
            return f.write_str(
                "not known: the calibration does not say what it leaves; `host-tool calibrate` makes one that does",
            );
        };
        match z_um < MOST_UM {
            true => write!(f, "{z_um:>9.3} um")?,
            false => write!(f, "more than {MOST_UM:.0} um")?,
        }
        if let Some(tilt_deg) = tilt_deg {
            write!(f, ", {tilt_deg:.4} deg")?;
        }
        f.write_str(" either way in 95 of 100 cases")?;
        match self.settling() {
            Some(settling) => write!(f, "; {settling}"),
            None if self.cools => f.write_str(
                " once it has cooled, which nobody can tell when; until then it is higher",
            ),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_protocol::{Pose, Uncertainty as Told};

    #[test]
    fn is_told_as_far_as_it_is_known() {
        let mut sample = Telemetry::default();
        let line = |sample: &Telemetry| Uncertainty::from(sample).to_string();
        assert!(line(&sample).starts_with("not known"));
        sample.uncertainty = Some(Told {
            z_nm: 84,
            tilt_urad: 35,
        });
        assert_eq!(line(&sample), "    0.084 um either way in 95 of 100 cases");
        assert!(
            Uncertainty::of_position(&sample)
                .to_string()
                .ends_with("until then it is higher"),
            "nothing is driven, and it does not settle"
        );
        let mut unknown = sample;
        unknown.uncertainty = Some(Told {
            z_nm: u16::MAX,
            tilt_urad: 35,
        });
        assert_eq!(
            line(&unknown),
            "more than 65 um either way in 95 of 100 cases"
        );
        let mut limits = Limits::from_bits(0);
        limits.insert(Limit::Cooling);
        sample.limits = limits.bits();
        assert!(
            line(&sample).ends_with(
                "once it has cooled, which nobody can tell when; until then it is higher"
            )
        );
        assert_eq!(Uncertainty::from(&sample).z_um, None);
        limits.insert(Limit::RoomWarm);
        sample.limits = limits.bits();
        let away = Uncertainty::from(&sample);
        assert_eq!((away.z_um, away.tilt_deg), (None, None));
        assert!(line(&sample).starts_with("a limit holds the mirror elsewhere"));
        sample.settles_in_ms = Some(12);
        sample.pose = Pose {
            z_um: 120.0,
            tilt_rad: Some([0.0; 2]),
        };
        assert_eq!(
            line(&sample),
            "    0.084 um, 0.0020 deg either way in 95 of 100 cases; settles in 12 ms"
        );
        sample.settles_in_ms = Some(0);
        assert!(line(&sample).ends_with("; settled"));
    }
}
