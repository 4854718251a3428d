//! What the twin spends its processor's time on: it says at all times what it is at, and another thread looks now and then.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::thread;
use std::time::Duration;

/// From one look to the next.
const LOOK: Duration = Duration::from_micros(500);

/// What the twin is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Activity {
    /// Executes instructions.
    Interpreter,
    /// Reads or writes a register of a peripheral.
    Registers,
    /// Looks for the next event, and lets the peripherals come to it.
    Events,
    /// Ends a conversion of an ADC.
    Conversions,
    /// Brings output filters and supply to an instant.
    Filters,
    /// Steps the virtual mirror.
    Mirror,
    /// The USB host's part.
    Usb,
}

impl Activity {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Interpreter,
        Self::Registers,
        Self::Events,
        Self::Conversions,
        Self::Filters,
        Self::Mirror,
        Self::Usb,
    ];
}

/// Where a twin says what it is at.
#[derive(Debug, Default)]
pub(crate) struct Doing(Arc<AtomicU8>);

impl Clone for Doing {
    /// A twin's clone says it elsewhere.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl Doing {
    /// What is done from now on; what was done before, for [`Self::resume`].
    #[inline]
    pub(crate) fn begin(&self, activity: Activity) -> u8 {
        let before = self.0.load(Ordering::Relaxed);
        self.0.store(activity as u8, Ordering::Relaxed);
        before
    }

    /// Goes on with what [`Self::begin`] interrupted.
    #[inline]
    pub(crate) fn resume(&self, before: u8) {
        self.0.store(before, Ordering::Relaxed);
    }

    /// Where that can be watched from.
    pub(crate) fn watched(&self) -> Watched {
        Watched(Arc::clone(&self.0))
    }
}

/// What a twin is at, for another thread.
#[derive(Debug)]
pub struct Watched(Arc<AtomicU8>);

impl Watched {
    /// Does `work`, and looks meanwhile what the twin is at; what `work` returns, and which part of the looks met which
    /// activity, in the order of [`Activity::ALL`].
    pub fn profile<T: Send>(
        &self,
        work: impl FnOnce() -> T + Send,
    ) -> (T, [f64; Activity::ALL.len()]) {
        let mut met = [0_u32; Activity::ALL.len()];
        let done = thread::scope(|scope| {
            let working = scope.spawn(work);
            while !working.is_finished() {
                thread::sleep(LOOK);
                met[usize::from(self.0.load(Ordering::Relaxed))] += 1;
            }
            working.join().expect("it does not panic")
        });
        let looks = f64::from(met.iter().sum::<u32>()).max(1.0);
        (done, met.map(|met| f64::from(met) / looks))
    }
}
