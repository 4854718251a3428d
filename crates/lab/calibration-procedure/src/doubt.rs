//! Whether a calibration that was tried is to be kept.

/// The root mean squares of two trials of a quick calibration, eight positions each, differ by less than this in 99 of 100:
/// the root of the F distribution's 99 % quantile at 8 and 8 degrees of freedom, 6.03.
const BY_CHANCE: f64 = 2.5;
/// Errors at rest of so many times what the residuals promise are no chance: eight positions come to 1.6 times in one of a
/// hundred (chi-squared), and positions that were not refined at may be twice as far off.
pub const BROKEN_PROMISE: f64 = 3.0;
/// What moves may leave however good the calibration before was, figure by figure: what is required of positioning
/// (`docs/requirements.md`).
const OVERSHOOT_PERCENT: f64 = 1.0;
const LOOP_UM: f64 = 0.25;
const TRIANGLE_RMS_UM: f64 = 0.5;

/// Why a calibration is not kept. The positions of the trial are others than those that it was made from.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Doubt {
    /// The one before positions better.
    #[error(
        "at rest the mirror is {after_rms_um:.3} um rms off under the new calibration, and {before_rms_um:.3} um under the one before"
    )]
    WorseThanBefore {
        /// Error at rest under the one before (um, root mean square).
        before_rms_um: f64,
        /// Under the new one (um, root mean square).
        after_rms_um: f64,
    },
    /// The one before moves better.
    #[error(
        "{figure} is {after:.3} {unit} under the new calibration, and {before:.3} {unit} under the one before"
    )]
    MovesWorse {
        /// Which figure.
        figure: &'static str,
        /// Its unit.
        unit: &'static str,
        /// Under the one before.
        before: f64,
        /// Under the new one.
        after: f64,
    },
    /// It does not do what it did where it was refined.
    #[error(
        "at rest the mirror is {after_rms_um:.3} um rms off under the new calibration, which promised {promised_rms_um:.3} um where it was made"
    )]
    BrokenPromise {
        /// What the refinement left (um, root mean square).
        promised_rms_um: f64,
        /// Error at rest (um, root mean square).
        after_rms_um: f64,
    },
}

/// What a trial left of what was asked.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Left {
    /// Error at rest (um, root mean square).
    pub(crate) rest_rms_um: f64,
    /// Beyond the end of a step, in per cent of it.
    pub(crate) overshoot_percent: f64,
    /// Width of the loop at 20 Hz (um).
    pub(crate) loop_um: f64,
    /// Error along a triangle of 20 Hz (um, root mean square).
    pub(crate) triangle_rms_um: f64,
}

impl Doubt {
    /// Compares what a trial of a new calibration left with what one of the calibration before left, and with what the refinement
    /// promises of the mirror at rest (um, root mean square), where it promises anything.
    pub(crate) fn of(
        before: &Left,
        after: &Left,
        promised_rms_um: Option<f64>,
    ) -> Result<(), Self> {
        let (before_rms_um, after_rms_um) = (before.rest_rms_um, after.rest_rms_um);
        if after_rms_um > BY_CHANCE * before_rms_um {
            return Err(Self::WorseThanBefore {
                before_rms_um,
                after_rms_um,
            });
        }
        let moves = [
            (
                "the overshoot of a step",
                "%",
                OVERSHOOT_PERCENT,
                before.overshoot_percent,
                after.overshoot_percent,
            ),
            (
                "the loop at 20 Hz",
                "um",
                LOOP_UM,
                before.loop_um,
                after.loop_um,
            ),
            (
                "the error along a triangle of 20 Hz",
                "um rms",
                TRIANGLE_RMS_UM,
                before.triangle_rms_um,
                after.triangle_rms_um,
            ),
        ];
        for (figure, unit, allowed, before, after) in moves {
            if after > BY_CHANCE * before.max(allowed) {
                return Err(Self::MovesWorse {
                    figure,
                    unit,
                    before,
                    after,
                });
            }
        }
        match promised_rms_um {
            Some(promised_rms_um) if after_rms_um > BROKEN_PROMISE * promised_rms_um => {
                Err(Self::BrokenPromise {
                    promised_rms_um,
                    after_rms_um,
                })
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_rest(rest_rms_um: f64) -> Left {
        Left {
            rest_rms_um,
            overshoot_percent: 0.0,
            loop_um: 0.0,
            triangle_rms_um: 0.0,
        }
    }

    #[test]
    fn what_is_worse_by_more_than_chance_is_doubted() {
        let doubt = |before_um, after_um| Doubt::of(&at_rest(before_um), &at_rest(after_um), None);
        assert_eq!(doubt(18.0, 0.05), Ok(()));
        assert_eq!(doubt(0.03, 0.05), Ok(()));
        assert!(matches!(
            doubt(0.05, 5.4),
            Err(Doubt::WorseThanBefore { .. })
        ));
    }

    /// What a sensor 2 ms late made of a mirror: it was as good at rest, and swung beyond where it was sent.
    #[test]
    fn what_moves_worse_is_doubted_however_well_it_rests() {
        let moving = |overshoot_percent, triangle_rms_um| Left {
            overshoot_percent,
            triangle_rms_um,
            ..at_rest(0.05)
        };
        let doubt = |after: &Left| Doubt::of(&moving(0.4, 0.1), after, None);
        assert_eq!(doubt(&moving(1.1, 0.6)), Ok(()));
        assert!(matches!(
            doubt(&moving(10.8, 0.1)),
            Err(Doubt::MovesWorse { unit: "%", .. })
        ));
        let said = doubt(&moving(0.4, 2.04))
            .expect_err("a late triangle")
            .to_string();
        assert_eq!(
            said,
            "the error along a triangle of 20 Hz is 2.040 um rms under the new calibration, and 0.100 um rms under the one before"
        );
        // A mirror that was worse before.
        assert_eq!(
            Doubt::of(&moving(0.4, 6.8), &moving(0.4, 2.04), None),
            Ok(())
        );
    }

    #[test]
    fn what_breaks_its_own_promise_is_doubted() {
        let doubt = |after_um| Doubt::of(&at_rest(18.0), &at_rest(after_um), Some(0.153));
        assert_eq!(doubt(0.2), Ok(()));
        let said = doubt(5.4).expect_err("a hundred times as much").to_string();
        assert_eq!(
            said,
            "at rest the mirror is 5.400 um rms off under the new calibration, which promised 0.153 um where it was made"
        );
    }
}
