//! What a calibration of poses left of some of them where it was tried, under the last spot, and whether it is to be kept.

use calibration::{PlatePose, Posed};
use calibration_procedure::BROKEN_PROMISE;

use super::readings::Spot;
use crate::error::NotImproved;

/// Every so many of the poses are tried: a dozen. Five poses share a piston, so that these are to all sides.
const EVERY: usize = 6;

/// Some of what belongs to all poses, in their order, and the last, with which the first is compared for drift.
pub(super) fn tried<T: Copy>(of_all: &[T]) -> Vec<T> {
    let some = of_all.iter().step_by(EVERY);
    some.chain(of_all.last()).copied().collect()
}

/// How far the plate was from where it was asked to be under a spot (um, root mean square).
#[derive(Clone, Copy, Debug)]
pub(super) struct Trial {
    /// With the levers that the poses were read with.
    pub(super) before_um: f64,
    /// With what was found.
    pub(super) after_um: f64,
    /// What that promises.
    promised_um: f64,
}

impl Trial {
    /// Of the same poses, read under the same spot: `before` with the levers of before, `after` with what was `found`.
    pub(super) fn new(poses: &[PlatePose], (before, after): (&Spot, &Spot), found: &Posed) -> Self {
        Self {
            before_um: before.off_um(poses),
            after_um: after.off_um(poses),
            promised_um: found.promised_rms_um(after.at_um),
        }
    }

    /// How many times what was promised is left.
    pub(super) fn times_promised(&self) -> f64 {
        self.after_um / self.promised_um
    }

    /// Nothing is kept that is no better than before, or leaves more than its own residuals promise.
    pub(super) fn check(&self) -> Result<(), NotImproved> {
        let Self {
            before_um,
            after_um,
            promised_um,
        } = *self;
        // Not so for NaN.
        let is_better = after_um < before_um;
        if !is_better {
            return Err(NotImproved::PoseNotBetter {
                before_um,
                after_um,
            });
        }
        if self.times_promised() > BROKEN_PROMISE {
            return Err(NotImproved::PosePromiseBroken {
                before_um,
                after_um,
                promised_um,
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_better_or_breaks_its_promise_is_not_kept() {
        let said = |before_um, after_um| {
            let trial = Trial {
                before_um,
                after_um,
                promised_um: 0.1,
            };
            trial.check().map_err(|error| error.to_string())
        };
        assert_eq!(said(3.57, 0.29), Ok(()));
        let worse = said(0.2, 0.25).expect_err("worse");
        assert!(
            worse.contains("0.200 um rms") && worse.contains("0.250 um"),
            "{worse}"
        );
        assert!(said(0.2, f64::NAN).is_err());
        // A sixth better, and thirty times what it promised.
        let broken = said(3.57, 2.99).expect_err("it promised 0.1 um");
        assert!(
            broken.contains("2.990 um rms") && broken.contains("0.100 um"),
            "{broken}"
        );
    }

    #[test]
    fn poses_that_are_tried_are_to_all_sides() {
        // As they are asked for: a reference, five to a piston, and the reference.
        let all: Vec<usize> = (0..62).collect();
        let tried = tried(&all);
        assert_eq!((tried[0], tried[tried.len() - 1]), (0, 61));
        let turns: Vec<usize> = tried[1..6].iter().map(|pose| (pose - 1) % 5).collect();
        assert_eq!(turns, [0, 1, 2, 3, 4]);
    }
}
