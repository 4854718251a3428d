//! Why nothing was stored.

/// Why nothing was stored. What was there before still is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreError {
    /// The payload is longer than [`Store::MAX_BYTES`](crate::Store::MAX_BYTES).
    TooLong,
    /// No slot but that of the record in use took the payload: each read back other bytes than were
    /// written, or failed.
    WornOut,
    /// The flash cannot be read.
    Unreadable,
}
