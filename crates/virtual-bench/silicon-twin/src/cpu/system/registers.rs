//! Its registers (ARMv7-M manual, sections B3.2 and B3.4).

use super::{ASPEN, DIVISION_TRAPS, LSPACT, LSPEN, STACK_ALIGN, System};
use crate::cpu::{Bus, Cpu, Executed, Halt, Trap};

/// Cortex-M4, r0p1 (DDI 0439B, table 4-1).
const CPUID: u32 = 0x410f_c241;
/// Priority bits that this chip has (RM0440, section 14.2).
const PRIORITY_MASK: u8 = 0xf0;
/// What must stand above a write to AIRCR, and what is read there.
const VECTOR_KEY: u32 = 0x05fa;
const VECTOR_KEY_READ: u32 = 0xfa05 << 16;
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

/// Which word of four an address names, of those from `first` on.
fn index(address: u32, first: u32) -> Option<u32> {
    let index = address.checked_sub(first)? / 4;
    (index < 4).then_some(index)
}

impl Cpu {
    #[cold]
    pub(in crate::cpu) fn read_system(
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
    pub(in crate::cpu) fn write_system(
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
