//! Simulated time for embassy: it advances by one with every control tick.

use core::cell::{Cell, RefCell};
use core::task::Waker;

use critical_section::Mutex;
use embassy_time_driver::Driver;
use embassy_time_queue_utils::Queue;

struct TickTime {
    now: Mutex<Cell<u64>>,
    queue: Mutex<RefCell<Queue>>,
}

embassy_time_driver::time_driver_impl!(static TIME: TickTime = TickTime {
    now: Mutex::new(Cell::new(0)),
    queue: Mutex::new(RefCell::new(Queue::new())),
});

impl Driver for TickTime {
    fn now(&self) -> u64 {
        critical_section::with(|cs| self.now.borrow(cs).get())
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|cs| {
            self.queue.borrow(cs).borrow_mut().schedule_wake(at, waker);
        });
    }
}

/// So many control ticks have passed.
pub(super) fn advance(ticks: u64) {
    critical_section::with(|cs| {
        let now = TIME.now.borrow(cs).get() + ticks;
        TIME.now.borrow(cs).set(now);
        TIME.queue.borrow(cs).borrow_mut().next_expiration(now);
    });
}
