//! What the controller's states are, in memory that a reset leaves as it is: the mirror goes on as warm as it is, and remembers what it
//! did.

#![cfg_attr(
    target_os = "none",
    expect(unsafe_code, reason = "memory that no variable may own")
)]

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use control_core::{CHANNELS, Retained};

/// One actuator's states are kept every so many ticks, so that none is older than 0.1 s: a mirror that has stood still is as warm then. All
/// at once would take some 6 us more of a tick, and once in 32 ticks loses samples of every tick (`hil/tests/acceptance.rs`, on the twin):
/// there is no time to spare beside USB.
pub const KEPT_EVERY: u32 = 256;

/// Tells states from what memory holds at power-on.
const MAGIC: u32 = 0x2e7a_14ed;

/// The states that were kept last.
#[derive(Debug)]
#[repr(C)]
pub struct Keep {
    actuators: [KeptActuator; CHANNELS],
}

/// Those of one actuator.
#[derive(Debug)]
#[repr(C)]
struct KeptActuator {
    words: [AtomicU32; Retained::WORDS],
    /// What [`check`] makes of the words.
    check: AtomicU32,
}

/// Behind it are the reason of the last stop and the counts of resets.
const _: () = assert!(size_of::<Keep>() <= 320);

/// Rotated and multiplied, word by word: what is half written does not fit (Knuth, The Art of Computer Programming 3, section 6.4,
/// has the multiplier).
fn check(words: &[u32; Retained::WORDS]) -> u32 {
    let mix = |check: u32, word: &u32| (check.rotate_left(5) ^ word).wrapping_mul(0x9e37_79b9);
    words.iter().fold(MAGIC, mix)
}

impl Keep {
    /// One that holds nothing.
    pub const fn empty() -> Self {
        Self {
            actuators: [const { KeptActuator::empty() }; CHANNELS],
        }
    }

    /// That of the image, behind its data in RAM (`RETAINED` in each board's `memory.x`).
    #[cfg(target_os = "none")]
    pub fn of_the_image() -> &'static Self {
        unsafe extern "C" {
            static RETAINED: Keep;
        }
        // SAFETY: the linker keeps this memory for it, aligned, and any bytes are words.
        unsafe { &RETAINED }
    }

    /// Keeps an actuator's states in the place of those before.
    pub fn keep(&self, actuator: usize, retained: &Retained) {
        if let Some(record) = self.actuators.get(actuator) {
            record.keep(retained);
        }
    }

    /// The states that were kept last; `None` where there are none, or those of one actuator are not whole.
    pub fn kept(&self) -> Option<[Retained; CHANNELS]> {
        let mut all = [Retained::default(); CHANNELS];
        for (place, record) in all.iter_mut().zip(&self.actuators) {
            *place = record.kept()?;
        }
        Some(all)
    }
}

impl KeptActuator {
    const fn empty() -> Self {
        Self {
            words: [const { AtomicU32::new(0) }; Retained::WORDS],
            check: AtomicU32::new(0),
        }
    }

    fn keep(&self, retained: &Retained) {
        let words = retained.to_words();
        for (place, word) in self.words.iter().zip(words) {
            place.store(word, Relaxed);
        }
        self.check.store(check(&words), Relaxed);
    }

    fn kept(&self) -> Option<Retained> {
        let words = self.words.each_ref().map(|word| word.load(Relaxed));
        let is_whole = self.check.load(Relaxed) == check(&words);
        is_whole.then(|| Retained::from_words(&words)).flatten()
    }
}
