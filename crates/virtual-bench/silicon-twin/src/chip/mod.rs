//! The STM32G474RE around its processor.

mod adc;
pub(crate) mod address;
mod bus;
mod crs;
mod flash;
mod gpio;
pub(crate) mod interrupt;
mod iwdg;
pub mod memory;
mod mistake;
mod pins;
mod pwr;
mod rcc;
mod refused;
mod registers;
pub(crate) mod rom;
mod small;
mod time;
mod timer;
mod trace;
pub mod usb;

pub use mistake::Mistake;
pub use rcc::Reset;
pub use time::Clock;
pub(crate) use time::NEVER;
pub(crate) use timer::Output;
pub use trace::{Tick, Trace};

use crate::board::{Board, Disturbance};
use crate::image::Image;
use crate::profile::{Activity, Doing};
use crate::usb_host::UsbHost;
use adc::Adc;
use crs::Crs;
use flash::Flash;
use gpio::Port;
use iwdg::Iwdg;
use memory::Memory;
use pins::Pins;
use pwr::Pwr;
use rcc::Rcc;
use small::{Dbgmcu, Exti, Syscfg};
use timer::Timer;
use usb::Usb;

/// HCLK after a reset: HSI16 (RM0440, section 7.2).
const RESET_HZ: f64 = 16e6;
/// The unique number of this chip, as the one of the tests' own boards.
const UNIQUE_ID: [u8; 12] = *b"\x01\x23\x45\x67\x89\xab\xcd\xef\x01\x23\x45\x67";
/// A register that is read so often with nothing in between is waited for in vain: 30 ms at least, and longer than the
/// erasing of a page.
const POLLS: u32 = 3_000_000;

/// The chip, with the board around it.
#[derive(Clone, Debug)]
pub struct Chip {
    /// Time.
    pub clock: Clock,
    /// Bytes.
    pub memory: Memory,
    /// What is around the chip.
    pub board: Board,
    /// What went out and came in.
    pub trace: Trace,
    /// What is at the other end of the USB cable.
    pub usb_host: UsbHost,
    peripherals: Peripherals,
    pins: Pins,
    lines: u128,
    next_event: u64,
    reset: Option<Reset>,
    refused: Option<String>,
    in_bootloader: bool,
    polled: (u32, u32),
    disturbance: Disturbance,
    pub(crate) doing: Doing,
    mistake: Option<Mistake>,
}

/// What a reset brings back to its beginning.
#[derive(Clone, Debug)]
struct Peripherals {
    rcc: Rcc,
    pwr: Pwr,
    flash: Flash,
    ports: [Port; address::GPIO_PORTS as usize],
    tim1: Timer,
    tim15: Timer,
    adcs: [Adc; 2],
    adc_common: adc::Common,
    iwdg: Iwdg,
    crs: Crs,
    syscfg: Syscfg,
    exti: Exti,
    dbgmcu: Dbgmcu,
    usb: Usb,
}

/// What happens next of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Event {
    Tim1,
    Tim15,
    Adc(usize),
    Flash,
    Watchdog,
    Usb,
    Mirror,
}

impl Peripherals {
    fn new(rcc: Rcc, flash: Flash) -> Self {
        Self {
            rcc,
            pwr: Pwr::new(),
            flash,
            ports: std::array::from_fn(|port| Port::new(port as u32)),
            tim1: Timer::tim1(),
            tim15: Timer::tim15(),
            adcs: [Adc::new("ADC1"), Adc::new("ADC2")],
            adc_common: adc::Common::default(),
            iwdg: Iwdg::new(),
            crs: Crs::new(),
            syscfg: Syscfg::new(),
            exti: Exti::new(),
            dbgmcu: Dbgmcu::new(),
            usb: Usb::new(),
        }
    }

    /// The lines of the interrupts.
    fn lines(&self) -> u128 {
        let (update, compare) = self.tim1.interrupts();
        let (update15, compare15) = self.tim15.interrupts();
        [
            (self.adcs.iter().any(Adc::interrupts), interrupt::ADC1_2),
            (update15 || compare15, interrupt::TIM1_BRK_TIM15),
            (update, interrupt::TIM1_UP_TIM16),
            (compare, interrupt::TIM1_CC),
            (self.flash.interrupts(), interrupt::FLASH),
            (self.usb.interrupts(), interrupt::USB_LP),
        ]
        .into_iter()
        .fold(0, |lines, (is_high, number)| {
            lines | u128::from(is_high) << number
        })
    }
}

impl Chip {
    /// A chip with `image` in its flash, on `board`, when power comes.
    pub fn new(image: &Image, board: Board) -> Self {
        let peripherals = Peripherals::new(Rcc::new(Reset::Power, None), Flash::new());
        let mut chip = Self {
            clock: Clock::new(RESET_HZ),
            memory: Memory::new(&image.segments, UNIQUE_ID),
            board,
            trace: Trace::default(),
            usb_host: UsbHost::default(),
            pins: Pins::default(),
            peripherals,
            lines: 0,
            next_event: 0,
            reset: None,
            refused: None,
            in_bootloader: false,
            polled: (0, 0),
            disturbance: Disturbance::default(),
            doing: Doing::default(),
            mistake: None,
        };
        chip.pins
            .follow(&chip.peripherals.ports, &chip.peripherals.tim1);
        chip
    }

    /// The chip is reset: flash and the board go on, RAM too unless power went, and some flags tell why.
    pub fn reset(&mut self, reset: Reset) {
        self.settle();
        let mut flash = self.peripherals.flash.clone();
        match reset {
            Reset::Power => {
                flash.cut(&mut self.memory);
                self.memory.lose_ram();
            }
            _ => flash.finish(&mut self.memory),
        }
        flash.reset();
        let rcc = Rcc::new(
            reset,
            (reset != Reset::Power).then_some(&self.peripherals.rcc),
        );
        self.peripherals = Peripherals::new(rcc, flash);
        self.clock.change(RESET_HZ);
        self.pins
            .follow(&self.peripherals.ports, &self.peripherals.tim1);
        (self.lines, self.next_event, self.reset) = (0, 0, None);
    }

    /// Two bits of the double word at this offset in the flash fall over: more than its error correction can mend.
    pub fn damage_flash(&mut self, offset: usize) {
        self.peripherals.flash.damage(offset, &mut self.memory);
    }

    /// Wears the flash out: its cells stay as they are from now on.
    pub fn wear_out_flash(&mut self) {
        self.peripherals.flash.wear_out();
    }

    /// Programs and erasures of the flash that have begun since power came first.
    pub fn flash_operations(&self) -> u64 {
        self.flash_operations_by_bank().iter().sum()
    }

    /// The same of each bank; programs run from the first.
    pub fn flash_operations_by_bank(&self) -> [u64; 2] {
        self.peripherals.flash.begun()
    }

    /// Lets the program's driver make a mistake from now on.
    pub fn make(&mut self, mistake: Mistake) {
        self.mistake = Some(mistake);
    }

    /// The interrupt lines that are high.
    pub fn lines(&self) -> u128 {
        self.lines
    }

    /// The cycle up to which nothing happens of itself.
    #[inline]
    pub fn next_event(&self) -> u64 {
        self.next_event
    }

    /// Whether the line of the non-maskable interrupt is high: until what raised it is acknowledged.
    pub fn nmi_line(&self) -> bool {
        self.peripherals.flash.raises_nmi()
    }

    /// What the bench did to the processor since this was asked last.
    pub(crate) fn take_disturbance(&mut self) -> Disturbance {
        std::mem::take(&mut self.disturbance)
    }

    /// Why the chip is to be reset, if it is.
    pub fn reset_due(&self) -> Option<Reset> {
        self.reset
    }

    /// Why the run ends, if it does.
    pub fn refused(&self) -> Option<&str> {
        self.refused.as_deref()
    }

    /// Whether the program has gone to the bootloader in the ROM.
    pub fn is_in_bootloader(&self) -> bool {
        self.in_bootloader
    }

    /// How often the watchdog was fed since the last reset.
    pub fn watchdog_feeds(&self) -> u64 {
        self.peripherals.iwdg.feeds
    }

    /// Pulls the comparators' line low, or lets it go: a glitch, or another board's comparator on a shared line.
    pub fn pull_comparators_line(&mut self, is_pulled: bool) {
        self.board.pull_comparators_line(is_pulled);
        self.settle();
    }

    /// Compare values that TIM1 works with, and whether its outputs are enabled.
    pub fn compares(&self) -> ([u16; 4], bool) {
        self.peripherals.tim1.compares()
    }

    /// Whether the output stages' load switch is on.
    pub fn is_load_switch_on(&self) -> bool {
        self.pins.driven.is_load_switch_on
    }

    /// Lets everything happen that is due by now.
    pub fn advance(&mut self) {
        let before = self.doing.begin(Activity::Events);
        let now = self.clock.cycles;
        loop {
            let (cycle, event) = self.earliest();
            if cycle > now {
                self.next_event = cycle;
                break;
            }
            self.happen(event, cycle);
        }
        self.peripherals.tim1.advance(now);
        self.peripherals.tim15.advance(now);
        self.lines = self.peripherals.lines();
        self.doing.resume(before);
    }

    fn earliest(&self) -> (u64, Event) {
        let p = &self.peripherals;
        let candidates = [
            (p.tim1.next_event(), Event::Tim1),
            (p.tim15.next_event(), Event::Tim15),
            (p.adcs[0].next_event(), Event::Adc(0)),
            (p.adcs[1].next_event(), Event::Adc(1)),
            (p.flash.next_event(), Event::Flash),
            (p.iwdg.next_event(&self.clock), Event::Watchdog),
            (self.usb_host.next_event(&p.usb, &self.clock), Event::Usb),
            (self.clock.cycle_at(self.board.next_step_s()), Event::Mirror),
        ];
        let first = (NEVER, Event::Mirror);
        candidates.into_iter().fold(first, |best, candidate| {
            if candidate.0 < best.0 {
                candidate
            } else {
                best
            }
        })
    }

    fn happen(&mut self, event: Event, at: u64) {
        if matches!(event, Event::Tim1 | Event::Mirror) {
            self.advance_board(at);
        }
        let p = &mut self.peripherals;
        match event {
            Event::Tim15 if at == p.tim15.overflow() => drop(p.tim15.overflows(at)),
            Event::Tim15 => p.tim15.advance(at),
            Event::Tim1 if at == p.tim1.overflow() => {
                let is_update = p.tim1.overflows(at);
                self.pins.follow(&p.ports, &p.tim1);
                if is_update {
                    self.update(at);
                }
            }
            Event::Tim1 => p.tim1.advance(at),
            Event::Adc(index) => {
                let before = self.doing.begin(Activity::Conversions);
                self.convert(index, at);
                self.doing.resume(before);
            }
            Event::Flash => p.flash.finish(&mut self.memory),
            Event::Watchdog => {
                self.reset = Some(Reset::Watchdog);
                // It bites once; the reset stops it.
                p.iwdg = Iwdg::new();
            }
            Event::Usb => {
                let before = self.doing.begin(Activity::Usb);
                let now_s = self.clock.seconds_at(at);
                self.usb_host.happen(&mut p.usb, now_s);
                self.doing.resume(before);
            }
            Event::Mirror => {
                let before = self.doing.begin(Activity::Mirror);
                self.disturbance = self.board.step();
                self.doing.resume(before);
            }
        }
    }

    /// An update of TIM1: conversions start by it, where TRGO2 says so.
    fn update(&mut self, at: u64) {
        let (compares, are_enabled) = self.peripherals.tim1.compares();
        self.trace.drives(at, compares, are_enabled);
        if self.peripherals.tim1.triggers_by_update() {
            self.peripherals
                .adcs
                .iter_mut()
                .for_each(|adc| adc.trigger_by_tim1(at));
        }
    }

    /// A conversion ends.
    fn convert(&mut self, index: usize, at: u64) {
        let adc = &mut self.peripherals.adcs[index];
        let Some((input, _)) = adc.sampled(&self.clock) else {
            return;
        };
        self.advance_board(at);
        match self.pins.analogue(&self.peripherals.ports, index, input) {
            Ok(connection) => {
                let code = self.board.convert(connection);
                let adc = &mut self.peripherals.adcs[index];
                let before = adc.interrupts();
                adc.converted(code);
                if !before && adc.interrupts() {
                    let [one, two] = &self.peripherals.adcs;
                    self.trace.converted(at, one.results(), two.results()[0]);
                }
            }
            Err(sentence) => {
                self.refuse(sentence);
                // The run ends here.
                self.peripherals.adcs[index].converted(0);
            }
        }
    }

    fn refuse(&mut self, sentence: String) {
        self.refused.get_or_insert(sentence);
    }

    /// The board comes to where the processor is, with the outputs as they were so far.
    fn settle(&mut self) {
        self.advance_board(self.clock.cycles);
    }

    /// The board comes to this cycle, and what its comparators say then reaches the break input.
    fn advance_board(&mut self, to: u64) {
        let before = self.doing.begin(Activity::Filters);
        self.board.advance(to, &self.clock, &self.pins.driven);
        self.doing.resume(before);
        let level = !(self.pins.breaks && self.board.is_over_voltage());
        let p = &mut self.peripherals;
        if p.tim1.set_break_input(level) {
            self.pins.follow(&p.ports, &p.tim1);
        }
    }
}
