//! Faults: what makes the board turn its outputs off by itself.

use control_core::named;

named! {
    /// One fault that trips the board. `docs/faults/NAME.md` tells a person its cause and remedy.
    pub enum Fault {
        /// No current flows through a heater that is driven.
        OpenHeater = "open-heater",
        /// More current flows than the sense can measure.
        ShortCircuit = "short-circuit",
        /// More current flows than any sound heater takes.
        OverCurrent = "over-current",
        /// The heater's resistance says that it is too hot.
        OverTemperature = "over-temperature",
        /// The resistance is less than half or more than twice that of the cold heater, or current is
        /// sensed where nothing is driven.
        ImplausibleSense = "implausible-sense",
        /// The sensed current does not change while the drive does.
        FrozenSense = "frozen-sense",
        /// The output stages' supply is too low or too high.
        SupplyOutOfRange = "supply-out-of-range",
        /// The control loop misses its ticks.
        TickOverrun = "tick-overrun",
        /// The stored calibration cannot be used.
        CalibrationBad = "calibration-bad",
        /// The watchdog had to reset the board.
        WatchdogReset = "watchdog-reset",
        /// The firmware stopped at a defect that it noticed itself.
        FirmwarePanic = "firmware-panic",
        /// The processor stopped at an access or instruction that is not allowed.
        HardFault = "hard-fault",
        /// The newest stored calibration has rotted; the one before it is whole.
        CalibrationOutdated = "calibration-outdated",
        /// An output stage gave more than any calibration may ask for, and the comparators disabled the outputs.
        OutputOverVoltage = "output-over-voltage",
    }
}

impl Fault {
    /// The code on the wire.
    pub fn code(self) -> u8 {
        self as u8
    }

    /// The fault with this code.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_its_fault() {
        for code in 0..=u8::MAX {
            let fault = Fault::from_code(code);
            assert_eq!(fault.map(Fault::code), fault.map(|_| code));
            assert_eq!(fault.is_some(), usize::from(code) < Fault::ALL.len());
        }
    }
}
