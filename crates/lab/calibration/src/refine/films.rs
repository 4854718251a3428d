//! What kinds of films there are.

/// What a mirror's films do beside bending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Films {
    /// They come back to where displacements count from, creep goes on, and they slip a little way.
    Usual,
    /// They may rest elsewhere since they were hot for the first time, creep may go back as where aluminium relaxes, and they may slip all over.
    Unusual,
}
