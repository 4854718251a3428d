//! How long the program handles what, and how late the control loop is, in cycles of the processor's clock.

use crate::chip::Tick;

/// The most exceptions that are told apart: the processor's own, and 128 interrupts.
const EXCEPTIONS: usize = 16 + 128;
const NMI: u16 = 2;

/// The conversions' end (RM0440, table 97).
const CONVERSIONS_END: u16 = 16 + 18;
/// The exception in which the firmware runs its control loop: UART5's (`src/board/stm32g474/converters.rs`).
pub const CONTROL_LOOP: u16 = 16 + 53;

/// The handling of one exception so far, with all that preempted it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Handling {
    /// How often.
    pub count: u64,
    /// All together.
    pub cycles: u64,
    /// The longest.
    pub longest: u64,
}

/// The latest of the control ticks so far, and what can make them late.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Latest {
    /// From the conversions' end to the first instruction of their interrupt.
    pub latency: u64,
    /// From the update that begins a tick to the compare values that its control loop writes, for the next update.
    pub written: u64,
    /// From that update to the end of the control loop, which is to come before the next conversions' end.
    pub end: u64,
    /// The longest that interrupts were masked.
    pub masked: u64,
    /// The instruction that masked them.
    pub masked_at: u32,
    /// The last interrupt that came between the control loop's beginning and end, but for the conversions' end.
    pub interrupted_by: Option<u16>,
}

/// The handling of all exceptions, and sleep.
#[derive(Clone, Debug)]
pub struct Timing {
    handlings: Vec<Handling>,
    begun: Vec<u64>,
    running: Vec<u16>,
    /// Cycles in which the processor slept.
    pub asleep: u64,
    latest: Latest,
    /// The update whose conversions ended last, and that of the tick whose control loop runs.
    update: u64,
    update_of_loop: u64,
    /// Since when interrupts are masked, and by which instruction.
    masked: Option<(u64, u32)>,
}

impl Default for Timing {
    fn default() -> Self {
        Self {
            handlings: vec![Handling::default(); EXCEPTIONS],
            begun: vec![0; EXCEPTIONS],
            running: Vec::new(),
            asleep: 0,
            latest: Latest::default(),
            update: 0,
            update_of_loop: 0,
            masked: None,
        }
    }
}

impl Timing {
    /// How interrupt `number` was handled.
    pub fn interrupt(&self, number: u32) -> Handling {
        self.handlings[16 + number as usize]
    }

    /// How the non-maskable interrupt was handled.
    pub fn nmi(&self) -> Handling {
        self.handlings[usize::from(NMI)]
    }

    /// How the control loop was handled.
    pub fn control_loop(&self) -> Handling {
        self.handlings[usize::from(CONTROL_LOOP)]
    }

    /// The latest of the control ticks.
    pub fn latest(&self) -> Latest {
        self.latest
    }

    /// Counts anew; what is being handled goes on.
    pub fn count_anew(&mut self) {
        self.handlings.fill(Handling::default());
        (self.asleep, self.latest) = (0, Latest::default());
    }

    /// From `cycle` on `exception` is handled; 0 for none. `tick` is the last that the timer began.
    #[cold]
    pub(crate) fn change(&mut self, exception: u16, cycle: u64, tick: Tick) {
        let returns = exception == 0 || self.running.contains(&exception);
        if !returns {
            self.running.push(exception);
            self.begun[usize::from(exception)] = cycle;
            self.begin(exception, cycle, tick);
            return;
        }
        while let Some(last) = self.running.pop() {
            if last == exception {
                self.running.push(last);
                return;
            }
            let taken = cycle - self.begun[usize::from(last)];
            let handling = &mut self.handlings[usize::from(last)];
            handling.count += 1;
            handling.cycles += taken;
            handling.longest = handling.longest.max(taken);
            if last == CONTROL_LOOP {
                let since = |cycle: u64| cycle.saturating_sub(self.update_of_loop);
                self.latest.written = self.latest.written.max(since(tick.written));
                self.latest.end = self.latest.end.max(since(cycle));
            }
        }
    }

    fn begin(&mut self, exception: u16, cycle: u64, tick: Tick) {
        match exception {
            CONVERSIONS_END => {
                self.latest.latency = self.latest.latency.max(cycle - tick.converted);
                // The next tick may have begun before these conversions are looked at.
                self.update = match tick.converted < tick.cycle {
                    true => self.update,
                    false => tick.cycle,
                };
            }
            CONTROL_LOOP => self.update_of_loop = self.update,
            16.. if self.running.contains(&CONTROL_LOOP) => {
                self.latest.interrupted_by = Some(exception - 16);
            }
            _ => {}
        }
    }

    /// From `cycle` on interrupts are masked by the instruction at `at`, or are not.
    pub(crate) fn mask(&mut self, is_masked: bool, cycle: u64, at: u32) {
        match (is_masked, self.masked.take()) {
            (true, None) => self.masked = Some((cycle, at)),
            (true, since) => self.masked = since,
            (false, Some((since, at))) if cycle - since > self.latest.masked => {
                (self.latest.masked, self.latest.masked_at) = (cycle - since, at);
            }
            (false, _) => {}
        }
    }

    /// A reset: what was handled is not.
    pub(crate) fn forget(&mut self) {
        self.running.clear();
        self.masked = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tick(cycle: u64, converted: u64, written: u64) -> Tick {
        Tick {
            cycle,
            converted,
            written,
            ..Tick::default()
        }
    }

    #[test]
    fn what_preempts_counts_for_both() {
        let mut timing = Timing::default();
        for (exception, cycle) in [(20, 100), (18, 130), (20, 150), (0, 200)] {
            timing.change(exception, cycle, Tick::default());
        }
        let handling = |cycles| Handling {
            count: 1,
            cycles,
            longest: cycles,
        };
        assert_eq!(timing.interrupt(4), handling(100));
        assert_eq!(timing.interrupt(2), handling(20));
    }

    #[test]
    fn a_control_loop_is_as_late_as_it_ends_after_its_own_update() {
        let mut timing = Timing::default();
        let (first, second) = (tick(1000, 1600, 0), tick(2000, 1600, 1950));
        timing.change(CONVERSIONS_END, 1612, first);
        timing.change(CONTROL_LOOP, 1700, first);
        timing.change(0, 2100, second);
        let latest = timing.latest();
        assert_eq!(
            (latest.latency, latest.written, latest.end),
            (12, 950, 1100)
        );
    }

    #[test]
    fn the_longest_mask_is_kept_with_its_place() {
        let mut timing = Timing::default();
        for (is_masked, cycle, at) in [
            (true, 10, 0xa),
            (true, 20, 0xb),
            (false, 40, 0xc),
            (true, 50, 0xd),
            (false, 60, 0xe),
        ] {
            timing.mask(is_masked, cycle, at);
        }
        let latest = timing.latest();
        assert_eq!((latest.masked, latest.masked_at), (30, 0xa));
    }
}
