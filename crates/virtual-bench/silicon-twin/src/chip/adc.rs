//! Converters ADC1 and ADC2: start-up, calibration, injected sequences that a timer starts, oversampling (RM0440,
//! chapter 21). Regular sequences are not modelled.

use super::rcc::Rcc;
use super::refused::{Access, Refused, misuse, only};
use super::time::{Clock, NEVER};

mod offset {
    pub(super) const ISR: u32 = 0x00;
    pub(super) const IER: u32 = 0x04;
    pub(super) const CR: u32 = 0x08;
    pub(super) const CFGR: u32 = 0x0c;
    pub(super) const CFGR2: u32 = 0x10;
    pub(super) const SMPR1: u32 = 0x14;
    pub(super) const SMPR2: u32 = 0x18;
    pub(super) const SQR1: u32 = 0x30;
    pub(super) const JSQR: u32 = 0x4c;
    pub(super) const JDR1: u32 = 0x80;
    pub(super) const JDR4: u32 = 0x8c;
    pub(super) const DIFSEL: u32 = 0xb0;
    pub(super) const CALFACT: u32 = 0xb4;
}

/// ISR: ready, end of an injected conversion, and of the sequence.
const ADRDY: u32 = 1;
const JEOC: u32 = 1 << 5;
const JEOS: u32 = 1 << 6;
/// CR.
const ADEN: u32 = 1;
const ADDIS: u32 = 1 << 1;
const JADSTART: u32 = 1 << 3;
const JADSTP: u32 = 1 << 5;
const ADVREGEN: u32 = 1 << 28;
const DEEPPWD: u32 = 1 << 29;
const ADCALDIF: u32 = 1 << 30;
const ADCAL: u32 = 1 << 31;
/// CFGR as after reset: the queue of injected contexts is off.
const JQDIS: u32 = 1 << 31;
const OVRMOD: u32 = 1 << 12;
/// CFGR2: oversampling of injected conversions, its ratio, its shift; and of regular ones, which are not modelled.
const JOVSE: u32 = 1 << 1;
const OVSR: u32 = 0b111 << 2;
const OVSS: u32 = 0xf << 5;

/// Start-up of the regulator (DS12288, table 66: at most 20 us).
const REGULATOR_S: f64 = 20e-6;
/// A calibration takes 116 clocks of the ADC (DS12288, table 66), and is followed by 4 in which it must not be enabled
/// (section 21.4.9).
const CALIBRATION_CLOCKS: f64 = 116.0;
const AFTER_CALIBRATION_CLOCKS: f64 = 4.0;
/// From enabling to ready: one conversion at most (DS12288, table 66).
const READY_S: f64 = 1e-6;
/// Conversion after sampling: 12.5 clocks at 12 bits (section 21.4.16).
const CONVERSION_CLOCKS: f64 = 12.5;
/// From the trigger to the beginning of sampling (DS12288, table 66: 2.5 to 4.5 clocks for injected channels).
const LATENCY_CLOCKS: f64 = 3.0;
/// Highest clock of the ADCs where several convert, VDDA at least 2.7 V (DS12288, table 66).
const HIGHEST_HZ: f64 = 52e6;
/// Sampling times in clocks (section 21.7.6).
const SAMPLING_CLOCKS: [f64; 8] = [2.5, 6.5, 12.5, 24.5, 47.5, 92.5, 247.5, 640.5];
/// JEXTSEL: TIM1's TRGO2 (section 21.4.18, table 164, ADC1 and ADC2).
const TIM1_TRGO2: u32 = 8;
/// Prescalers of the asynchronous clock (section 21.8.2).
const PRESCALERS: [f64; 12] = [1., 2., 4., 6., 8., 10., 12., 16., 32., 64., 128., 256.];

/// A sequence that converts.
#[derive(Clone, Copy, Debug)]
struct Running {
    rank: u32,
    /// Conversions of this rank that are done, and their sum.
    done: u32,
    sum: u32,
    /// When the present one ends sampling, in cycles of HCLK with a fraction.
    sampled: f64,
}

/// One converter.
#[derive(Clone, Debug)]
pub(crate) struct Adc {
    name: &'static str,
    isr: u32,
    ier: u32,
    cr: u32,
    cfgr: u32,
    cfgr2: u32,
    smpr: [u32; 2],
    sqr: [u32; 4],
    jsqr: u32,
    jdr: [u32; 4],
    difsel: u32,
    regulated_s: f64,
    is_calibrated: bool,
    /// When the last calibration ended, or will.
    calibrated_s: f64,
    ready_s: f64,
    running: Option<Running>,
    /// What converts with which clock, in cycles of HCLK.
    clock_cycles: f64,
}

/// The registers that both share.
#[derive(Clone, Debug, Default)]
pub(crate) struct Common {
    ccr: u32,
}

impl Common {
    pub(crate) fn read(&self, at: u32) -> Access<u32> {
        match at {
            0x08 => Ok(self.ccr),
            _ => Err(Refused::NotModelled),
        }
    }

    pub(crate) fn write(&mut self, at: u32, value: u32) -> Access {
        match at {
            0x08 => self.ccr = only(value, 0x3f << 16)?,
            _ => return Err(Refused::NotModelled),
        }
        Ok(())
    }

    /// The ADCs' clock (section 21.4.3).
    pub(crate) fn hz(&self, rcc: &Rcc) -> Access<f64> {
        let hz = match self.ccr >> 16 & 0b11 {
            0b00 => {
                let index = (self.ccr >> 18 & 0xf) as usize;
                let Some(prescaler) = PRESCALERS.get(index) else {
                    return misuse("the ADCs' prescaler is reserved (RM0440, section 21.8.2)");
                };
                rcc.adc12_hz()? / prescaler
            }
            0b01 => rcc.core_hz()?,
            0b10 => rcc.core_hz()? / 2.0,
            _ => rcc.core_hz()? / 4.0,
        };
        match hz <= HIGHEST_HZ {
            true => Ok(hz),
            false => misuse(format!(
                "the ADCs have a clock of {:.1} MHz, and may have 52 (data sheet, ADC characteristics)",
                hz / 1e6
            )),
        }
    }
}

impl Adc {
    pub(crate) fn new(name: &'static str) -> Self {
        Self {
            name,
            isr: 0,
            ier: 0,
            cr: DEEPPWD,
            cfgr: JQDIS,
            cfgr2: 0,
            smpr: [0; 2],
            sqr: [0; 4],
            jsqr: 0,
            jdr: [0; 4],
            difsel: 0,
            regulated_s: f64::INFINITY,
            is_calibrated: false,
            calibrated_s: 0.0,
            ready_s: f64::INFINITY,
            running: None,
            clock_cycles: 0.0,
        }
    }

    /// Whether an enabled flag asks for an interrupt.
    pub(crate) fn interrupts(&self) -> bool {
        self.isr & self.ier != 0
    }

    pub(crate) fn read(&self, at: u32, clock: &Clock) -> Access<u32> {
        Ok(match at {
            offset::ISR => {
                let is_ready = clock.seconds() >= self.ready_s;
                self.isr | if is_ready { ADRDY } else { 0 }
            }
            offset::IER => self.ier,
            offset::CR => {
                let calibrates = clock.seconds() < self.calibrated_s;
                self.cr | if calibrates { ADCAL } else { 0 }
            }
            offset::CFGR => self.cfgr,
            offset::CFGR2 => self.cfgr2,
            offset::SMPR1 => self.smpr[0],
            offset::SMPR2 => self.smpr[1],
            offset::SQR1..=0x3c => self.sqr[(at - offset::SQR1) as usize / 4],
            offset::JSQR => self.jsqr,
            offset::JDR1..=offset::JDR4 => self.jdr[(at - offset::JDR1) as usize / 4],
            offset::DIFSEL => self.difsel,
            // Somewhere in the middle; each chip has its own.
            offset::CALFACT => 0x40,
            _ => return Err(Refused::NotModelled),
        })
    }

    /// Writes a register; `hz` is the ADCs' clock, or why it is none.
    pub(crate) fn write(&mut self, at: u32, value: u32, clock: &Clock, hz: Access<f64>) -> Access {
        let starts = self.cr & JADSTART != 0;
        let is_setup = matches!(at, offset::CFGR..=offset::JSQR | offset::DIFSEL);
        if is_setup && starts {
            return misuse(format!(
                "{} is set up while conversions are started (RM0440, section 21.4.10)",
                self.name
            ));
        }
        match at {
            // Writing a flag clears it; reading JDR does as well, which an interrupt does not see.
            offset::ISR => {
                self.isr &= !value;
                if value & ADRDY != 0 && clock.seconds() >= self.ready_s {
                    self.ready_s = f64::INFINITY;
                }
            }
            offset::IER => self.ier = only(value, ADRDY | JEOC | JEOS)?,
            offset::CR => self.control(value, clock, hz)?,
            offset::CFGR => self.cfgr = only(value, JQDIS | OVRMOD)?,
            offset::CFGR2 => self.cfgr2 = only(value, JOVSE | OVSR | OVSS)?,
            offset::SMPR1 => self.smpr[0] = only(value, 0x3fff_ffff)?,
            offset::SMPR2 => self.smpr[1] = only(value, 0x07ff_ffff)?,
            offset::SQR1..=0x3c => self.sqr[(at - offset::SQR1) as usize / 4] = value,
            offset::JSQR => self.jsqr = value,
            offset::DIFSEL => self.difsel = only(value, 0)?,
            _ => return Err(Refused::NotModelled),
        }
        Ok(())
    }

    fn control(&mut self, value: u32, clock: &Clock, hz: Access<f64>) -> Access {
        let now_s = clock.seconds();
        only(
            value,
            ADEN | ADDIS | JADSTART | JADSTP | ADVREGEN | DEEPPWD | ADCALDIF | ADCAL,
        )?;
        let name = self.name;
        if value & ADVREGEN != 0 && value & DEEPPWD != 0 {
            return misuse(format!(
                "{name} gets its regulator while it is in deep power-down (RM0440, section 21.4.6)"
            ));
        }
        let gets_regulator = value & ADVREGEN != 0 && self.cr & ADVREGEN == 0;
        if gets_regulator {
            self.regulated_s = now_s + REGULATOR_S;
        }
        if value & ADVREGEN == 0 {
            self.regulated_s = f64::INFINITY;
            self.is_calibrated = false;
        }
        let is_regulated = now_s >= self.regulated_s;
        let set = value & !self.cr;
        if set & ADCAL != 0 {
            self.begin_calibration(is_regulated, now_s, hz.clone()?)?;
            // That of differential inputs takes as long, and counts for those only.
            self.is_calibrated |= value & ADCALDIF == 0;
        }
        if set & ADEN != 0 {
            let hz = hz?;
            let rested_s = self.calibrated_s + AFTER_CALIBRATION_CLOCKS / hz;
            if !is_regulated || !self.is_calibrated || now_s < rested_s {
                return misuse(format!(
                    "{name} is enabled before its regulator is up, or within 4 clocks after its calibration, or without \
                     one (RM0440, sections 21.4.6 to 21.4.9)"
                ));
            }
            self.ready_s = now_s + READY_S;
            self.clock_cycles = clock.hz() / hz;
        }
        if set & JADSTART != 0
            && (self.cr & ADEN == 0 || (now_s < self.ready_s && self.ready_s.is_finite()))
        {
            return misuse(format!(
                "{name} is started before it is ready (RM0440, section 21.4.9)"
            ));
        }
        let kept = ADVREGEN | DEEPPWD | ADCALDIF;
        self.cr = self.cr & (ADEN | JADSTART) | value & (kept | ADEN | JADSTART);
        if value & JADSTP != 0 {
            self.cr &= !JADSTART;
            self.running = None;
        }
        if value & ADDIS != 0 {
            self.cr &= !ADEN;
            self.ready_s = f64::INFINITY;
        }
        Ok(())
    }

    fn begin_calibration(&mut self, is_regulated: bool, now_s: f64, hz: f64) -> Access {
        if !is_regulated || self.cr & ADEN != 0 {
            return misuse(format!(
                "{} is calibrated while it is enabled, or before its regulator is up (RM0440, section 21.4.8)",
                self.name
            ));
        }
        self.calibrated_s = now_s + CALIBRATION_CLOCKS / hz;
        Ok(())
    }

    /// TIM1's second trigger output rises: begins the sequence, where this converter waits for that and is idle.
    pub(crate) fn trigger_by_tim1(&mut self, now: u64) {
        let waits = self.cr & (ADEN | JADSTART) == ADEN | JADSTART;
        let is_edge = matches!(self.jsqr >> 7 & 0b11, 0b01 | 0b11);
        let is_source = self.jsqr >> 2 & 0x1f == TIM1_TRGO2;
        if waits && is_edge && is_source && self.running.is_none() {
            let start = now as f64 + LATENCY_CLOCKS * self.clock_cycles;
            self.running = Some(Running {
                rank: 0,
                done: 0,
                sum: 0,
                sampled: start + self.sampling_cycles(0),
            });
        }
    }

    /// The input of a rank.
    fn input(&self, rank: u32) -> u32 {
        self.jsqr >> (9 + 6 * rank) & 0x1f
    }

    fn sampling_cycles(&self, rank: u32) -> f64 {
        let input = self.input(rank);
        let field = match input < 10 {
            true => self.smpr[0] >> (3 * input),
            false => self.smpr[1] >> (3 * (input - 10)),
        };
        SAMPLING_CLOCKS[(field & 7) as usize] * self.clock_cycles
    }

    fn conversions(&self) -> u32 {
        match self.cfgr2 & JOVSE {
            0 => 1,
            _ => 2 << (self.cfgr2 >> 2 & 7),
        }
    }

    /// The cycle in which the present conversion ends: its input was sampled before.
    pub(crate) fn next_event(&self) -> u64 {
        let end = |running: &Running| running.sampled + CONVERSION_CLOCKS * self.clock_cycles;
        self.running
            .as_ref()
            .map_or(NEVER, |running| end(running).ceil() as u64)
    }

    /// The input that the present conversion has sampled, and how long it did so (s).
    pub(crate) fn sampled(&self, clock: &Clock) -> Option<(u32, f64)> {
        let running = self.running.as_ref()?;
        let sampling_s = self.sampling_cycles(running.rank) / clock.hz();
        Some((self.input(running.rank), sampling_s))
    }

    /// The present conversion ends with this code of 12 bits.
    pub(crate) fn converted(&mut self, code: u16) {
        let Some(mut running) = self.running.take() else {
            return;
        };
        running.sum += u32::from(code);
        running.done += 1;
        running.sampled += CONVERSION_CLOCKS * self.clock_cycles;
        if running.done == self.conversions() {
            let shift = match self.cfgr2 & JOVSE {
                0 => 0,
                _ => self.cfgr2 >> 5 & 0xf,
            };
            self.jdr[running.rank as usize] = running.sum >> shift & 0xffff;
            self.isr |= JEOC;
            if running.rank == self.jsqr & 0b11 {
                self.isr |= JEOS;
                return;
            }
            running = Running {
                rank: running.rank + 1,
                done: 0,
                sum: 0,
                ..running
            };
        }
        running.sampled += self.sampling_cycles(running.rank);
        self.running = Some(running);
    }

    /// What the last sequence read.
    pub(crate) fn results(&self) -> [u16; 4] {
        self.jdr.map(|word| word as u16)
    }
}
