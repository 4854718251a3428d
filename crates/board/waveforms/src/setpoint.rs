//! What a waveform asks of the control core.

use control_core::{Micrometre, Pose, Radian, Setpoint, Volt};

use crate::player::Played;
use crate::waveform::{Quantity, Shape, Waveform};

impl Waveform {
    /// The setpoint of a tick in which it has played this.
    pub fn setpoint(&self, played: &Played) -> Setpoint {
        let value = played.value;
        if let Quantity::Drive { active, others_v } = self.quantity {
            let drive = |is_active| Volt(if is_active { value } else { others_v });
            return Setpoint::Drive(active.map(drive));
        }
        // A position has no tilts.
        let [tilt_x, tilt_y] = played.tilts.map(Radian);
        let pose = Pose {
            z: Micrometre(value),
            tilt_x,
            tilt_y,
        };
        match self.shape {
            // Steps need a path, anything else is one.
            Shape::Steps(_) => Setpoint::Position(pose),
            Shape::Sine { .. } | Shape::Triangle { .. } | Shape::Lines(_) => Setpoint::Track(pose),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::waveform::{Table, Tilt, Trigger, Triggers};

    const PLAYED: Played = Played {
        value: 2.0,
        tilts: [0.01, -0.02],
        trigger: Trigger::NONE,
    };

    fn waveform(quantity: Quantity, shape: Shape) -> Waveform {
        Waveform {
            quantity,
            shape,
            offset: 0.0,
            amplitude: 1.0,
            cycles: 1,
            ends_off: false,
            triggers: Triggers::default(),
        }
    }

    #[test]
    fn steps_need_a_path_and_anything_else_is_one() {
        let pose = Pose {
            z: Micrometre(2.0),
            tilt_x: Radian(0.01),
            tilt_y: Radian(-0.02),
        };
        let quantity = Quantity::Pose {
            tilts: [Tilt::default(); 2],
        };
        let table = Table {
            points: 2,
            dwell_ticks: 1,
        };
        let asked = |shape| waveform(quantity, shape).setpoint(&PLAYED);
        assert_eq!(asked(Shape::Steps(table)), Setpoint::Position(pose));
        assert_eq!(asked(Shape::Lines(table)), Setpoint::Track(pose));
        let sine = Shape::Sine { frequency_hz: 1.0 };
        assert_eq!(asked(sine), Setpoint::Track(pose));
    }

    #[test]
    fn a_drive_is_of_the_active_actuators_and_the_others_have_theirs() {
        let quantity = Quantity::Drive {
            active: [true, false, true, false],
            others_v: 0.5,
        };
        let sine = Shape::Sine { frequency_hz: 1.0 };
        let drives = [2.0, 0.5, 2.0, 0.5].map(Volt);
        assert_eq!(
            waveform(quantity, sine).setpoint(&PLAYED),
            Setpoint::Drive(drives)
        );
    }
}
