//! Why a board does not tell the room under a new calibration, so that nobody looks for it in vain.

use std::fmt;

use control_core::Calibration;
use serde::Serialize;

/// Why a board does not tell the room under a calibration.
#[derive(Serialize)]
pub(super) struct RoomUnknown {
    /// Actuators whose resistance does not rise all the way with their heat, counted from 1; none where no sensor was read at every tick.
    actuators: Vec<usize>,
}

impl RoomUnknown {
    /// That of a calibration, if it has any.
    pub(super) fn of(calibration: &Calibration, reads_every_tick: bool) -> Option<Self> {
        let parts = calibration.parts();
        let unknown = (1..).zip(&parts.actuators);
        let unknown = unknown.filter(|(_, it)| reads_every_tick && !it.sensed_rises.is_known());
        (parts.ambient_ratio == 0.0).then(|| Self {
            actuators: unknown.map(|(actuator, _)| actuator).collect(),
        })
    }
}

impl fmt::Display for RoomUnknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let actuators: Vec<String> = self.actuators.iter().map(usize::to_string).collect();
        let of_which = match &actuators[..] {
            [] => {
                return write!(
                    f,
                    "that takes a sensor on the board's own input, which is read at every tick"
                );
            }
            [one] => format!("actuator {one}"),
            several => format!("actuators {}", several.join(", ")),
        };
        write!(
            f,
            "the resistance of {of_which} does not rise all the way with its heat. Is a contact or a wire loose? Mend it, and calibrate again"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibration::tabulate;
    use control_core::calibration::SensedRises;
    use mirror_model::{Model, Preset};

    #[test]
    fn a_resistance_that_does_not_rise_is_named_and_so_is_a_sensor_that_is_too_slow() {
        let tabulated = tabulate(&Model::from(Preset::Reconciled)).expect("it has an inverse");
        let mut parts = *tabulated.calibration.parts();
        let known = SensedRises {
            top: control_core::Kelvin(100.0),
            knots: std::array::from_fn(|knot| 100.0 / 16.0 * knot as f32),
        };
        parts
            .actuators
            .iter_mut()
            .for_each(|it| it.sensed_rises = known);
        let of = |parts, reads_every_tick| {
            let calibration = Calibration::new(parts).expect("a mirror's");
            RoomUnknown::of(&calibration, reads_every_tick).map(|it| it.to_string())
        };
        parts.ambient_ratio = 1.0;
        assert_eq!(of(parts, true), None);
        parts.ambient_ratio = 0.0;
        parts.actuators[2].sensed_rises = SensedRises::UNKNOWN;
        let said = of(parts, true).expect("unknown");
        assert!(
            said.contains("the resistance of actuator 3 does not rise"),
            "{said}"
        );
        parts.actuators[0].sensed_rises = SensedRises::UNKNOWN;
        let said = of(parts, true).expect("unknown");
        assert!(said.contains("of actuators 1, 3 does"), "{said}");
        let said = of(parts, false).expect("unknown");
        assert!(said.contains("read at every tick"), "{said}");
    }
}
