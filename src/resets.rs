//! How many starts there were one right after the other, counted in memory that a reset leaves as it is. A loop of resets
//! must not wear out the flash in which starts are logged.

#![cfg_attr(
    target_os = "none",
    expect(unsafe_code, reason = "memory that no variable may own")
)]

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Tells counts from what memory holds at power-on.
const MAGIC: u32 = 0x5e7_5e7a;

/// The counts.
#[derive(Debug, Default)]
#[repr(C)]
pub struct Resets {
    /// What [`check`] makes of the others.
    check: AtomicU32,
    in_succession: AtomicU32,
    untold: AtomicU32,
}

fn check(in_succession: u32, untold: u32) -> u32 {
    MAGIC ^ in_succession ^ untold.rotate_left(16)
}

impl Resets {
    /// The counts of the image, in the last bytes of RAM (`RESETS` in each board's `memory.x`).
    #[cfg(target_os = "none")]
    pub fn of_the_image() -> &'static Self {
        unsafe extern "C" {
            static RESETS: Resets;
        }
        // SAFETY: the linker keeps this memory for it, aligned, and any bytes are counts.
        unsafe { &RESETS }
    }

    /// Whether the counts outlived what came before this start: it was a reset, and the power stayed.
    pub fn are_kept(&self) -> bool {
        let (in_succession, untold) = self.counts();
        self.check.load(Relaxed) == check(in_succession, untold)
    }

    /// Counts a start; how many there were in succession, with this one.
    pub fn count(&self) -> u32 {
        let (in_succession, untold) = match self.are_kept() {
            true => self.counts(),
            false => (0, 0),
        };
        let in_succession = in_succession.saturating_add(1);
        self.set(in_succession, untold);
        in_succession
    }

    /// Starts before this one that were not logged.
    pub fn untold(&self) -> u32 {
        self.counts().1
    }

    /// This start is not logged.
    pub fn leave_untold(&self) {
        let (in_succession, untold) = self.counts();
        self.set(in_succession, untold.saturating_add(1));
    }

    /// This start is logged, and with it how many were not.
    pub fn tell(&self) {
        self.set(self.counts().0, 0);
    }

    /// The board has run for so long that the next start will not be in succession.
    pub fn end_succession(&self) {
        self.set(0, self.counts().1);
    }

    fn counts(&self) -> (u32, u32) {
        let (in_succession, untold) = (&self.in_succession, &self.untold);
        (in_succession.load(Relaxed), untold.load(Relaxed))
    }

    fn set(&self, in_succession: u32, untold: u32) {
        self.in_succession.store(in_succession, Relaxed);
        self.untold.store(untold, Relaxed);
        self.check.store(check(in_succession, untold), Relaxed);
    }
}
