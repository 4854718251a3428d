//! Time for embassy: it advances by one with every control tick of the thread.

extern crate std;

use core::cell::Cell;
use core::task::Waker;

use embassy_time_driver::Driver;

std::thread_local! {
    static NOW: Cell<u64> = const { Cell::new(0) };
}

struct TickTime;

embassy_time_driver::time_driver_impl!(static TIME: TickTime = TickTime);

impl Driver for TickTime {
    fn now(&self) -> u64 {
        NOW.get()
    }

    fn schedule_wake(&self, _at: u64, waker: &Waker) {
        // Whoever runs the firmware here polls it again and again, and it looks at the time itself.
        waker.wake_by_ref();
    }
}

/// So many control ticks have passed.
pub(super) fn advance(ticks: u64) {
    NOW.set(NOW.get() + ticks);
}
