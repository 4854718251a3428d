//! Places that link and control loop share. Nothing here can panic, and looking into an empty place takes an
//! instruction or two: the control loop looks into all of them at every tick.

use core::cell::Cell;
use core::sync::atomic::{AtomicBool, Ordering};

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

/// Room for one value, which waits until it is taken; a newer one takes its place.
pub(crate) struct Slot<T> {
    /// There is a value, or one is just being put or taken.
    is_full: AtomicBool,
    value: Mutex<CriticalSectionRawMutex, Cell<Option<T>>>,
}

impl<T> Slot<T> {
    pub(crate) const fn new() -> Self {
        Self {
            is_full: AtomicBool::new(false),
            value: Mutex::new(Cell::new(None)),
        }
    }

    pub(crate) fn put(&self, value: T) {
        self.value.lock(|slot| {
            slot.set(Some(value));
            self.is_full.store(true, Ordering::Relaxed);
        });
    }

    pub(crate) fn take(&self) -> Option<T> {
        if self.is_empty() {
            return None;
        }
        self.value.lock(|slot| {
            self.is_full.store(false, Ordering::Relaxed);
            slot.take()
        })
    }

    pub(crate) fn is_empty(&self) -> bool {
        !self.is_full.load(Ordering::Relaxed)
    }
}

/// Values on their way from one to the other, first in, first out.
pub(crate) struct Queue<T, const N: usize> {
    ring: Mutex<CriticalSectionRawMutex, Ring<T, N>>,
    arrived: Signal<CriticalSectionRawMutex, ()>,
}

struct Ring<T, const N: usize> {
    values: [Cell<Option<T>>; N],
    first: Cell<usize>,
    waiting: Cell<usize>,
}

impl<T, const N: usize> Queue<T, N> {
    pub(crate) const fn new() -> Self {
        Self {
            ring: Mutex::new(Ring {
                values: [const { Cell::new(None) }; N],
                first: Cell::new(0),
                waiting: Cell::new(0),
            }),
            arrived: Signal::new(),
        }
    }

    /// Adds `value`; `false` where there is no room for it.
    pub(crate) fn push(&self, value: T) -> bool {
        let added = self.ring.lock(|ring| ring.push(value));
        if added {
            self.arrived.signal(());
        }
        added
    }

    /// Takes the first value, and waits until there is one.
    pub(crate) async fn next(&self) -> T {
        loop {
            if let Some(value) = self.take() {
                return value;
            }
            self.arrived.wait().await;
        }
    }

    /// Takes the first value, if there is one.
    pub(crate) fn take(&self) -> Option<T> {
        self.ring.lock(Ring::pop)
    }

    pub(crate) fn clear(&self) {
        while self.take().is_some() {}
    }

    pub(crate) fn is_full(&self) -> bool {
        self.ring.lock(|ring| ring.waiting.get() == N)
    }
}

impl<T, const N: usize> Ring<T, N> {
    fn push(&self, value: T) -> bool {
        let waiting = self.waiting.get();
        let free = (self.first.get() + waiting) % N;
        match self.values.get(free) {
            Some(slot) if waiting < N => {
                slot.set(Some(value));
                self.waiting.set(waiting + 1);
                true
            }
            _ => false,
        }
    }

    fn pop(&self) -> Option<T> {
        let waiting = self.waiting.get().checked_sub(1)?;
        let first = self.first.get();
        self.waiting.set(waiting);
        self.first.set((first + 1) % N);
        self.values.get(first)?.take()
    }
}
