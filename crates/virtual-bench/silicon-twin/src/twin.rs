//! The chip and its processor, at work.

use std::fmt;

use emulated_board::Upset;

use crate::board::Board;
use crate::chip::memory::{FLASH, SRAM, SRAM_BYTES};
use crate::chip::{Chip, Reset, rom};
use crate::cpu::{Cpu, Halt, NMI, Sleep};
use crate::image::Image;
use crate::profile::Watched;
use crate::timing::Timing;

/// How a run ends that goes to the ROM.
pub const IN_BOOTLOADER: &str =
    "the bootloader in the ROM runs now, and takes new firmware over USB (DFU)";
/// `b .`
const BRANCH_TO_ITSELF: u16 = 0xe7fe;
/// Where this chip has nothing.
const NOWHERE: u32 = 0x6000_0000;
/// What a division by zero calls, in Rust.
const PANICS: &str = "core::panicking::panic_const::panic_const_div_by_zero";
/// A control tick.
const TICK_S: f64 = 1e-4;

/// The board at register level.
#[derive(Clone, Debug)]
pub struct Twin {
    image: Image,
    /// The chip with the board around it.
    pub chip: Chip,
    /// The processor.
    pub cpu: Cpu,
    resets: Vec<Reset>,
    /// How long the program handles what.
    pub timing: Timing,
    handled: u16,
    masks: bool,
}

/// Why a run ended before its time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// What happened.
    pub what: String,
    /// The address of the instruction.
    pub at: u32,
    /// The function that it is in.
    pub function: String,
    /// The function that called it, as far as the link register tells.
    pub caller: String,
    /// When, in microseconds since power came.
    pub time_us: u64,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}, at {:#010x} in {}, called from {}, after {} us",
            self.what, self.at, self.function, self.caller, self.time_us
        )
    }
}

impl std::error::Error for Failure {}

impl Twin {
    /// A board with this image, when power comes.
    ///
    /// # Errors
    /// Where the image does not begin with vectors.
    pub fn new(image: Image, board: Board) -> Result<Self, Failure> {
        let mut chip = Chip::new(&image, board);
        let cpu = Cpu::new(&mut chip, FLASH).map_err(|_| Failure {
            what: "the image has no vectors at the beginning of the flash".to_owned(),
            at: FLASH,
            function: "no function".to_owned(),
            caller: "no function".to_owned(),
            time_us: 0,
        })?;
        Ok(Self {
            image,
            chip,
            cpu,
            resets: vec![Reset::Power],
            timing: Timing::default(),
            handled: 0,
            masks: false,
        })
    }

    /// The program that runs.
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// What it is at, for another thread.
    pub fn watched(&self) -> Watched {
        self.chip.doing.watched()
    }

    /// Seconds since power came first.
    pub fn seconds(&self) -> f64 {
        self.chip.clock.seconds()
    }

    /// All resets so far, the first of which is that of power.
    pub fn resets(&self) -> &[Reset] {
        &self.resets
    }

    /// Runs for so many seconds of the board's time.
    ///
    /// # Errors
    /// Where the program uses what is not modelled, or uses the chip wrongly, or cannot go on.
    pub fn run_for(&mut self, seconds: f64) -> Result<(), Failure> {
        let end = self.seconds() + seconds;
        self.run_until(|twin| twin.seconds() >= end)
    }

    /// Runs until `is_done`, which is asked at every event of a peripheral.
    ///
    /// # Errors
    /// As [`Self::run_for`].
    pub fn run_until(&mut self, mut is_done: impl FnMut(&Self) -> bool) -> Result<(), Failure> {
        loop {
            self.advance()?;
            if is_done(self) {
                return Ok(());
            }
            self.run_to_event()?;
        }
    }

    /// Everything that is due outside the processor.
    fn advance(&mut self) -> Result<(), Failure> {
        self.chip.advance();
        if let Some(sentence) = self.chip.refused() {
            return Err(self.failure(sentence.to_owned()));
        }
        if let Some(reset) = self.chip.reset_due() {
            self.reset(reset)?;
        }
        self.suffer()?;
        self.cpu.system.set_lines(self.chip.lines());
        self.follow_nmi_line();
        Ok(())
    }

    /// What raises the non-maskable interrupt does so whenever its handler does not run, as the level of any interrupt's line.
    fn follow_nmi_line(&mut self) {
        if self.chip.nmi_line() && self.cpu.exception() != NMI {
            self.cpu.system.pend_nmi();
        }
    }

    /// What the bench does to the processor.
    fn suffer(&mut self) -> Result<(), Failure> {
        let disturbance = self.chip.take_disturbance();
        if disturbance.missed_ticks > 0 {
            // What is due at its end takes place.
            let ticks = f64::from(disturbance.missed_ticks) + 1.0;
            self.halt(ticks * TICK_S);
        }
        match disturbance.upset {
            None => {}
            Some(Upset::Panic) => self.panic()?,
            Some(Upset::HardFault) => self.derail(NOWHERE),
            Some(Upset::Hang) => self.hang(),
            Some(Upset::Reset) => self.reset(Reset::Software)?,
            Some(Upset::BrownOut) => self.reset(Reset::Power)?,
        }
        Ok(())
    }

    /// The processor stands still, and nothing else does.
    fn halt(&mut self, seconds: f64) {
        let end = self.chip.clock.cycle_in(seconds);
        while self.chip.clock.cycles < end {
            self.chip.clock.cycles = self.chip.next_event().clamp(self.chip.clock.cycles, end);
            self.chip.advance();
        }
        // What the bench did meanwhile met nobody.
        let _ = self.chip.take_disturbance();
    }

    /// Resets the chip, as its reset pin, its watchdog or a lack of power does.
    ///
    /// # Errors
    /// Where the image does not begin with vectors.
    pub fn reset(&mut self, reset: Reset) -> Result<(), Failure> {
        self.resets.push(reset);
        self.chip.reset(reset);
        let stops_at_faults = self.cpu.stops_at_faults;
        self.cpu = Cpu::new(&mut self.chip, FLASH)
            .map_err(|_| self.failure("there are no vectors after the reset".to_owned()))?;
        self.cpu.stops_at_faults = stops_at_faults;
        self.timing.forget();
        (self.handled, self.masks) = (0, false);
        Ok(())
    }

    /// The bootloader in the ROM has been run, and goes to the program that it has written: without a reset, with its own
    /// clocks and vectors.
    ///
    /// # Errors
    /// Where the image does not begin with vectors.
    pub fn leave_bootloader(&mut self) -> Result<(), Failure> {
        self.reset(Reset::Software)?;
        self.chip
            .leave_rom()
            .map_err(|refused| self.failure(format!("the ROM's own set-up: {refused:?}")))?;
        self.cpu.system.set_vectors(rom::ROM);
        Ok(())
    }

    /// Lets the program go round in the last half-word of the RAM, as one with a defect may: with interrupts masked.
    pub fn hang(&mut self) {
        let last = SRAM_BYTES - 2;
        let loop_here = u32::from(BRANCH_TO_ITSELF);
        // It is within the RAM.
        let _ = self.chip.memory.write_sram::<2>(last, loop_here);
        self.cpu.divert(SRAM + last as u32);
    }

    /// Lets the program find a defect in itself: it divides by zero, as far as it knows.
    ///
    /// # Errors
    /// Where it cannot panic: no function of the image does.
    pub fn panic(&mut self) -> Result<(), Failure> {
        let Some(panics) = self.image.function_at(PANICS) else {
            return Err(self.failure("no function of the image panics".to_owned()));
        };
        // Its only argument is a place in the source: an empty name (any address, length 0), line and column.
        let place = SRAM_BYTES - 32;
        for (at, word) in (place..).step_by(4).zip([1, 0, 1, 1]) {
            // It is within the RAM.
            let _ = self.chip.memory.write_sram::<4>(at, word);
        }
        self.cpu.call(panics, SRAM + place as u32);
        Ok(())
    }

    /// Lets the program go on where it should not, at `address`, and handle the faults that come of it.
    pub fn derail(&mut self, address: u32) {
        self.cpu.stops_at_faults = false;
        self.cpu.divert(address);
    }

    /// One instruction, or sleep up to the next event; what is due by then outside the processor.
    ///
    /// # Errors
    /// As [`Self::run_for`].
    pub fn step(&mut self) -> Result<(), Failure> {
        self.execute()?;
        match self.chip.clock.cycles >= self.chip.next_event() {
            true => self.advance(),
            false => Ok(()),
        }
    }

    /// Executes instructions up to the next event.
    fn run_to_event(&mut self) -> Result<(), Failure> {
        while self.chip.clock.cycles < self.chip.next_event() {
            self.execute()?;
        }
        Ok(())
    }

    #[inline]
    fn execute(&mut self) -> Result<(), Failure> {
        match self.cpu.step(&mut self.chip) {
            Ok(0) => self.sleep()?,
            Ok(cycles) => self.chip.clock.cycles += u64::from(cycles),
            Err(halt) => return Err(self.halted(halt)),
        }
        let cycle = self.chip.clock.cycles;
        if self.cpu.exception() != self.handled {
            self.handled = self.cpu.exception();
            self.timing
                .change(self.handled, cycle, self.chip.trace.last());
            self.follow_nmi_line();
        }
        if self.cpu.masks_interrupts() != self.masks {
            self.masks = self.cpu.masks_interrupts();
            self.timing.mask(self.masks, cycle, self.cpu.next());
        }
        Ok(())
    }

    /// The processor sleeps until the next event.
    fn sleep(&mut self) -> Result<(), Failure> {
        if self.cpu.sleep() == Sleep::Awake {
            return Ok(());
        }
        if self.cpu.is_deaf() {
            let what = "the processor sleeps, and no interrupt is enabled that could wake it";
            return Err(self.failure(what.to_owned()));
        }
        let next = self.chip.next_event();
        let slept = next.saturating_sub(self.chip.clock.cycles);
        self.timing.asleep += slept;
        self.chip.clock.cycles += slept;
        Ok(())
    }

    fn halted(&self, halt: Halt) -> Failure {
        let what = match halt {
            Halt::Bus if self.chip.is_in_bootloader() => IN_BOOTLOADER.to_owned(),
            Halt::Bus => match self.chip.refused() {
                Some(sentence) => sentence.to_owned(),
                None => "memory refuses".to_owned(),
            },
            Halt::NotModelled(what) => format!("{what} is not modelled"),
            Halt::Fault(fault) => fault.to_string(),
            Halt::Lockup(fault) => {
                format!("the processor locks up by a fault within a fault: {fault}")
            }
        };
        self.failure(what)
    }

    /// What happened, where the processor is.
    fn failure(&self, what: String) -> Failure {
        let at = self.cpu.next();
        Failure {
            what,
            at,
            function: self.image.function(at).to_owned(),
            caller: self.image.function(self.cpu.link() & !1).to_owned(),
            time_us: (self.seconds() * 1e6) as u64,
        }
    }
}

#[cfg(test)]
mod tests {
    use emulated_board::Connected;

    use super::*;

    /// `LDR r0, [pc, #4]`, `LDR r1, [r0]`, and `rest`, where r0 is `address`.
    fn reads(address: u32, rest: u16) -> [u16; 6] {
        let [low, high] = [address as u16, (address >> 16) as u16];
        [0x4801, 0x6801, rest, 0xbf00, low, high]
    }

    /// `NOP`, and a loop back to the read.
    const NOP: u16 = 0xbf00;
    const BACK: u16 = 0xe7fd;

    #[test]
    fn what_a_program_must_not_do_is_told_in_a_sentence_with_its_place() {
        for (code, told, at) in [
            // Erased flash behind the program reads as 0xffff, which is no instruction.
            (&[NOP][..], "this instruction is not modelled", "0x0800000a"),
            // `MOV r0, #6`, `LSL r0, #28`, `ADD r0, #1`, `BX r0`
            (
                &[0x2006, 0x0700, 0x3001, 0x4700],
                "there is no code at 0x60000000",
                "0x60000000",
            ),
            (
                &reads(0x6000_0000, NOP),
                "there is nothing at address 0x60000000",
                "0x0800000a",
            ),
            (
                &reads(0x4000_0000, NOP),
                "TIM2.CR1 is read, which is not modelled",
                "0x0800000a",
            ),
            (
                &reads(0x4fff_0000, NOP),
                "where this chip has no register",
                "0x0800000a",
            ),
            (
                &reads(0x4000_7000, NOP),
                "PWR.CR1 is used while its peripheral has no clock",
                "0x0800000a",
            ),
            // RCC.CR, in which nothing that was not switched on becomes ready.
            (
                &reads(0x4002_1000, BACK),
                "RCC.CR is read again and again, and never says what is waited for",
                "0x0800000a",
            ),
            // `WFI`
            (
                &[0xbf30],
                "the processor sleeps, and no interrupt is enabled that could wake it",
                "0x0800000a",
            ),
        ] {
            let board = Board::new(&Connected::Resistors([499.0; 4])).expect("resistors");
            let mut twin = Twin::new(Image::of(code), board).expect("vectors");
            let failure = twin.run_for(1.0).expect_err("it ends");
            assert!(failure.what.contains(told), "{failure}");
            assert_eq!(format!("{:#010x}", failure.at), at, "{failure}");
            let sentence = failure.to_string();
            assert!(sentence.contains(" us"), "{sentence}");
        }
    }
}
