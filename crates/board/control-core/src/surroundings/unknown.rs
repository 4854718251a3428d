//! What is not known of the surroundings, as it acts on one actuator's stages.

use super::apart::Apart;
use super::curves::{CURVES_DEVIATION, beyond_the_curves};
use super::{FIRST_ORDER, Surroundings};
use crate::units::Kelvin;

/// How far a room may be from that of the calibration where no resistance tells it: an air-conditioned laboratory is within 6 K
/// in 95 of 100 cases (the project's choice).
const LABORATORY: Kelvin = Kelvin(3.0);
/// Part of what a changed loss takes of an actuator by which it bends otherwise than its resistance tells, for the profile of temperature along
/// the beam is another: 1 to 2 % on three virtual mirrors, 9 % on one whose loss is uneven along it (standard deviation).
const OF_PROFILE: f32 = 0.05;

/// Standard uncertainties of the rise that an actuator's stages need.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unknown {
    /// By which all four err the same way, each as much as it is warm.
    pub(crate) of_all: Kelvin,
    /// By which one errs apart from the others: what its thermometer tells.
    pub(crate) own: Kelvin,
    /// And how far off it may be where heaters have drifted, from which the room was taken.
    pub(crate) drifted: Kelvin,
}

impl Surroundings {
    /// The standard uncertainties of the rise that an actuator's stages need for `asked`, where what a kelvin of the surroundings is worth
    /// has this one, and they are compensated if that is wanted and possible.
    pub(crate) fn uncertainty(
        &self,
        actuator: usize,
        asked: Kelvin,
        (ratio, is_compensated): (f32, bool),
    ) -> Unknown {
        let reference = &self.references[actuator];
        let heating = reference.heating(asked);
        let of_filter = self.filter.variance(heating);
        let difference = self.filter.room - self.filter.loss * heating;
        let (of_all, own) = if !self.is_known() {
            (LABORATORY.0 * LABORATORY.0, 0.0)
        } else if is_compensated && self.is_used {
            let Apart {
                counted: own,
                unknown,
                ..
            } = self.apart[actuator];
            let compensated = difference + own;
            let counted = beyond_the_curves(compensated, unknown);
            // What is not compensated may be the curves' own error, and what is compensated has it.
            let left = compensated - counted;
            let curves = if compensated == 0.0 {
                0.0
            } else {
                CURVES_DEVIATION.0 * counted / compensated
            };
            let worth = ratio * self.filter.room;
            let order = FIRST_ORDER * compensated;
            let profile = OF_PROFILE * self.filter.loss * heating;
            let parts = [left, worth, order, profile].map(|part| part * part);
            let of_all = of_filter + parts.iter().sum::<f32>();
            (of_all, unknown + curves * curves)
        } else {
            (of_filter + difference * difference, 0.0)
        };
        let per_slope = 1.0 / reference.loss_slope(asked);
        Unknown {
            of_all: Kelvin(fpu::sqrt(of_all) * per_slope),
            own: Kelvin(fpu::sqrt(own) * per_slope),
            drifted: Kelvin(self.drift.apart() * per_slope),
        }
    }
}
