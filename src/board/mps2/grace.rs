//! Real time, where simulated time has to wait for the host.

use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use mirror_protocol::ANSWER_TIMEOUT_MS;

/// Counts of the 25 MHz system timer in one turn of its 24 bits: 0.67 s.
const TURN: u32 = 0x00ff_ffff;
/// 3.4 s: the link does not answer meanwhile, so it must be well within what the tool waits for an answer.
const TURNS: u8 = 5;
const _: () = assert!(TURNS as u64 * TURN as u64 / 25_000 < ANSWER_TIMEOUT_MS / 2);

/// How much longer the host may take for what it owes.
///
/// Simulated time runs many times faster than the host's, so a host that renews a lease every few
/// milliseconds of board time could not keep up on a busy machine. Simulated time can wait; and the
/// host is given up after a while of real time.
pub(super) struct Grace {
    timer: SYST,
    turns_left: u8,
}

impl Grace {
    /// Takes the system timer, which nothing else on this board uses.
    pub(super) fn take() -> Option<Self> {
        let mut timer = Peripherals::take()?.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TURN);
        timer.enable_counter();
        Some(Self {
            timer,
            turns_left: 0,
        })
    }

    /// Starts anew.
    pub(super) fn begin(&mut self) {
        self.timer.clear_current();
        self.timer.has_wrapped();
        self.turns_left = TURNS;
    }

    /// Whether the host has had its time.
    pub(super) fn is_over(&mut self) -> bool {
        if self.timer.has_wrapped() {
            self.turns_left = self.turns_left.saturating_sub(1);
        }
        self.turns_left == 0
    }
}
