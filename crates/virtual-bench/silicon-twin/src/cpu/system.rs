//! The registers that belong to the processor: NVIC and system control (ARMv7-M manual, sections B3.2 and B3.4).

use super::exceptions::{FIRST_INTERRUPT, Fault, HARD_FAULT, IDLE, NMI, SUPERVISOR_CALL};
use super::{Bus, Cpu, Executed, Halt, Trap};

/// Cortex-M4, r0p1 (DDI 0439B, table 4-1).
const CPUID: u32 = 0x410f_c241;
/// Priority bits that this chip has (RM0440, section 14.2).
const PRIORITY_MASK: u8 = 0xf0;
/// What must stand above a write to AIRCR, and what is read there.
const VECTOR_KEY: u32 = 0x05fa;
const VECTOR_KEY_READ: u32 = 0xfa05 << 16;
/// HFSR.FORCED: a fault that could not be handled as what it is.
const FORCED: u32 = 1 << 30;
/// FPCCR: automatic and lazy state preservation, and that some is due.
const ASPEN: u32 = 1 << 31;
const LSPEN: u32 = 1 << 30;
const LSPACT: u32 = 1;
/// CCR: stack alignment, as it is after reset.
const STACK_ALIGN: u32 = 1 << 9;
const DIVISION_TRAPS: u32 = 1 << 4;
/// SHCSR: what is enabled of MemManage, BusFault and UsageFault.
const FAULT_ENABLES: u32 = 0b111 << 16;

/// Addresses.
mod at {
    pub(super) const DWT_CTRL: u32 = 0xe000_1000;
    pub(super) const DWT_CYCCNT: u32 = 0xe000_1004;
    pub(super) const ISER: u32 = 0xe000_e100;
    pub(super) const ICER: u32 = 0xe000_e180;
    pub(super) const ISPR: u32 = 0xe000_e200;
    pub(super) const ICPR: u32 = 0xe000_e280;
    pub(super) const IABR: u32 = 0xe000_e300;
    pub(super) const IPR: u32 = 0xe000_e400;
    pub(super) const IPR_END: u32 = 0xe000_e480;
    pub(super) const CPUID: u32 = 0xe000_ed00;
    pub(super) const ICSR: u32 = 0xe000_ed04;
    pub(super) const VTOR: u32 = 0xe000_ed08;
    pub(super) const AIRCR: u32 = 0xe000_ed0c;
    pub(super) const SCR: u32 = 0xe000_ed10;
    pub(super) const CCR: u32 = 0xe000_ed14;
    pub(super) const SHPR: u32 = 0xe000_ed18;
    pub(super) const SHPR_END: u32 = 0xe000_ed24;
    pub(super) const SHCSR: u32 = 0xe000_ed24;
    pub(super) const CFSR: u32 = 0xe000_ed28;
    pub(super) const HFSR: u32 = 0xe000_ed2c;
    pub(super) const BFAR: u32 = 0xe000_ed38;
    pub(super) const CPACR: u32 = 0xe000_ed88;
    pub(super) const DEMCR: u32 = 0xe000_edfc;
    pub(super) const STIR: u32 = 0xe000_ef00;
    pub(super) const FPCCR: u32 = 0xe000_ef34;
    pub(super) const FPCAR: u32 = 0xe000_ef38;
    pub(super) const FPDSCR: u32 = 0xe000_ef3c;
}

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

/// Which word of four an address names, of those from `first` on.
fn index(address: u32, first: u32) -> Option<u32> {
    let index = address.checked_sub(first)? / 4;
    (index < 4).then_some(index)
}

impl Cpu {
    #[cold]
    pub(super) fn read_system(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
        bytes: u32,
    ) -> Executed<u32> {
        let word = self.system_word(bus, address & !3)?;
        let unused = 32 - 8 * bytes;
        Ok(word >> (8 * (address & 3)) << unused >> unused)
    }

    fn system_word(&mut self, bus: &mut impl Bus, address: u32) -> Executed<u32> {
        let ipsr = self.ipsr;
        let system = &self.system;
        let word_of = |mask: u128, index: u32| (mask >> (32 * index)) as u32;
        for (first, mask) in [
            (at::ISER, system.enabled),
            (at::ICER, system.enabled),
            (at::ISPR, system.pending),
            (at::ICPR, system.pending),
            (at::IABR, system.active),
        ] {
            if let Some(index) = index(address, first) {
                return Ok(word_of(mask, index));
            }
        }
        Ok(match address {
            at::DWT_CTRL => system.dwt_ctrl,
            at::DWT_CYCCNT => bus.cycles().wrapping_sub(system.cycles_at_zero) as u32,
            at::IPR..at::IPR_END => bytes_at(&system.priorities, address - at::IPR),
            at::SHPR..at::SHPR_END => bytes_at(&system.own_priorities, address - at::SHPR + 4),
            at::CPUID => CPUID,
            at::ICSR => {
                let next = system.most_urgent().map_or(0, |(number, _)| number);
                let any = u32::from(system.pending & system.enabled != 0);
                any << 22 | u32::from(next) << 12 | u32::from(ipsr)
            }
            at::VTOR => system.vtor,
            at::AIRCR => VECTOR_KEY_READ | system.group_shift << 8,
            at::SCR => system.scr,
            at::CCR => system.ccr,
            at::SHCSR => system.shcsr,
            at::CFSR => system.cfsr,
            at::HFSR => system.hfsr,
            at::BFAR => system.bfar,
            at::CPACR => system.cpacr,
            at::DEMCR => system.demcr,
            at::FPCCR => system.fpccr,
            at::FPCAR => system.fpcar,
            at::FPDSCR => system.fpdscr,
            _ => return Err(lacks(address)),
        })
    }

    #[cold]
    pub(super) fn write_system(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
        bytes: u32,
        value: u32,
    ) -> Executed<()> {
        let Some(value) = bus.meant(address, value) else {
            return Ok(());
        };
        let system = &mut self.system;
        system.attention = true;
        let little = value.to_le_bytes();
        let written = little
            .iter()
            .take(bytes as usize)
            .map(|byte| byte & PRIORITY_MASK);
        if (at::IPR..at::IPR_END).contains(&address) {
            let first = (address - at::IPR) as usize;
            let slots = system.priorities.iter_mut().skip(first);
            slots.zip(written).for_each(|(slot, byte)| *slot = byte);
            system.find_active_priority();
            return Ok(());
        }
        if (at::SHPR..at::SHPR_END).contains(&address) {
            let first = (address - at::SHPR + 4) as usize;
            let slots = system.own_priorities.iter_mut().skip(first);
            slots.zip(written).for_each(|(slot, byte)| *slot = byte);
            system.find_active_priority();
            return Ok(());
        }
        if bytes != 4 {
            return Err(lacks(address));
        }
        self.write_system_word(bus, address, value)
    }

    fn write_system_word(&mut self, bus: &mut impl Bus, address: u32, value: u32) -> Executed<()> {
        let system = &mut self.system;
        if let Some(index) = index(address, at::ISER) {
            System::set_word(&mut system.enabled, index, |word| word | value);
            return Ok(());
        }
        if let Some(index) = index(address, at::ICER) {
            System::set_word(&mut system.enabled, index, |word| word & !value);
            return Ok(());
        }
        if let Some(index) = index(address, at::ISPR) {
            System::set_word(&mut system.pending, index, |word| word | value);
            return Ok(());
        }
        if let Some(index) = index(address, at::ICPR) {
            System::set_word(&mut system.pending, index, |word| word & !value);
            // What is still asked for stays pending.
            system.pending |= system.lines & !system.active;
            return Ok(());
        }
        match address {
            at::DWT_CTRL => system.dwt_ctrl = value & 1,
            at::DWT_CYCCNT => system.cycles_at_zero = bus.cycles().wrapping_sub(value.into()),
            at::ICSR if value >> 31 != 0 => system.pend_nmi(),
            at::VTOR => system.vtor = value & !0x7f,
            at::AIRCR if value >> 16 != VECTOR_KEY => {}
            at::AIRCR => {
                system.group_shift = value >> 8 & 7;
                system.find_active_priority();
                if value & 4 != 0 {
                    bus.request_reset();
                }
            }
            at::SCR if value & 4 != 0 => return Err(lacks(address)),
            at::SCR => system.scr = value & 0x16,
            at::CCR => system.ccr = value & (STACK_ALIGN | DIVISION_TRAPS),
            at::SHCSR => system.shcsr = value & FAULT_ENABLES,
            at::CFSR => system.cfsr &= !value,
            at::HFSR => system.hfsr &= !value,
            at::CPACR => {
                system.cpacr = value & 0xf << 20;
                self.is_float_ready = false;
            }
            at::DEMCR => system.demcr = value & 1 << 24,
            at::STIR => system.pending |= 1 << (value & 0x7f),
            at::FPCCR => system.fpccr = value & (ASPEN | LSPEN) | system.fpccr & LSPACT,
            at::FPDSCR if value == 0 => system.fpdscr = 0,
            _ => return Err(lacks(address)),
        }
        Ok(())
    }
}

fn bytes_at(bytes: &[u8], first: u32) -> u32 {
    (0..4).fold(0, |word, i| {
        word | u32::from(bytes[(first + i) as usize]) << (8 * i)
    })
}

fn lacks(address: u32) -> Trap {
    let what = format!("the processor's register at {address:#010x}, as it is used");
    Trap::Halt(Halt::NotModelled(what))
}
