//! The processor: Cortex-M4 with floating-point unit, interpreted an instruction at a time.
//!
//! Sources: ARMv7-M Architecture Reference Manual (DDI 0403E), and for cycles the Cortex-M4 Technical Reference Manual
//! (DDI 0439B, section 3.3).

mod arithmetic;
pub mod bus;
pub mod decode;
mod exceptions;
mod execute;
mod fault;
mod float;
pub mod instruction;
mod memory;
mod multiply;
mod operations;
mod parallel;
mod system;

#[cfg(test)]
mod tests;

pub use bus::{Abort, Bus};
pub use fault::Fault;
pub(crate) use fault::NMI;
pub use system::System;

pub(crate) const SP: usize = 13;
pub(crate) const LR: usize = 14;
pub(crate) const PC: usize = 15;

/// Cycles from the end of a handler back to what it interrupted (Cortex-M4 TRM, section 3.9).
const RETURN_CYCLES: u32 = 10;

/// Why the processor does not go on, in the model or in truth.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Halt {
    /// The bus refused in a way that no program may see; it knows the reason.
    Bus,
    /// The model lacks something that the program uses.
    NotModelled(String),
    /// A fault that the program would have to handle, where faults end the run.
    Fault(Fault),
    /// A fault at a priority at which none can be handled (section B1.5.15).
    Lockup(Fault),
}

/// What becomes of an instruction that does not end as it should.
#[derive(Clone, Debug)]
pub(crate) enum Trap {
    Fault(Fault),
    Halt(Halt),
}

pub(crate) type Executed<T = u32> = Result<T, Trap>;

/// How the processor sleeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sleep {
    /// It does not.
    Awake,
    /// Until an event or an interrupt.
    ForEvent,
    /// Until an interrupt.
    ForInterrupt,
}

/// The processor's state.
#[derive(Clone, Debug)]
pub struct Cpu {
    /// R0 to R15; R13 is the stack pointer in use, R15 reads as the instruction's address and 4.
    r: [u32; 16],
    /// The two stack pointers, of which one is out of date: the one in use.
    stacks: [u32; 2],
    next: u32,
    n: bool,
    z: bool,
    c: bool,
    v: bool,
    q: bool,
    /// APSR.GE, a bit for each byte.
    ge: u8,
    /// ITSTATE (section A7.3.2).
    it: u8,
    ipsr: u16,
    primask: bool,
    faultmask: bool,
    basepri: u8,
    /// CONTROL: nPRIV, SPSEL, FPCA.
    control: u8,
    s: [u32; 32],
    fpscr: u32,
    /// Floating-point instructions need nothing more before they begin.
    is_float_ready: bool,
    has_event: bool,
    sleep: Sleep,
    exclusive: Option<u32>,
    /// NVIC and system control.
    pub system: System,
    /// Whether a fault ends the run instead of being handled by the program.
    pub stops_at_faults: bool,
    instructions: u64,
}

impl Cpu {
    /// A processor out of reset, with the vectors at `vectors`.
    ///
    /// # Errors
    /// Where the first two vectors cannot be read.
    pub fn new(bus: &mut impl Bus, vectors: u32) -> Result<Self, Halt> {
        let read = |bus: &mut _, at| Bus::read::<4>(bus, at).map_err(|_| Halt::Bus);
        let stack = read(bus, vectors)?;
        let entry = read(bus, vectors + 4)?;
        let mut cpu = Self {
            r: [0; 16],
            stacks: [stack & !3, 0],
            next: entry & !1,
            n: false,
            z: false,
            c: false,
            v: false,
            q: false,
            ge: 0,
            it: 0,
            ipsr: 0,
            primask: false,
            faultmask: false,
            basepri: 0,
            control: 0,
            s: [0; 32],
            fpscr: 0,
            is_float_ready: false,
            has_event: false,
            sleep: Sleep::Awake,
            exclusive: None,
            system: System::new(vectors),
            stops_at_faults: true,
            instructions: 0,
        };
        cpu.r[SP] = stack & !3;
        cpu.r[LR] = u32::MAX;
        Ok(cpu)
    }

    /// Address of the next instruction.
    pub fn next(&self) -> u32 {
        self.next
    }

    /// Return address of the function that runs, as far as it is in its register.
    pub fn link(&self) -> u32 {
        self.r[LR]
    }

    /// The exception that is handled; 0 for none.
    pub fn exception(&self) -> u16 {
        self.ipsr
    }

    /// Whether interrupts are masked (PRIMASK).
    #[inline]
    pub fn masks_interrupts(&self) -> bool {
        self.primask
    }

    /// Instructions since reset.
    pub fn instructions(&self) -> u64 {
        self.instructions
    }

    /// How it sleeps.
    pub fn sleep(&self) -> Sleep {
        self.sleep
    }

    /// The stack pointer in use.
    pub fn stack_pointer(&self) -> u32 {
        self.r[SP]
    }

    /// Goes on at `address`, with interrupts masked.
    pub(crate) fn divert(&mut self, address: u32) {
        (self.next, self.it, self.primask) = (address, 0, true);
        (self.sleep, self.has_event) = (Sleep::Awake, false);
    }

    /// Calls the function at `address` with one argument, with interrupts masked.
    pub(crate) fn call(&mut self, address: u32, argument: u32) {
        self.divert(address);
        self.r[0] = argument;
    }

    /// Whether anything could wake it: an interrupt line, at a priority that is not masked for WFI.
    pub fn is_deaf(&self) -> bool {
        !self.system.any_enabled()
    }

    /// Takes an exception that is due, or executes one instruction; the cycles that it took. A sleeping processor takes
    /// none.
    ///
    /// # Errors
    /// Where it does not go on.
    #[inline]
    pub fn step(&mut self, bus: &mut impl Bus) -> Result<u32, Halt> {
        if self.system.attention
            && let Some(cycles) = self.take_exceptions(bus)?
        {
            return Ok(cycles);
        }
        if self.sleep != Sleep::Awake {
            return Ok(0);
        }
        let handled = self.ipsr;
        match self.execute_next(bus) {
            Ok(cycles) if self.ipsr == handled => Ok(cycles),
            Ok(_) => Ok(RETURN_CYCLES),
            Err(trap) => self.trapped(bus, trap),
        }
    }

    #[inline]
    fn execute_next(&mut self, bus: &mut impl Bus) -> Executed {
        let at = self.next;
        self.r[PC] = at.wrapping_add(4);
        let decoded = match bus.fetch(at) {
            Ok(decoded) => decoded,
            Err(Abort::Fault) => return Err(Trap::Fault(Fault::fetch(at))),
            Err(Abort::Halt) => return Err(Trap::Halt(Halt::Bus)),
        };
        self.next = at.wrapping_add(u32::from(decoded.bytes));
        self.instructions += 1;
        if self.it == 0 {
            return self.execute(bus, &decoded.instruction);
        }
        let handled = self.ipsr;
        let cycles = match self.is_met(self.it >> 4) {
            true => self.execute(bus, &decoded.instruction)?,
            false => 1,
        };
        // The end of an exception brings the state of the block that it came into.
        if self.ipsr == handled {
            self.advance_it();
        }
        Ok(cycles)
    }

    /// ITAdvance of the manual.
    fn advance_it(&mut self) {
        self.it = match self.it & 7 {
            0 => 0,
            _ => self.it & 0xe0 | self.it << 1 & 0x1f,
        };
    }

    /// ConditionPassed of the manual (section A7.3).
    #[inline]
    fn is_met(&self, condition: u8) -> bool {
        let base = match condition >> 1 & 7 {
            0 => self.z,
            1 => self.c,
            2 => self.n,
            3 => self.v,
            4 => self.c && !self.z,
            5 => self.n == self.v,
            6 => self.n == self.v && !self.z,
            _ => return true,
        };
        base != (condition & 1 != 0)
    }

    fn handles(&self) -> bool {
        self.ipsr != 0
    }

    /// BranchWritePC and its kin: where bit 0 must say "Thumb" (section A2.3.1), and where an exception ends.
    fn branch_exchange(&mut self, bus: &mut impl Bus, target: u32) -> Executed<()> {
        if self.handles() && target >> 28 == 0xf {
            return self.return_from_exception(bus, target);
        }
        if target & 1 == 0 {
            return Err(Trap::Fault(Fault::invalid_state(target)));
        }
        self.next = target & !1;
        Ok(())
    }

    /// Which of the two stack pointers is in use: main or process.
    fn stack_in_use(&self) -> usize {
        usize::from(!self.handles() && self.control & 2 != 0)
    }

    /// Lets `change` alter what decides on the stack pointer in use, and exchanges it.
    fn with_stack_change(&mut self, change: impl FnOnce(&mut Self)) {
        let before = self.stack_in_use();
        self.stacks[before] = self.r[SP];
        change(self);
        self.r[SP] = self.stacks[self.stack_in_use()];
    }

    fn xpsr(&self) -> u32 {
        let flags = u32::from(self.n) << 31
            | u32::from(self.z) << 30
            | u32::from(self.c) << 29
            | u32::from(self.v) << 28
            | u32::from(self.q) << 27
            | u32::from(self.ge) << 16;
        let it = u32::from(self.it & 3) << 25 | u32::from(self.it >> 2) << 10;
        flags | it | 1 << 24 | u32::from(self.ipsr)
    }

    fn set_flags_from(&mut self, xpsr: u32) {
        self.n = xpsr >> 31 & 1 != 0;
        self.z = xpsr >> 30 & 1 != 0;
        self.c = xpsr >> 29 & 1 != 0;
        self.v = xpsr >> 28 & 1 != 0;
        self.q = xpsr >> 27 & 1 != 0;
        self.ge = (xpsr >> 16 & 0xf) as u8;
    }
}
