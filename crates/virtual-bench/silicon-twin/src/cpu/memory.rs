//! Loads and stores.

use super::instruction::{Access, Index};
use super::{Abort, Bus, Cpu, Executed, Fault, Halt, PC, SP, Trap};

/// The processor's own registers begin here (ARMv7-M manual, section B3.1.1).
const PRIVATE_BUS: u32 = 0xe000_0000;
const PRIVATE_BUS_END: u32 = 0xe010_0000;

impl Cpu {
    #[inline]
    pub(super) fn load<const BYTES: u32>(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
    ) -> Executed<u32> {
        if (PRIVATE_BUS..PRIVATE_BUS_END).contains(&address) && self.owns(address) {
            return self.read_system(bus, address, BYTES);
        }
        bus.read::<BYTES>(address)
            .map_err(|abort| aborted(abort, address))
    }

    #[inline]
    pub(super) fn store<const BYTES: u32>(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
        value: u32,
    ) -> Executed<()> {
        if (PRIVATE_BUS..PRIVATE_BUS_END).contains(&address) && self.owns(address) {
            return self.write_system(bus, address, BYTES, value);
        }
        bus.write::<BYTES>(address, value)
            .map_err(|abort| aborted(abort, address))
    }

    /// What the processor answers itself; DBGMCU, further up, is the chip's (RM0440, section 47.6).
    fn owns(&self, address: u32) -> bool {
        address < 0xe004_0000
    }

    /// An access of one register; a base that changes does so only if it succeeds.
    #[inline]
    pub(super) fn access(
        &mut self,
        bus: &mut impl Bus,
        access: Access,
        rt: u8,
        address: u32,
        new_base: Option<(u8, u32)>,
    ) -> Executed {
        let target = usize::from(rt);
        let loaded = match access {
            Access::LoadWord => Some(self.load::<4>(bus, address)?),
            Access::LoadHalf => Some(self.load::<2>(bus, address)?),
            Access::LoadByte => Some(self.load::<1>(bus, address)?),
            Access::LoadSignedHalf => Some(self.load::<2>(bus, address)? as i16 as u32),
            Access::LoadSignedByte => Some(self.load::<1>(bus, address)? as i8 as u32),
            Access::StoreWord => {
                self.store::<4>(bus, address, self.r[target])?;
                None
            }
            Access::StoreHalf => {
                self.store::<2>(bus, address, self.r[target] & 0xffff)?;
                None
            }
            Access::StoreByte => {
                self.store::<1>(bus, address, self.r[target] & 0xff)?;
                None
            }
        };
        if let Some((rn, base)) = new_base {
            self.r[usize::from(rn)] = base;
        }
        match loaded {
            Some(value) if target == PC => {
                self.branch_exchange(bus, value)?;
                Ok(2 + REFILL)
            }
            Some(value) => {
                self.r[target] = value;
                Ok(2)
            }
            None => Ok(2),
        }
    }

    #[inline]
    pub(super) fn access_at(
        &mut self,
        bus: &mut impl Bus,
        access: Access,
        index: Index,
        rt: u8,
        rn: u8,
        offset: i32,
    ) -> Executed {
        let (address, new_base) = self.indexed(index, rn, offset);
        self.access(bus, access, rt, address, new_base)
    }

    /// The address, and what becomes of its base.
    #[inline]
    fn indexed(&self, index: Index, rn: u8, offset: i32) -> (u32, Option<(u8, u32)>) {
        let base = match usize::from(rn) {
            PC => self.r[PC] & !3,
            rn => self.r[rn],
        };
        let moved = base.wrapping_add_signed(offset);
        match index {
            Index::Offset => (moved, None),
            Index::Before => (moved, Some((rn, moved))),
            Index::After => (base, Some((rn, moved))),
        }
    }

    pub(super) fn access_two(
        &mut self,
        bus: &mut impl Bus,
        load: bool,
        index: Index,
        [rt, rt2, rn]: [u8; 3],
        offset: i32,
    ) -> Executed {
        let (address, new_base) = self.indexed(index, rn, offset);
        aligned(address)?;
        if load {
            let first = self.load::<4>(bus, address)?;
            let second = self.load::<4>(bus, address.wrapping_add(4))?;
            self.r[usize::from(rt)] = first;
            self.r[usize::from(rt2)] = second;
        } else {
            self.store::<4>(bus, address, self.r[usize::from(rt)])?;
            self.store::<4>(bus, address.wrapping_add(4), self.r[usize::from(rt2)])?;
        }
        if let Some((rn, base)) = new_base {
            self.r[usize::from(rn)] = base;
        }
        Ok(3)
    }

    pub(super) fn access_multiple(
        &mut self,
        bus: &mut impl Bus,
        load: bool,
        decrement: bool,
        writeback: bool,
        rn: u8,
        registers: u16,
    ) -> Executed {
        let base = self.r[usize::from(rn)];
        let count = registers.count_ones();
        let lowest = match decrement {
            true => base.wrapping_sub(4 * count),
            false => base,
        };
        aligned(lowest)?;
        let listed = (0..16).filter(|register| registers >> register & 1 != 0);
        let mut loaded = [0; 16];
        for (address, register) in (0..)
            .map(|i| lowest.wrapping_add(4 * i))
            .zip(listed.clone())
        {
            match load {
                true => loaded[register] = self.load::<4>(bus, address)?,
                false => self.store::<4>(bus, address, self.r[register])?,
            }
        }
        if writeback {
            self.r[usize::from(rn)] = match decrement {
                true => lowest,
                false => base.wrapping_add(4 * count),
            };
        }
        if load {
            for register in listed.filter(|register| *register != PC) {
                self.r[register] = loaded[register];
            }
            if registers >> PC != 0 {
                self.r[SP] &= !3;
                self.branch_exchange(bus, loaded[PC])?;
                return Ok(1 + count + REFILL);
            }
        }
        Ok(1 + count)
    }

    pub(super) fn load_exclusive(
        &mut self,
        bus: &mut impl Bus,
        bytes: u8,
        rt: u8,
        address: u32,
    ) -> Executed {
        self.exclusive = Some(address);
        let access = match bytes {
            1 => Access::LoadByte,
            2 => Access::LoadHalf,
            _ => Access::LoadWord,
        };
        self.access(bus, access, rt, address, None)
    }

    /// Writes where nothing came between, and says whether it did: 0 for yes.
    pub(super) fn store_exclusive(
        &mut self,
        bus: &mut impl Bus,
        bytes: u8,
        [rd, rt]: [u8; 2],
        address: u32,
    ) -> Executed {
        let is_held = self.exclusive.take() == Some(address);
        if is_held {
            let access = match bytes {
                1 => Access::StoreByte,
                2 => Access::StoreHalf,
                _ => Access::StoreWord,
            };
            self.access(bus, access, rt, address, None)?;
        }
        self.r[usize::from(rd)] = u32::from(!is_held);
        Ok(2)
    }
}

/// Cycles of a pipeline that is filled anew: 1 to 3, by the alignment of the target and its wait states; without those, 2.
pub(super) const REFILL: u32 = 2;

/// What must be aligned whatever CCR says: all but single loads and stores (section A3.2.1).
pub(super) fn aligned(address: u32) -> Executed<()> {
    match address & 3 {
        0 => Ok(()),
        _ => Err(Trap::Fault(Fault::unaligned(address))),
    }
}

fn aborted(abort: Abort, address: u32) -> Trap {
    match abort {
        Abort::Fault => Trap::Fault(Fault::data(address)),
        Abort::Halt => Trap::Halt(Halt::Bus),
    }
}
