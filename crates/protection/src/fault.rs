//! Faults: what makes the board turn its outputs off by itself.

/// One fault that trips the board. `docs/faults/NAME.md` tells a person its cause and remedy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// No current flows through a heater that is driven.
    OpenHeater = 0,
    /// More current flows than the sense can measure.
    ShortCircuit = 1,
    /// More current flows than any sound heater takes.
    OverCurrent = 2,
    /// The heater's resistance says that it is too hot.
    OverTemperature = 3,
    /// The resistance is less than half or more than twice that of the cold heater, or current is
    /// sensed where nothing is driven.
    ImplausibleSense = 4,
    /// The sensed current does not change while the drive does.
    FrozenSense = 5,
    /// The output stages' supply is too low or too high.
    SupplyOutOfRange = 6,
    /// The control loop misses its ticks.
    TickOverrun = 7,
    /// The stored calibration cannot be used.
    CalibrationBad = 8,
    /// The watchdog had to reset the board.
    WatchdogReset = 9,
    /// The firmware stopped at a defect that it noticed itself.
    FirmwarePanic = 10,
    /// The processor stopped at an access or instruction that is not allowed.
    HardFault = 11,
}

impl Fault {
    /// Every fault, in the order of its code.
    pub const ALL: [Self; 12] = [
        Self::OpenHeater,
        Self::ShortCircuit,
        Self::OverCurrent,
        Self::OverTemperature,
        Self::ImplausibleSense,
        Self::FrozenSense,
        Self::SupplyOutOfRange,
        Self::TickOverrun,
        Self::CalibrationBad,
        Self::WatchdogReset,
        Self::FirmwarePanic,
        Self::HardFault,
    ];

    /// The code on the wire.
    pub fn code(self) -> u8 {
        self as u8
    }

    /// The fault with this code.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }

    /// The name that people see and scripts use.
    pub fn name(self) -> &'static str {
        match self {
            Self::OpenHeater => "open-heater",
            Self::ShortCircuit => "short-circuit",
            Self::OverCurrent => "over-current",
            Self::OverTemperature => "over-temperature",
            Self::ImplausibleSense => "implausible-sense",
            Self::FrozenSense => "frozen-sense",
            Self::SupplyOutOfRange => "supply-out-of-range",
            Self::TickOverrun => "tick-overrun",
            Self::CalibrationBad => "calibration-bad",
            Self::WatchdogReset => "watchdog-reset",
            Self::FirmwarePanic => "firmware-panic",
            Self::HardFault => "hard-fault",
        }
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
