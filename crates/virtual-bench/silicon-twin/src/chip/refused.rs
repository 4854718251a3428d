//! Why a register cannot be read or written.

/// What ends the run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Refused {
    /// The model has no such register, or not this use of it.
    NotModelled,
    /// The chip is used as its manual says that it must not be.
    Misuse(String),
}

pub(crate) type Access<T = ()> = Result<T, Refused>;

/// The chip is used wrongly: what is wrong, and where the manual says so.
pub(crate) fn misuse<T>(sentence: impl Into<String>) -> Access<T> {
    Err(Refused::Misuse(sentence.into()))
}

/// Fails where bits are written whose effect is not modelled.
pub(crate) fn only(value: u32, modelled: u32) -> Access<u32> {
    match value & !modelled {
        0 => Ok(value),
        _ => Err(Refused::NotModelled),
    }
}
