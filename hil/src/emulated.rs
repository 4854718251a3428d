//! What only an emulated board can be asked: its clock, its bench, its flash, and to be waited for.

use std::thread;
use std::time::Duration;

use emulated_board::{Controls, Stack};

use crate::Bench;
use crate::bench::PATIENCE;
use crate::emulator::Emulator;
use crate::patience::Patience;

/// From one look at an emulated board to the next.
const LOOK: Duration = Duration::from_millis(1);
/// A board in QEMU that is reset is there again within so many seconds of its ticks.
const RESTART_S: f64 = 0.05;

/// All of these panic where the board is a real one.
impl Bench {
    /// The bench around the board.
    pub fn controls(&self) -> &Controls {
        self.emulator().controls()
    }

    /// Time that has passed for the board and its mirror.
    pub fn simulated_s(&self) -> f64 {
        self.emulator().simulated_s()
    }

    /// What the board keeps in its flash: fault log and calibrations.
    pub fn stored(&self) -> Vec<u8> {
        self.emulator().stored()
    }

    /// How much of its stack the firmware has used; QEMU needs its monitor for it (`has_monitor`).
    pub fn stack(&self) -> Stack {
        self.emulator().stack().expect("the emulator tells")
    }

    /// Damages what is stored at `at`, beyond what the flash can mend.
    pub fn damage(&self, at: usize) {
        self.emulator().damage(at);
    }

    /// Wears the board's flash out: from now on it takes nothing more.
    pub fn wear_out_flash(&self) {
        self.emulator().wear_out_flash();
    }

    /// Does something that resets the board so many times, the last time within `within_s` of its own time, and waits
    /// until it takes requests again.
    ///
    /// # Panics
    /// Where it is not reset.
    pub fn restart(&self, resets: usize, within_s: f64, act: impl FnOnce(&Self)) {
        match self.emulator() {
            Emulator::Qemu(..) => {
                let end_s = self.simulated_s() + within_s + RESTART_S;
                act(self);
                self.wait_until_s(end_s);
            }
            Emulator::Host(_) => panic!("nothing resets it"),
            Emulator::Twin(twin) => {
                let resets = twin.resets() + resets;
                act(self);
                self.wait("it is not reset", |_| twin.resets() >= resets);
                self.wait("its host does not find it again", |_| twin.is_known());
            }
        }
    }

    /// Waits until the board's mirror has been driven for `ticks` control ticks since the board was started: a tool that
    /// drives is at work then, however long it took to start.
    ///
    /// # Panics
    /// Where that does not happen, or the board is a real one.
    pub fn wait_until_driven(&self, ticks: u64) {
        self.wait("nothing drives the mirror", |board| {
            board.controls().observed().driven_ticks >= ticks
        });
    }

    /// Waits until the board's clock is beyond `simulated_s`.
    ///
    /// # Panics
    /// Where that does not happen, or the board is a real one.
    pub fn wait_until_s(&self, simulated_s: f64) {
        self.wait("the board's clock stands", |board| {
            board.simulated_s() > simulated_s
        });
    }

    /// Waits until something is so; `or_else` says what is wrong where it never is. A machine that has no processor for the
    /// board is waited for.
    ///
    /// # Panics
    /// Where it never is, or the board is a real one.
    pub fn wait(&self, or_else: &str, mut is_so: impl FnMut(&Self) -> bool) {
        let patience = Patience::with(self.emulator().processes());
        while !is_so(self) {
            assert!(patience.waited() < PATIENCE, "{or_else}");
            thread::sleep(LOOK);
        }
    }
}
