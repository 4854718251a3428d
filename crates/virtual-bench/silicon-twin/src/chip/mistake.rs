//! Mistakes that a driver could have.

/// A mistake that a driver could have: in a register it writes other bits, wherever it writes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// The register's address.
    pub address: u32,
    /// The bits that are written otherwise.
    pub bits: u32,
    /// What they are written as; no write at all where there is none.
    pub value: Option<u32>,
}
