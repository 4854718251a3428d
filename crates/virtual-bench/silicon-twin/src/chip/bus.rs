//! What the processor's accesses meet.

use super::flash::WrongRead;
use super::memory::{Memory, Region};
use super::refused::Refused;
use super::{Chip, POLLS, Reset, address, rom};
use crate::cpu::instruction::Decoded;
use crate::cpu::{Abort, Bus};
use crate::names;
use crate::profile::Activity;

impl Bus for Chip {
    #[inline]
    fn read<const BYTES: u32>(&mut self, address: u32) -> Result<u32, Abort> {
        let word = match Memory::region(address) {
            Region::Sram(offset) => self.memory.sram::<BYTES>(offset),
            Region::Flash(offset) => {
                self.wait_for_flash(offset);
                if self.peripherals.flash.meets_torn(offset) {
                    self.next_event = 0;
                }
                let stall = self.peripherals.flash.load(offset);
                self.clock.cycles += stall.map_err(|wrong| self.reads_wrongly(address, wrong))?;
                self.memory.flash::<BYTES>(offset)
            }
            Region::Peripheral => return self.read_peripheral(address, BYTES),
            Region::UniqueId(offset) => self.memory.unique_id::<BYTES>(offset),
            Region::FlashSize(offset) => self.memory.flash_size::<BYTES>(offset),
            Region::Nothing => rom::word(address),
        };
        word.ok_or(Abort::Fault)
    }

    #[inline]
    fn write<const BYTES: u32>(&mut self, address: u32, value: u32) -> Result<(), Abort> {
        match Memory::region(address) {
            Region::Sram(offset) => self
                .memory
                .write_sram::<BYTES>(offset, value)
                .ok_or(Abort::Fault),
            Region::Peripheral => self.write_peripheral(address, BYTES, value),
            Region::Flash(offset) => {
                self.wait_for_flash(offset);
                self.next_event = 0;
                let (flash, memory) = (&mut self.peripherals.flash, &self.memory);
                flash.program(offset, BYTES, value, memory, &self.clock);
                Ok(())
            }
            _ => Err(Abort::Fault),
        }
    }

    #[inline]
    fn fetch(&mut self, address: u32) -> Result<Decoded, Abort> {
        match Memory::region_of_code(address) {
            Region::Flash(offset) => {
                self.wait_for_flash(offset);
                let stall = self.peripherals.flash.fetch(offset, self.clock.cycles);
                self.clock.cycles += stall.map_err(|wrong| self.reads_wrongly(address, wrong))?;
                self.memory.instruction(offset).ok_or(Abort::Fault)
            }
            Region::Sram(offset) => self.memory.instruction_in_ram(offset).ok_or(Abort::Fault),
            _ if (rom::ROM..rom::ROM_END).contains(&address) => {
                self.in_bootloader = true;
                Err(Abort::Halt)
            }
            _ => Err(Abort::Fault),
        }
    }

    fn request_reset(&mut self) {
        self.reset = Some(Reset::Software);
        self.next_event = 0;
    }

    fn meant(&self, address: u32, value: u32) -> Option<u32> {
        self.mistaken(address, value)
    }

    fn cycles(&self) -> u64 {
        self.clock.cycles
    }
}

/// Where an address leads in USB's packet memory.
fn packet_memory(address: u32) -> Option<usize> {
    let at = address.checked_sub(address::USBRAM)?;
    (at < 0x400).then_some(at as usize)
}

impl Chip {
    /// The processor waits while its bank of the flash is busy.
    #[inline]
    fn wait_for_flash(&mut self, offset: usize) {
        if let Some(end) = self.peripherals.flash.stall(offset)
            && end > self.clock.cycles
        {
            self.clock.cycles = end;
            self.advance();
        }
    }

    #[cold]
    fn reads_wrongly(&mut self, address: u32, wrong: WrongRead) -> Abort {
        self.refuse(format!(
            "what is read at {address:#010x} {}",
            wrong.sentence()
        ));
        Abort::Halt
    }

    #[cold]
    fn read_peripheral(&mut self, address: u32, bytes: u32) -> Result<u32, Abort> {
        self.advance();
        self.next_event = 0;
        let before = self.doing.begin(Activity::Registers);
        let read = match packet_memory(address) {
            Some(at) => self
                .check_gate(address)
                .and_then(|()| self.peripherals.usb.read_memory(at, bytes)),
            None => {
                let unused = 32 - 8 * bytes;
                let word = self.read_register(address & !3);
                word.map(|word| word >> (8 * (address & 3)) << unused >> unused)
            }
        };
        self.note_poll(address);
        self.doing.resume(before);
        self.or_refuse(read, "read", address)
    }

    #[cold]
    fn write_peripheral(&mut self, address: u32, bytes: u32, value: u32) -> Result<(), Abort> {
        self.advance();
        self.next_event = 0;
        self.polled = (0, 0);
        // Half a register is written where the other half is not used, as in all that this chip has of 16 bits.
        let before = self.doing.begin(Activity::Registers);
        let written = match packet_memory(address) {
            Some(at) => {
                let usb = &mut self.peripherals.usb;
                usb.write_memory(at, bytes, value)
                    .and(self.check_gate(address))
            }
            None if bytes == 1 || address & 3 != 0 => Err(Refused::NotModelled),
            None => self.write_register(address, value),
        };
        self.doing.resume(before);
        self.or_refuse(written, "written", address)
    }

    /// A loop that reads one register, and nothing else, for too long.
    fn note_poll(&mut self, address: u32) {
        self.polled = match self.polled {
            (last, count) if last == address => (last, count + 1),
            _ => (address, 1),
        };
        if self.polled.1 > POLLS {
            let name = names::register(address);
            self.refuse(format!(
                "{name} is read again and again, and never says what is waited for"
            ));
        }
    }

    fn or_refuse<T>(
        &mut self,
        result: Result<T, Refused>,
        done: &str,
        at: u32,
    ) -> Result<T, Abort> {
        match result {
            Ok(_) if self.refused.is_some() => Err(Abort::Halt),
            Ok(value) => Ok(value),
            Err(Refused::Misuse(sentence)) => {
                self.refuse(sentence);
                Err(Abort::Halt)
            }
            Err(Refused::NotModelled) => {
                let name = names::register(at);
                self.refuse(format!(
                    "{name} is {done}, which is not modelled ({at:#010x})"
                ));
                Err(Abort::Halt)
            }
        }
    }
}
