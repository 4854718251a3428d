//! The lab's view of a session as WebAssembly: no imports, the memory, and three functions.
//!
//! A page asks [`room`] for room in the memory, writes a request into it, calls [`answer`], and reads as many bytes as that
//! says from where [`answer_at`] says. Requests and answers are those of [`lab_view::Desk::answer`].

use std::sync::{LazyLock, Mutex, MutexGuard};

use lab_view::Desk;

/// What is on the desk, and what goes over it.
#[derive(Default)]
struct Counter {
    desk: Desk,
    request: Vec<u8>,
    answer: Vec<u8>,
}

static COUNTER: LazyLock<Mutex<Counter>> = LazyLock::new(Mutex::default);

fn counter() -> MutexGuard<'static, Counter> {
    COUNTER
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Room for a request of so many bytes: where it lies.
#[expect(unsafe_code, reason = "the page calls it by this name")]
#[unsafe(no_mangle)]
pub extern "C" fn room(bytes: usize) -> *const u8 {
    let mut counter = counter();
    counter.request = vec![0; bytes];
    counter.request.as_ptr()
}

/// Answers the request: how many bytes the answer has.
#[expect(unsafe_code, reason = "the page calls it by this name")]
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> usize {
    let mut counter = counter();
    let request = std::mem::take(&mut counter.request);
    counter.answer = counter
        .desk
        .answer(&String::from_utf8_lossy(&request))
        .into_bytes();
    counter.answer.len()
}

/// Where the answer lies.
#[expect(unsafe_code, reason = "the page calls it by this name")]
#[unsafe(no_mangle)]
pub extern "C" fn answer_at() -> *const u8 {
    counter().answer.as_ptr()
}
