//! How exactly the stages can follow a displacement: the reading's noise, and the discrepancy of the stages themselves.
//!
//! A mirror of distributed heat that rings has more states than the stages. Where they cannot follow it a reading tells
//! little, so it gets a larger standard deviation, and the fit spends its parameters where they count. The discrepancies
//! below are orders of magnitude. What they lead to is measured on five virtual mirrors by
//! `cargo xtask bench position`.

use std::f64::consts::PI;

use control_core::calibration::{Path, Resonance};
use experiments::instruments::POSITION_NOISE_UM;

/// Along a smooth drive (um): as much as the readings' own noise; less would not make the sum smaller by much.
const SMOOTH_UM: f64 = POSITION_NOISE_UM;
/// Under a drive that is held (um): nothing trembles, so friction lets go otherwise than under the control loop, and the four
/// actuators are not at one position.
pub(super) const HELD_UM: f64 = 0.15;
/// Ringing after a jump of the drive (um): a tenth of a range of 100 um.
const RINGING_UM: f64 = 10.0;
/// Moves in which the ringing falls to 1/e where no resonance is known. That takes Q / pi periods, and such a move five: this is a resonance
/// of Q = 31.
const RINGING_MOVES: f64 = 2.0;
/// From so long after a move on (s) what lags behind falls as the inverse of the time: that of a move where no resonance is known.
const LAGGING_S: f64 = 0.01;

/// What the stages leave just after a move: distributed heat, of which a few poles leave a part at every time scale.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lagging {
    /// As a share of the move.
    share: f64,
    /// Besides (um).
    um: f64,
}

impl Lagging {
    /// Of a mirror that the stages follow: 0.2 % of a move, and what friction lets go meanwhile. Chosen by steps and sines of the mirrors
    /// that `docs/figures/positioning.md` names.
    pub(super) const USUAL: Self = Self {
        share: 0.002,
        um: 0.03,
    };
    /// Of one that they do not follow, which creeps by 15 % or whose beams lag by a millisecond: 1 % of a range of 100 um after every
    /// move, so that fast ways do not bend what the stages can follow.
    pub(super) const LARGE: Self = Self {
        share: 0.0,
        um: 1.0,
    };
}

/// What a file says of the drive and of the noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    /// White noise of a reading (um), one standard deviation.
    pub(super) reading_um: f64,
    /// Whether the drive is smooth between the rows, or held and then jumps.
    pub(super) is_smooth: bool,
    /// In which time ringing falls to 1/e (s).
    pub(super) ringing_s: f64,
    /// What lags behind after a move.
    pub(super) lagging: Lagging,
}

/// In which time a mirror that goes to a new position like this rings no more than 1/e of what it did (s).
pub(super) fn ringing_s(path: &Path) -> f64 {
    let Resonance { frequency, quality } = path.resonance;
    match path.resonance.is_known() {
        true => f64::from(quality) / (PI * f64::from(frequency.0)),
        false => RINGING_MOVES * f64::from(path.move_time.0),
    }
}

impl Noise {
    /// One standard deviation (um) of what a reading differs from the stages by, so long after the last jump (s) of the drive
    /// or of the position, where the mirror has moved so far since (um).
    pub(super) fn standard_deviation_um(&self, since_jump_s: f64, moved_um: f64) -> f64 {
        let (discrepancy, transient) = if self.is_smooth {
            let lagging_um = self.lagging.um + self.lagging.share * moved_um;
            (SMOOTH_UM, lagging_um / (1.0 + since_jump_s / LAGGING_S))
        } else {
            (HELD_UM, RINGING_UM * (-since_jump_s / self.ringing_s).exp())
        };
        self.reading_um.hypot(discrepancy).hypot(transient)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMOOTH: Noise = Noise {
        reading_um: 0.0,
        is_smooth: true,
        ringing_s: 0.02,
        lagging: Lagging::USUAL,
    };

    #[test]
    fn the_parts_add_as_squares() {
        let noisy = Noise {
            reading_um: 0.15,
            ..SMOOTH
        };
        // Long after everything: 0.15 and 0.02 um; with a transient of (0.03 + 0.27) / (1 + 2) um 20 ms after a move of 135 um.
        assert!((noisy.standard_deviation_um(1e9, 0.0) - 0.0229_f64.sqrt()).abs() < 1e-9);
        assert!((noisy.standard_deviation_um(0.02, 135.0) - 0.0329_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn after_a_jump_it_falls_to_what_a_held_drive_leaves() {
        let held = Noise {
            is_smooth: false,
            ..SMOOTH
        };
        let at = |moves: f64| held.standard_deviation_um(0.5 * moves * held.ringing_s, 80.0);
        assert!((at(0.0) - RINGING_UM.hypot(HELD_UM)).abs() < 1e-12);
        // Two moves later the ringing has fallen to 1/e.
        assert!((at(2.0) - (RINGING_UM / std::f64::consts::E).hypot(HELD_UM)).abs() < 1e-12);
        assert!((at(1e3) - HELD_UM).abs() < 1e-12);
    }
}
