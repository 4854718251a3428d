//! What belongs to the processor: NVIC and system control (ARMv7-M manual, sections B3.2 and B3.4).

mod registers;

use super::fault::{FIRST_INTERRUPT, Fault, HARD_FAULT, IDLE, NMI, SUPERVISOR_CALL};

/// HFSR.FORCED: a fault that could not be handled as what it is.
const FORCED: u32 = 1 << 30;
/// FPCCR: automatic and lazy state preservation, and that some is due.
const ASPEN: u32 = 1 << 31;
const LSPEN: u32 = 1 << 30;
const LSPACT: u32 = 1;
/// CCR: stack alignment, as it is after reset.
const STACK_ALIGN: u32 = 1 << 9;
const DIVISION_TRAPS: u32 = 1 << 4;

/// NVIC and system control.
#[derive(Clone, Debug)]
pub struct System {
    /// Something changed that may let an exception in.
    pub(crate) attention: bool,
    lines: u128,
    enabled: u128,
    pending: u128,
    active: u128,
    priorities: [u8; 128],
    /// The processor's own exceptions, by number.
    own_pending: u16,
    own_active: u16,
    own_priorities: [u8; 16],
    active_priority: i16,
    vtor: u32,
    group_shift: u32,
    scr: u32,
    ccr: u32,
    shcsr: u32,
    cfsr: u32,
    hfsr: u32,
    bfar: u32,
    cpacr: u32,
    fpccr: u32,
    fpcar: u32,
    fpdscr: u32,
    demcr: u32,
    dwt_ctrl: u32,
    cycles_at_zero: u64,
}

impl System {
    pub(super) fn new(vectors: u32) -> Self {
        Self {
            attention: true,
            lines: 0,
            enabled: 0,
            pending: 0,
            active: 0,
            priorities: [0; 128],
            own_pending: 0,
            own_active: 0,
            own_priorities: [0; 16],
            active_priority: IDLE,
            vtor: vectors,
            group_shift: 0,
            scr: 0,
            ccr: STACK_ALIGN,
            shcsr: 0,
            cfsr: 0,
            hfsr: 0,
            bfar: 0,
            cpacr: 0,
            fpccr: ASPEN | LSPEN,
            fpcar: 0,
            fpdscr: 0,
            demcr: 0,
            dwt_ctrl: 0,
            cycles_at_zero: 0,
        }
    }

    /// Which interrupt lines the peripherals hold high; one that rises is pending (section B3.4.1).
    #[inline]
    pub fn set_lines(&mut self, lines: u128) {
        if lines == self.lines {
            return;
        }
        let rising = lines & !self.lines;
        self.lines = lines;
        self.pending |= rising;
        self.attention |= rising != 0;
    }

    /// A non-maskable interrupt is due.
    pub fn pend_nmi(&mut self) {
        self.own_pending |= 1 << NMI;
        self.attention = true;
    }

    pub(super) fn pend_supervisor_call(&mut self) {
        self.own_pending |= 1 << SUPERVISOR_CALL;
        self.attention = true;
    }

    /// Whether any interrupt is enabled.
    pub fn any_enabled(&self) -> bool {
        self.enabled != 0
    }

    /// Where the vectors are that a program before this one has left (VTOR).
    pub(crate) fn set_vectors(&mut self, vectors: u32) {
        self.vtor = vectors;
    }

    pub(super) fn vectors(&self) -> u32 {
        self.vtor
    }

    /// The part of a priority that lets one exception preempt another.
    pub(super) fn group(&self, priority: u8) -> i16 {
        let mask = u32::MAX << (self.group_shift + 1);
        (u32::from(priority) & mask) as i16
    }

    fn priority(&self, exception: u16) -> (i16, u8) {
        match exception {
            NMI => (-2, 0),
            HARD_FAULT => (-1, 0),
            _ => {
                let raw = match exception.checked_sub(FIRST_INTERRUPT) {
                    Some(interrupt) => self.priorities[usize::from(interrupt)],
                    None => self.own_priorities[usize::from(exception)],
                };
                (self.group(raw), raw)
            }
        }
    }

    /// The most urgent of the pending exceptions, and its priority; of equal ones the lower number.
    pub(super) fn most_urgent(&self) -> Option<(u16, i16)> {
        let own = (2..FIRST_INTERRUPT).filter(|number| self.own_pending >> number & 1 != 0);
        own.chain(numbers(self.pending & self.enabled))
            .map(|number| (self.priority(number), number))
            .min()
            .map(|((group, _), number)| (number, group))
    }

    pub(super) fn active_priority(&self) -> i16 {
        self.active_priority
    }

    pub(super) fn activate(&mut self, exception: u16) {
        match exception.checked_sub(FIRST_INTERRUPT) {
            Some(interrupt) => {
                self.pending &= !(1 << interrupt);
                self.active |= 1 << interrupt;
            }
            None => {
                self.own_pending &= !(1 << exception);
                self.own_active |= 1 << exception;
            }
        }
        self.find_active_priority();
    }

    /// A line that is still high is pending again (section B3.4.1).
    pub(super) fn deactivate(&mut self, exception: u16) {
        match exception.checked_sub(FIRST_INTERRUPT) {
            Some(interrupt) => {
                self.active &= !(1 << interrupt);
                self.pending |= self.lines & 1 << interrupt;
            }
            None => self.own_active &= !(1 << exception),
        }
        self.find_active_priority();
    }

    fn find_active_priority(&mut self) {
        let own = (2..FIRST_INTERRUPT).filter(|number| self.own_active >> number & 1 != 0);
        let groups = own
            .chain(numbers(self.active))
            .map(|number| self.priority(number).0);
        self.active_priority = groups.min().unwrap_or(IDLE);
    }

    /// Notes a fault for the program to read.
    pub(super) fn record(&mut self, fault: Fault) {
        self.cfsr |= fault.status;
        if let Some(address) = fault.address {
            self.bfar = address;
        }
    }

    /// Priority of a fault's own handler, where that is enabled.
    pub(super) fn fault_priority(&self, exception: u16) -> Option<i16> {
        let is_enabled = self.shcsr >> (12 + exception) & 1 != 0;
        is_enabled.then(|| self.priority(exception).0)
    }

    pub(super) fn escalate(&mut self) {
        self.hfsr |= FORCED;
    }

    pub(super) fn traps_division_by_zero(&self) -> bool {
        self.ccr & DIVISION_TRAPS != 0
    }

    pub(super) fn sleeps_on_exit(&self) -> bool {
        self.scr & 2 != 0
    }

    /// Full access to coprocessors 10 and 11.
    pub(super) fn is_float_enabled(&self) -> bool {
        self.cpacr >> 20 & 0xf == 0xf
    }

    pub(super) fn default_float_status(&self) -> u32 {
        self.fpdscr
    }

    pub(super) fn keeps_floats_lazily(&self) -> bool {
        self.fpccr & LSPEN != 0
    }

    pub(super) fn are_floats_pending(&self) -> bool {
        self.fpccr & LSPACT != 0
    }

    pub(super) fn set_floats_pending(&mut self, are_pending: bool) {
        self.fpccr = self.fpccr & !LSPACT | u32::from(are_pending);
    }

    pub(super) fn reserve_float_frame(&mut self, at: u32) {
        self.fpcar = at;
    }

    pub(super) fn float_frame(&self) -> u32 {
        self.fpcar
    }

    fn set_word(mask: &mut u128, index: u32, change: impl FnOnce(u32) -> u32) {
        let shift = 32 * index;
        let word = change((*mask >> shift) as u32);
        *mask = *mask & !(0xffff_ffff << shift) | u128::from(word) << shift;
    }
}

/// The exceptions of the interrupts in `mask`.
fn numbers(mut mask: u128) -> impl Iterator<Item = u16> {
    std::iter::from_fn(move || {
        let interrupt = mask.trailing_zeros() as u16;
        mask &= mask.wrapping_sub(1);
        (interrupt < 128).then_some(FIRST_INTERRUPT + interrupt)
    })
}
