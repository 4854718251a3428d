//! Whether a calibration that was tried is to be kept.

/// The root mean squares of two trials of a quick calibration, eight positions each, differ by less than this in 99 of 100:
/// the root of the F distribution's 99 % quantile at 8 and 8 degrees of freedom, 6.03.
const BY_CHANCE: f64 = 2.5;
/// Errors at rest of so many times what the residuals promise are no chance: eight positions come to 1.6 times in one of a
/// hundred (chi-squared), and positions that were not refined at may be twice as far off.
const BROKEN_PROMISE: f64 = 3.0;

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

impl Doubt {
    /// Compares what a trial of a new calibration left at rest with what one of the calibration before left, and with what the
    /// refinement promises, where it promises anything (um, root mean squares).
    pub(crate) fn of(
        before_rms_um: f64,
        after_rms_um: f64,
        promised_rms_um: Option<f64>,
    ) -> Result<(), Self> {
        if after_rms_um > BY_CHANCE * before_rms_um {
            return Err(Self::WorseThanBefore {
                before_rms_um,
                after_rms_um,
            });
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

    #[test]
    fn what_is_worse_by_more_than_chance_is_doubted() {
        let doubt = |before_um, after_um| Doubt::of(before_um, after_um, None);
        assert_eq!(doubt(18.0, 0.05), Ok(()));
        assert_eq!(doubt(0.03, 0.05), Ok(()));
        assert!(matches!(
            doubt(0.05, 5.4),
            Err(Doubt::WorseThanBefore { .. })
        ));
    }

    #[test]
    fn what_breaks_its_own_promise_is_doubted() {
        let doubt = |after_um| Doubt::of(18.0, after_um, Some(0.153));
        assert_eq!(doubt(0.2), Ok(()));
        let said = doubt(5.4).expect_err("a hundred times as much").to_string();
        assert_eq!(
            said,
            "at rest the mirror is 5.400 um rms off under the new calibration, which promised 0.153 um where it was made"
        );
    }
}
