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
/// Distributed heat after a move (um): a few poles leave a part at every time scale, 1 % of a range of 100 um, which falls as
/// the inverse of the time, from so long on (s): that of a move where no resonance is known.
const LAGGING_UM: f64 = 1.0;
const LAGGING_S: f64 = 0.01;

/// What a file says of the drive and of the noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    /// White noise of a reading (um), one standard deviation.
    pub(super) reading_um: f64,
    /// Whether the drive is smooth between the rows, or held and then jumps.
    pub(super) is_smooth: bool,
    /// In which time ringing falls to 1/e (s).
    pub(super) ringing_s: f64,
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
    /// or of the position.
    pub(super) fn standard_deviation_um(&self, since_jump_s: f64) -> f64 {
        let (discrepancy, transient) = if self.is_smooth {
            (SMOOTH_UM, LAGGING_UM / (1.0 + since_jump_s / LAGGING_S))
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
    };

    #[test]
    fn the_parts_add_as_squares() {
        let noisy = Noise {
            reading_um: 0.15,
            ..SMOOTH
        };
        // Long after everything: 0.15 and 0.02 um; with a transient of 1 / (1 + 4) um after 40 ms.
        assert!((noisy.standard_deviation_um(1e9) - 0.0229_f64.sqrt()).abs() < 1e-9);
        assert!((noisy.standard_deviation_um(0.04) - 0.0629_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn after_a_jump_it_falls_to_what_a_held_drive_leaves() {
        let held = Noise {
            is_smooth: false,
            ..SMOOTH
        };
        let at = |moves: f64| held.standard_deviation_um(0.5 * moves * held.ringing_s);
        assert!((at(0.0) - RINGING_UM.hypot(HELD_UM)).abs() < 1e-12);
        // Two moves later the ringing has fallen to 1/e.
        assert!((at(2.0) - (RINGING_UM / std::f64::consts::E).hypot(HELD_UM)).abs() < 1e-12);
        assert!((at(1e3) - HELD_UM).abs() < 1e-12);
    }
}
