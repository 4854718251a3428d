//! How far two computations are from each other.

/// How far the core is from this chain in one tick, the furthest actuator (um).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Apart {
    /// Where the two drives would hold the mirror.
    pub(crate) drive_um: f64,
    /// Where the two drives have taken it.
    pub(crate) mirror_um: f64,
}
