//! Exceptions: entry, return, priorities, and faults (ARMv7-M manual, section B1.5).

use super::fault::{Fault, HARD_FAULT, NMI};
use super::{Bus, Cpu, Executed, Halt, LR, PC, SP, Sleep, Trap};

const BASIC_FRAME: u32 = 0x20;
const EXTENDED_FRAME: u32 = 0x68;
/// Cycles from an exception to the first instruction of its handler (Cortex-M4 TRM, section 3.9).
const ENTRY_CYCLES: u32 = 12;

impl Cpu {
    /// Priority of what runs: the lower, the more urgent (section B1.5.4).
    fn execution_priority(&self) -> i16 {
        let masked = self.mask_without_primask();
        match self.primask {
            true => masked.min(0),
            false => masked,
        }
    }

    fn mask_without_primask(&self) -> i16 {
        let mut priority = self.system.active_priority();
        if self.basepri != 0 {
            priority = priority.min(self.system.group(self.basepri));
        }
        if self.faultmask {
            priority = priority.min(-1);
        }
        priority
    }

    /// Takes the most urgent exception that is pending and not masked; its cycles.
    #[cold]
    pub(super) fn take_exceptions(&mut self, bus: &mut impl Bus) -> Result<Option<u32>, Halt> {
        self.system.attention = false;
        let Some((exception, priority)) = self.system.most_urgent() else {
            return Ok(None);
        };
        // PRIMASK does not keep a processor asleep (section B1.5.18).
        if priority < self.mask_without_primask() {
            self.sleep = Sleep::Awake;
        }
        if priority >= self.execution_priority() {
            return Ok(None);
        }
        self.enter(bus, exception).map(Some)
    }

    /// An event wakes what waits for one (section B1.5.18).
    pub(super) fn fall_asleep(&mut self, sleep: Sleep) {
        self.sleep = sleep;
        self.system.attention = true;
    }

    /// ExceptionEntry of the manual (section B1.5.6).
    fn enter(&mut self, bus: &mut impl Bus, exception: u16) -> Result<u32, Halt> {
        let has_floats = self.control & 4 != 0;
        let frame_bytes = if has_floats {
            EXTENDED_FRAME
        } else {
            BASIC_FRAME
        };
        let padding = self.r[SP] & 4;
        let frame = self.r[SP].wrapping_sub(frame_bytes) & !4;
        let xpsr = self.xpsr() | padding << 7;
        let kept = [
            self.r[0], self.r[1], self.r[2], self.r[3], self.r[12], self.r[LR], self.next, xpsr,
        ];
        for (i, word) in (0..).zip(kept) {
            self.store::<4>(bus, frame.wrapping_add(4 * i), word)
                .map_err(|trap| self.stack_ran_out(trap))?;
        }
        if has_floats {
            self.stack_floats(bus, frame + BASIC_FRAME)
                .map_err(|trap| self.stack_ran_out(trap))?;
        }
        let mode = match (self.handles(), self.stack_in_use()) {
            (true, _) => 0x1,
            (false, 0) => 0x9,
            (false, _) => 0xd,
        };
        self.r[SP] = frame;
        self.with_stack_change(|cpu| {
            cpu.ipsr = exception;
            cpu.control &= 1;
        });
        self.r[LR] = 0xffff_ffe0 | u32::from(!has_floats) << 4 | mode;
        self.system.activate(exception);
        (self.it, self.exclusive, self.is_float_ready) = (0, None, false);
        (self.has_event, self.sleep) = (true, Sleep::Awake);
        let vector = self.system.vectors() + 4 * u32::from(exception);
        let handler = bus.read::<4>(vector).map_err(|_| Halt::Bus)?;
        self.next = handler & !1;
        self.system.attention = true;
        Ok(ENTRY_CYCLES)
    }

    /// The floating-point registers, now or at the handler's first use of the unit (FPCCR.LSPEN).
    fn stack_floats(&mut self, bus: &mut impl Bus, at: u32) -> Executed<()> {
        self.system.reserve_float_frame(at);
        if self.system.keeps_floats_lazily() {
            self.system.set_floats_pending(true);
            return Ok(());
        }
        for (i, word) in (0..).zip(self.s.into_iter().take(16).chain([self.fpscr])) {
            self.store::<4>(bus, at + 4 * i, word)?;
        }
        Ok(())
    }

    fn stack_ran_out(&self, trap: Trap) -> Halt {
        match trap {
            Trap::Fault(fault) => Halt::Lockup(fault),
            Trap::Halt(halt) => halt,
        }
    }

    /// ExceptionReturn of the manual (section B1.5.8).
    pub(super) fn return_from_exception(
        &mut self,
        bus: &mut impl Bus,
        target: u32,
    ) -> Executed<()> {
        let (to_handler, stack) = match target & 0xf {
            0x1 => (true, 0),
            0x9 => (false, 0),
            0xd => (false, 1),
            _ => return Err(Trap::Fault(Fault::invalid_return(target))),
        };
        let has_floats = target & 0x10 == 0;
        if self.ipsr != NMI {
            self.faultmask = false;
        }
        self.system.deactivate(self.ipsr);
        self.stacks[0] = self.r[SP];
        let frame = self.stacks[stack];
        let mut kept = [0; 8];
        for (i, word) in (0..).zip(&mut kept) {
            *word = self.load::<4>(bus, frame.wrapping_add(4 * i))?;
        }
        if has_floats {
            self.unstack_floats(bus, frame + BASIC_FRAME)?;
        }
        let [r0, r1, r2, r3, r12, lr, next, xpsr] = kept;
        [self.r[0], self.r[1], self.r[2], self.r[3]] = [r0, r1, r2, r3];
        (self.r[12], self.r[LR], self.next) = (r12, lr, next & !1);
        let bytes = if has_floats {
            EXTENDED_FRAME
        } else {
            BASIC_FRAME
        };
        let above = frame.wrapping_add(bytes) | xpsr >> 7 & 4;
        self.ipsr = xpsr as u16 & 0x1ff;
        if to_handler != self.handles() {
            return Err(Trap::Fault(Fault::invalid_return(target)));
        }
        self.control = self.control & 1 | (stack as u8) << 1 | u8::from(has_floats) << 2;
        self.stacks[stack] = above;
        self.r[SP] = self.stacks[self.stack_in_use()];
        self.set_flags_from(xpsr);
        self.it = (xpsr >> 25 & 3) as u8 | (xpsr >> 8 & 0xfc) as u8;
        (self.exclusive, self.has_event, self.is_float_ready) = (None, true, false);
        self.system.attention = true;
        if !to_handler && self.system.sleeps_on_exit() {
            self.fall_asleep(Sleep::ForInterrupt);
        }
        Ok(())
    }

    fn unstack_floats(&mut self, bus: &mut impl Bus, at: u32) -> Executed<()> {
        if self.system.are_floats_pending() {
            self.system.set_floats_pending(false);
            return Ok(());
        }
        for i in 0..16 {
            self.s[i as usize] = self.load::<4>(bus, at + 4 * i)?;
        }
        self.fpscr = self.load::<4>(bus, at + 64)?;
        Ok(())
    }

    /// What follows an instruction that did not end as it should.
    #[cold]
    pub(super) fn trapped(&mut self, bus: &mut impl Bus, trap: Trap) -> Result<u32, Halt> {
        self.next = self.r[PC].wrapping_sub(4);
        let fault = match trap {
            Trap::Halt(halt) => return Err(halt),
            Trap::Fault(fault) => fault,
        };
        self.system.record(fault);
        let running = self.execution_priority();
        if running <= -1 {
            return Err(Halt::Lockup(fault));
        }
        if self.stops_at_faults {
            return Err(Halt::Fault(fault));
        }
        let own = self.system.fault_priority(fault.exception);
        match own.is_some_and(|priority| priority < running) {
            true => self.enter(bus, fault.exception),
            false => {
                self.system.escalate();
                self.enter(bus, HARD_FAULT)
            }
        }
    }

    pub(super) fn read_special(&mut self, rd: u8, special: u8) -> Executed {
        let value = match special {
            // APSR and EPSR, which reads as 0; with IPSR.
            0 | 2 => self.xpsr() & 0xf80f_0000,
            1 | 3 => self.xpsr() & 0xf80f_01ff,
            5 => self.ipsr.into(),
            8 | 9 => {
                self.stacks[self.stack_in_use()] = self.r[SP];
                self.stacks[usize::from(special - 8)]
            }
            16 => self.primask.into(),
            17 | 18 => self.basepri.into(),
            19 => self.faultmask.into(),
            20 => self.control.into(),
            _ => return Err(lacks(special)),
        };
        self.r[usize::from(rd)] = value;
        Ok(2)
    }

    pub(super) fn write_special(&mut self, special: u8, value: u32) -> Executed {
        match special {
            0..=3 => self.set_flags_from(value),
            8 | 9 => {
                self.with_stack_change(|cpu| cpu.stacks[usize::from(special - 8)] = value & !3);
            }
            16 => self.primask = value & 1 != 0,
            17 => self.basepri = value as u8 & 0xf0,
            18 => {
                let value = value as u8 & 0xf0;
                if value != 0 && (self.basepri == 0 || value < self.basepri) {
                    self.basepri = value;
                }
            }
            19 => self.faultmask = value & 1 != 0,
            20 if value & 1 != 0 => return Err(lacks(special)),
            20 => {
                self.with_stack_change(|cpu| cpu.control = value as u8 & 6);
                self.is_float_ready = false;
            }
            _ => return Err(lacks(special)),
        }
        self.system.attention = true;
        Ok(2)
    }
}

fn lacks(special: u8) -> Trap {
    let what = format!("special register {special}, or unprivileged code");
    Trap::Halt(Halt::NotModelled(what))
}
