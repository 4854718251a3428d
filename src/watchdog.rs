//! Feeds the watchdog for as long as everything that matters runs.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_time::{Duration, Timer};

/// How often the parts are asked; a part is late after one round.
pub const ROUND: Duration = Duration::from_millis(20);

/// The control loop computed drives, after the protection had watched what was sensed.
pub(crate) static CONTROL: AtomicBool = AtomicBool::new(false);
/// The protection came to a decision.
pub(crate) static PROTECTION: AtomicBool = AtomicBool::new(false);
/// The link is polled.
pub(crate) static LINK: AtomicBool = AtomicBool::new(false);

/// Calls `feed` in every round in which all parts have checked in, for ever.
pub async fn guard(mut feed: impl FnMut()) -> ! {
    loop {
        Timer::after(ROUND).await;
        let parts = [&CONTROL, &PROTECTION, &LINK];
        if parts.iter().all(|part| part.load(Ordering::Relaxed)) {
            parts
                .iter()
                .for_each(|part| part.store(false, Ordering::Relaxed));
            feed();
        }
    }
}
