//! Exceptions by their numbers, and faults: what the processor refuses to do (ARMv7-M manual, sections B1.5 and B3.2.15).

use std::fmt;

/// Exception numbers (table B1-4).
pub(crate) const NMI: u16 = 2;
pub(crate) const HARD_FAULT: u16 = 3;
pub(crate) const BUS_FAULT: u16 = 5;
pub(crate) const USAGE_FAULT: u16 = 6;
pub(crate) const SUPERVISOR_CALL: u16 = 11;
pub(crate) const FIRST_INTERRUPT: u16 = 16;

/// Priority of a thread that masks nothing: below all.
pub(crate) const IDLE: i16 = 256;

/// CFSR's flags (section B3.2.15).
mod status {
    pub(super) const INSTRUCTION_BUS: u32 = 1 << 8;
    pub(super) const PRECISE: u32 = 1 << 9;
    pub(super) const ADDRESS_VALID: u32 = 1 << 15;
    pub(super) const UNDEFINED: u32 = 1 << 16;
    pub(super) const INVALID_STATE: u32 = 1 << 17;
    pub(super) const INVALID_RETURN: u32 = 1 << 18;
    pub(super) const NO_COPROCESSOR: u32 = 1 << 19;
    pub(super) const UNALIGNED: u32 = 1 << 24;
    pub(super) const DIVISION_BY_ZERO: u32 = 1 << 25;
}

/// Something that the processor refuses to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    pub(crate) exception: u16,
    /// What is set in CFSR.
    pub(crate) status: u32,
    /// Where, for an access or a branch.
    pub(crate) address: Option<u32>,
}

impl Fault {
    pub(crate) fn fetch(address: u32) -> Self {
        Self::new(BUS_FAULT, status::INSTRUCTION_BUS, Some(address))
    }

    pub(crate) fn data(address: u32) -> Self {
        let status = status::PRECISE | status::ADDRESS_VALID;
        Self::new(BUS_FAULT, status, Some(address))
    }

    pub(crate) fn undefined() -> Self {
        Self::new(USAGE_FAULT, status::UNDEFINED, None)
    }

    pub(crate) fn invalid_state(target: u32) -> Self {
        Self::new(USAGE_FAULT, status::INVALID_STATE, Some(target))
    }

    pub(crate) fn invalid_return(target: u32) -> Self {
        Self::new(USAGE_FAULT, status::INVALID_RETURN, Some(target))
    }

    pub(crate) fn no_coprocessor() -> Self {
        Self::new(USAGE_FAULT, status::NO_COPROCESSOR, None)
    }

    pub(crate) fn unaligned(address: u32) -> Self {
        Self::new(USAGE_FAULT, status::UNALIGNED, Some(address))
    }

    pub(crate) fn division_by_zero() -> Self {
        Self::new(USAGE_FAULT, status::DIVISION_BY_ZERO, None)
    }

    fn new(exception: u16, status: u32, address: Option<u32>) -> Self {
        Self {
            exception,
            status,
            address,
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let address = self.address.unwrap_or_default();
        match self.status & !status::ADDRESS_VALID {
            status::INSTRUCTION_BUS => write!(f, "there is no code at {address:#010x}"),
            status::PRECISE => write!(f, "there is nothing at address {address:#010x}"),
            status::UNDEFINED => write!(f, "undefined instruction"),
            status::INVALID_STATE => write!(f, "branch to {address:#010x}, which is no Thumb code"),
            status::INVALID_RETURN => write!(f, "return from an exception by {address:#010x}"),
            status::NO_COPROCESSOR => write!(f, "the floating-point unit is off (CPACR)"),
            status::UNALIGNED => write!(f, "{address:#010x} is not aligned"),
            _ => write!(f, "division by zero"),
        }
    }
}
