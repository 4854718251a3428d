//! What a calibration leaves unknown of its mirror.

use control_core::calibration::{Parts, Residual};
use control_core::{Calibration, CalibrationError, Micrometre};

/// Of a calibration that nobody has tried on the mirror: mirrors of one design are apart by some percent (the paper's four actuators
/// bend by 3 % unlike each other; the factory's table is off by as much, bench `position`).
pub(crate) const UNTRIED: Residual = Residual {
    piston: Micrometre(0.3),
    tried: Micrometre(0.0),
    part: 0.03,
    apart: 0.03,
    ambient_ratio: UNMEASURED_RATIO,
};

/// Of the usual ambient ratio: where the heater runs along the whole beam mirrors are up to 0.01 from it, where it leaves the overlaps
/// cold 0.04, where the loss is uneven 0.18 (the middles of `docs/theory/surroundings.md`). Of one kind as likely as another that is 0.1.
const UNMEASURED_RATIO: f32 = 0.1;
/// Of one that was measured in another room: two more rooms leave a hundredth (bench `position`).
pub(crate) const MEASURED_RATIO: f32 = 0.01;

/// No trial shows that less is left (um): displacement sensors and the core's own arithmetic are not better.
pub(crate) const LEAST_UM: f64 = 0.005;

/// `calibration`, which left so much at rest where it was tried (um, root mean square).
///
/// # Errors
/// Where that is no number that a mirror can have.
pub fn with_piston_residual(
    calibration: &Calibration,
    rest_rms_um: f64,
) -> Result<Calibration, CalibrationError> {
    let parts = calibration.parts();
    Calibration::new(Parts {
        residual: Residual {
            piston: Micrometre(rest_rms_um.max(LEAST_UM) as f32),
            tried: calibration.max_position(),
            part: UNTRIED.part,
            ..parts.residual
        },
        ..*parts
    })
}

/// `calibration`, which left so many times what it promises where it was tried. One that left less promises no less.
///
/// # Errors
/// Where that is no number that a mirror can have.
pub fn with_broken_promise(
    calibration: &Calibration,
    times: f64,
) -> Result<Calibration, CalibrationError> {
    let parts = calibration.parts();
    let times = times.max(1.0) as f32;
    Calibration::new(Parts {
        residual: Residual {
            piston: Micrometre(times * parts.residual.piston.0),
            apart: times * parts.residual.apart,
            ..parts.residual
        },
        ..*parts
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use mirror_model::{Model, Preset};

    #[test]
    fn a_promise_that_was_broken_is_made_larger_and_one_that_was_kept_stays() {
        let tabulated = crate::tabulate(&Model::from(Preset::Reconciled)).expect("it tabulates");
        let residual = |times| {
            let noted = with_broken_promise(&tabulated.calibration, times);
            noted.expect("a mirror can have it").parts().residual
        };
        assert_eq!(residual(0.5), UNTRIED);
        let broken = residual(2.0);
        assert_eq!(broken.piston.0, 2.0 * UNTRIED.piston.0);
        assert_eq!(broken.apart, 2.0 * UNTRIED.apart);
    }
}
