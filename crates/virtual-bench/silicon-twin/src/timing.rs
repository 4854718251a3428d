//! How long the program handles what.

/// The most exceptions that are told apart: the processor's own, and 128 interrupts.
const EXCEPTIONS: usize = 16 + 128;

/// The handling of one exception so far, in cycles of the processor's clock, with all that preempted it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Handling {
    /// How often.
    pub count: u64,
    /// All together.
    pub cycles: u64,
    /// The longest.
    pub longest: u64,
}

/// The handling of all exceptions, and sleep.
#[derive(Clone, Debug)]
pub struct Timing {
    handlings: Vec<Handling>,
    begun: Vec<u64>,
    running: Vec<u16>,
    /// Cycles in which the processor slept.
    pub asleep: u64,
}

impl Default for Timing {
    fn default() -> Self {
        Self {
            handlings: vec![Handling::default(); EXCEPTIONS],
            begun: vec![0; EXCEPTIONS],
            running: Vec::new(),
            asleep: 0,
        }
    }
}

impl Timing {
    /// How interrupt `number` was handled.
    pub fn interrupt(&self, number: u32) -> Handling {
        self.handlings[16 + number as usize]
    }

    /// From `cycle` on `exception` is handled; 0 for none.
    #[cold]
    pub(crate) fn change(&mut self, exception: u16, cycle: u64) {
        let returns = exception == 0 || self.running.contains(&exception);
        if !returns {
            self.running.push(exception);
            self.begun[usize::from(exception)] = cycle;
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
        }
    }

    /// A reset: what was handled is not.
    pub(crate) fn forget(&mut self) {
        self.running.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_preempts_counts_for_both() {
        let mut timing = Timing::default();
        for (exception, cycle) in [(20, 100), (18, 130), (20, 150), (0, 200)] {
            timing.change(exception, cycle);
        }
        let handling = |cycles| Handling {
            count: 1,
            cycles,
            longest: cycles,
        };
        assert_eq!(timing.interrupt(4), handling(100));
        assert_eq!(timing.interrupt(2), handling(20));
    }
}
