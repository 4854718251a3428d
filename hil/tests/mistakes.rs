//! What the silicon twin catches: mistakes that a driver could make, one at a time in what the flashed image writes into a
//! register, and what of the board's behaviour shows it.

use std::fs;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use emulated_board::{Connected, PlantFault};
use hil::flashed_image;
use mirror_protocol::{
    ChannelState, ClearEndpoint, Drives, LEASE_FOREVER_MS, SetDriveEndpoint, StatusEndpoint,
};
use protection::Fault;
use silicon_twin::board::Board;
use silicon_twin::chip::{Mistake, Reset};
use silicon_twin::tool::{AskError, Tool};
use silicon_twin::{Failure, Image, Twin};
use virtual_mirror::MirrorConfig;

// Base addresses (RM0440, section 2.2.2).
const IWDG: u32 = 0x4000_3000;
const CRS: u32 = 0x4000_2000;
const USB: u32 = 0x4000_5c00;
const PWR: u32 = 0x4000_7000;
const TIM1: u32 = 0x4001_2c00;
const TIM15: u32 = 0x4001_4000;
const RCC: u32 = 0x4002_1000;
const FLASH: u32 = 0x4002_2000;
const GPIOA: u32 = 0x4800_0000;
const GPIOB: u32 = 0x4800_0400;
const GPIOC: u32 = 0x4800_0800;
const ADC1: u32 = 0x5000_0000;
const ADC2: u32 = 0x5000_0100;
const ADC12: u32 = 0x5000_0300;
// The processor's own (ARMv7-M manual, table B3-8): enables, 32 interrupts a word, and priorities, a byte each.
const NVIC_ENABLE: u32 = 0xe000_e100;
const NVIC_PRIORITY: u32 = 0xe000_e400;
/// Interrupts (RM0440, table 97): the conversions' end, USB's, the time driver's, and that of the control loop, which no
/// peripheral of this board uses.
const ADC1_2: u32 = 18;
const USB_LP: u32 = 20;
const TIM1_BRK_TIM15: u32 = 24;
const UART5: u32 = 53;

/// Where the fault log begins in the flash (docs, storage).
const LOG: usize = 464 * 1024;

/// A write that never takes place.
const NEVER: u32 = 0;

/// What is wrong; the register, its bits, and what they are written as: nothing at all where there are none.
type Row = (&'static str, u32, u32, u32);

const MISTAKES: &[Row] = &[
    (
        "core: boost mode is not switched on",
        PWR + 0x80,
        1 << 8,
        1 << 8,
    ),
    ("core: PLL times 86", RCC + 0x0c, 0x7f << 8, 86 << 8),
    (
        "core: PLL times 80, so 160 MHz",
        RCC + 0x0c,
        0x7f << 8,
        80 << 8,
    ),
    ("core: PLL input divided by 3", RCC + 0x0c, 0xf << 4, 2 << 4),
    ("core: the PLL's output is off", RCC + 0x0c, 1 << 24, 0),
    (
        "core: APB2 divided by 4",
        RCC + 0x08,
        0b111 << 11,
        0b101 << 11,
    ),
    ("core: AHB divided by 2", RCC + 0x08, 0xf << 4, 0b1000 << 4),
    ("flash: three wait states", FLASH, 0xf, 3),
    ("clocks: HSI48 stays off", RCC + 0x98, 1, 0),
    (
        "clocks: USB from PLL Q, which is off",
        RCC + 0x88,
        0b11 << 26,
        0b10 << 26,
    ),
    ("clocks: none for the ADCs", RCC + 0x88, 0b11 << 28, 0),
    ("clocks: ADC12 is not enabled", RCC + 0x4c, 1 << 13, 0),
    ("clocks: GPIOC is not enabled", RCC + 0x4c, 1 << 2, 0),
    ("clocks: TIM1 is not enabled", RCC + 0x60, 1 << 11, 0),
    ("clocks: USB is not enabled", RCC + 0x58, 1 << 23, 0),
    ("clocks: CRS is not enabled", RCC + 0x58, 1 << 8, 0),
    ("clocks: CRS does not trim", CRS, 1 << 6, 0),
    (
        "clocks: CRS follows the wrong signal",
        CRS + 0x04,
        0b11 << 28,
        0,
    ),
    (
        "pins: drive 1 on alternate function 1",
        GPIOC + 0x20,
        0xf,
        1,
    ),
    ("pins: drive 2 stays an input", GPIOC, 0b11 << 2, 0),
    (
        "pins: drive 3 is an open drain",
        GPIOC + 0x04,
        1 << 2,
        1 << 2,
    ),
    (
        "pins: drive 4 is a plain output",
        GPIOC,
        0b11 << 6,
        0b01 << 6,
    ),
    ("pins: current sense 1 is an input", GPIOA, 0b11, 0),
    ("pins: current sense 4 is an input", GPIOB, 0b11 << 2, 0),
    ("pins: the supply's sense is an input", GPIOC, 0b11 << 10, 0),
    (
        "pins: the position sensor's is an input",
        GPIOB,
        0b11 << 4,
        0,
    ),
    (
        "pins: the comparators' line stays an input",
        GPIOB,
        0b11 << 24,
        0,
    ),
    (
        "pins: the comparators' line on alternate function 5",
        GPIOB + 0x24,
        0xf << 16,
        5 << 16,
    ),
    (
        "pins: the load switch's enable stays an input",
        GPIOC,
        0b11 << 24,
        0,
    ),
    (
        "pins: the load switch's enable is an open drain",
        GPIOC + 0x04,
        1 << 12,
        1 << 12,
    ),
    (
        "pins: the load switch is never switched on",
        GPIOC + 0x18,
        1 << 12,
        0,
    ),
    (
        "pins: the load switch is never switched off",
        GPIOC + 0x18,
        1 << 28,
        0,
    ),
    ("TIM1: a period of 4251", TIM1 + 0x2c, 0xffff, 4250),
    ("TIM1: an update every third period", TIM1 + 0x30, 0xffff, 2),
    ("TIM1: an update every period", TIM1 + 0x30, 0xffff, 0),
    ("TIM1: channel 1 without preload", TIM1 + 0x18, 1 << 3, 0),
    ("TIM1: channel 4 without preload", TIM1 + 0x1c, 1 << 11, 0),
    (
        "TIM1: channel 1 in PWM mode 2",
        TIM1 + 0x18,
        0b111 << 4,
        0b111 << 4,
    ),
    ("TIM1: channel 3 frozen", TIM1 + 0x1c, 0b111 << 4, 0),
    ("TIM1: channel 2 is not enabled", TIM1 + 0x20, 1 << 4, 0),
    ("TIM1: channel 3 is inverted", TIM1 + 0x20, 1 << 9, 1 << 9),
    ("TIM1: outputs are never enabled", TIM1 + 0x44, 1 << 15, 0),
    (
        "TIM1: outputs are enabled from the start",
        TIM1 + 0x44,
        1 << 15,
        1 << 15,
    ),
    ("TIM1: disabled outputs float", TIM1 + 0x44, 1 << 10, 0),
    (
        "TIM1: its break input is not enabled",
        TIM1 + 0x44,
        1 << 12,
        0,
    ),
    (
        "TIM1: its break input is active high",
        TIM1 + 0x44,
        1 << 13,
        1 << 13,
    ),
    (
        "TIM1: outputs come back by themselves after a break",
        TIM1 + 0x44,
        1 << 14,
        1 << 14,
    ),
    (
        "TIM1: a break's flag is never cleared",
        TIM1 + 0x10,
        1 << 7,
        1 << 7,
    ),
    ("TIM1: channel 1 idles high", TIM1 + 0x04, 1 << 8, 1 << 8),
    ("TIM1: TRGO2 is not the update", TIM1 + 0x04, 0xf << 20, 0),
    ("TIM1: it is not started", TIM1, 1, 0),
    ("TIM1: its limit without preload", TIM1, 1 << 7, 0),
    ("TIM1: compare 2 is never written", TIM1 + 0x38, NEVER, 0),
    (
        "TIM1: the update's flag is never cleared",
        TIM1 + 0x10,
        NEVER,
        0,
    ),
    ("TIM15: time at half speed", TIM15 + 0x28, 0xffff, 339),
    ("TIM15: it is not started", TIM15, 1, 0),
    (
        "ADC1: started by another trigger",
        ADC1 + 0x4c,
        0x1f << 2,
        0,
    ),
    ("ADC1: started by no trigger", ADC1 + 0x4c, 0b11 << 7, 0),
    ("ADC2: started by no trigger", ADC2 + 0x4c, 0b11 << 7, 0),
    ("ADC1: three conversions of four", ADC1 + 0x4c, 0b11, 2),
    (
        "ADC1: the first two inputs exchanged",
        ADC1 + 0x4c,
        0x7df << 9,
        (2 | 1 << 6) << 9,
    ),
    (
        "ADC1: an input that is not connected",
        ADC1 + 0x4c,
        0x1f << 9,
        9 << 9,
    ),
    (
        "ADC1: sampling for 640.5 clocks",
        ADC1 + 0x14,
        0b111 << 3,
        0b111 << 3,
    ),
    ("ADC1: sampling for 2.5 clocks", ADC1 + 0x14, 0b111 << 3, 0),
    ("ADC1: no oversampling", ADC1 + 0x10, 1 << 1, 0),
    (
        "ADC1: eightfold oversampling",
        ADC1 + 0x10,
        0b111 << 2,
        0b010 << 2,
    ),
    ("ADC2: results shifted", ADC2 + 0x10, 0xf << 5, 4 << 5),
    (
        "ADC1: its sequence's end does not interrupt",
        ADC1 + 0x04,
        1 << 6,
        0,
    ),
    (
        "ADC1: each conversion's end interrupts",
        ADC1 + 0x04,
        1 << 5,
        1 << 5,
    ),
    ("ADC1: the end's flag is never cleared", ADC1, NEVER, 0),
    ("ADC1: not calibrated", ADC1 + 0x08, 1 << 31, 0),
    ("ADC2: without its regulator", ADC2 + 0x08, 1 << 28, 0),
    (
        "ADC12: its clock is not divided",
        ADC12 + 0x08,
        0xf << 18,
        0,
    ),
    ("IWDG: it is never started", IWDG, 0xffff, 0x5555),
    ("IWDG: it is never fed", IWDG, 0x2222, 0),
    ("IWDG: eight times too slow", IWDG + 0x04, 0b111, 0b110),
    (
        "NVIC: the control loop below USB and time",
        NVIC_PRIORITY + UART5,
        0xf0,
        0xf0,
    ),
    ("NVIC: USB above all", NVIC_PRIORITY + USB_LP, 0xf0, 0),
    (
        "NVIC: the time driver above all",
        NVIC_PRIORITY + TIM1_BRK_TIM15,
        0xf0,
        0,
    ),
    (
        "NVIC: the conversions' end is not enabled",
        NVIC_ENABLE,
        1 << ADC1_2,
        0,
    ),
    (
        "NVIC: the control loop is not enabled",
        NVIC_ENABLE + 4,
        1 << (UART5 - 32),
        0,
    ),
    ("NVIC: USB is not enabled", NVIC_ENABLE, 1 << USB_LP, 0),
    ("flash: its key is not given", FLASH + 0x08, NEVER, 0),
    ("flash: programming is not enabled", FLASH + 0x14, 1, 0),
    (
        "flash: the page is erased in the program's own bank",
        FLASH + 0x14,
        1 << 11,
        0,
    ),
    ("flash: the data cache is not reset", FLASH, 1 << 12, 0),
    ("USB: the pull-up stays off", USB + 0x58, 1 << 15, 0),
    ("USB: transfers do not interrupt", USB + 0x40, 1 << 15, 0),
    ("USB: a reset does not interrupt", USB + 0x40, 1 << 10, 0),
    ("USB: the function is not enabled", USB + 0x4c, 1 << 7, 0),
    ("USB: an address that is one too high", USB + 0x4c, 1, 0),
    ("USB: endpoint 0 is a bulk endpoint", USB, 0b11 << 9, 0),
    (
        "USB: the buffer table is elsewhere",
        USB + 0x50,
        0x3f8,
        0x40,
    ),
    ("USB: events are never cleared", USB + 0x44, NEVER, 0),
];

/// What is not caught by a start, and why that is so.
const NOT_CAUGHT: &[(&str, &str)] = &[
    (
        "USB: a reset does not interrupt",
        "the driver looks for a reset at every interrupt, and another one comes too; without the fault log's first \
         erasure, which makes the start longer, the device does not answer",
    ),
    (
        "TIM1: disabled outputs float",
        "the board's pull-downs hold them low as well",
    ),
    (
        "TIM1: its limit without preload",
        "the firmware writes it once, while the timer stands",
    ),
    (
        "flash: the data cache is not reset",
        "the twin's caches take time and hold no bytes of their own",
    ),
];

const ALL_AT_ONE_VOLT: Drives = Drives {
    drive_v: [1.0; 4],
    lease_ms: LEASE_FOREVER_MS,
};

/// How long a start is looked at: until the host knows the device.
const START_S: f64 = 0.25;

/// What is seen of a start.
#[derive(Debug)]
struct Seen {
    ticks: u64,
    compares: [u16; 4],
    driven_early: bool,
    changed_early: bool,
    highest: [u16; 4],
    highest_v: f64,
}

/// Looks at a start; what shows that something is wrong.
fn examine(twin: &mut Twin) -> Result<(), String> {
    let mut seen = Seen {
        ticks: 0,
        compares: [0; 4],
        driven_early: false,
        changed_early: false,
        highest: [0; 4],
        highest_v: 0.0,
    };
    let mut last = twin.chip.trace.last();
    let mut was_enabled = false;
    let mut wrong = None;
    let ran = twin.run_until(|twin| {
        let tick = twin.chip.trace.last();
        let us_of = |cycles: u64| cycles as f64 / twin.chip.clock.hz() * 1e6;
        let (compares, are_enabled) = twin.chip.compares();
        let drive_v = twin.chip.board.drive_v().into_iter().fold(0.0, f64::max);
        seen.highest_v = seen.highest_v.max(drive_v);
        let begins = twin.chip.trace.ticks() > seen.ticks;
        if begins {
            seen.ticks = twin.chip.trace.ticks();
            let us = us_of(tick.cycle - last.cycle);
            if last.are_enabled && us != 100.0 {
                wrong.get_or_insert(format!("a tick of {us:.2} us"));
            }
            was_enabled |= tick.are_enabled;
            last = tick;
        } else if compares != seen.compares {
            seen.changed_early = true;
        }
        seen.compares = compares;
        if tick.converted > tick.cycle {
            let us = us_of(tick.converted - tick.cycle);
            if !(37.6..37.8).contains(&us) {
                wrong.get_or_insert(format!("conversions of {us:.1} us"));
            }
        }
        for (highest, code) in seen.highest.iter_mut().zip(tick.currents) {
            *highest = (*highest).max(code);
        }
        seen.driven_early |= !was_enabled && !are_enabled && drive_v > 5e-3;
        wrong.is_some() || twin.resets().len() > 1 || twin.seconds() >= START_S
    });
    ran.map_err(|failure| failure.what)?;
    wrong.map_or(Ok(()), Err)?;
    judge(twin, &seen)
}

fn judge(twin: &mut Twin, seen: &Seen) -> Result<(), String> {
    let last = twin.chip.trace.last();
    let fail = |sentence: String| Err(sentence);
    if twin.resets().len() > 1 {
        return fail("the watchdog resets it".to_owned());
    }
    // The start takes some 20 ms.
    if seen.ticks < 2000 {
        return fail(format!("{} ticks in {START_S} s", seen.ticks));
    }
    if seen.driven_early {
        return fail("channels are driven before their outputs are enabled".to_owned());
    }
    if seen.changed_early {
        return fail("compare values change within a tick".to_owned());
    }
    // The pedestal of docs/board.md; five standard deviations of the amplifier's offset.
    if last.currents.iter().any(|code| code.abs_diff(649) > 105) {
        return fail(format!("currents at rest read {:?}", last.currents));
    }
    if last.supply.abs_diff(49_648) > 40 {
        return fail(format!("the supply reads {}", last.supply));
    }
    // The heaters are checked at 0.3 V: 310 to 450 ohm, 0.19 uA a step, and the pedestal.
    if !seen.highest.iter().all(|code| (4000..6000).contains(code)) {
        return fail(format!(
            "currents of the heaters' check read {:?}",
            seen.highest
        ));
    }
    if seen.highest_v > 0.31 {
        return fail(format!("{:.2} V in the heaters' check", seen.highest_v));
    }
    if let Some(failure) = twin.chip.usb_host.failure() {
        return fail(format!("USB: {failure}"));
    }
    if twin.chip.usb_host.device().is_none() {
        return fail("USB: the host sees no device".to_owned());
    }
    if let Some(number) = twin.timing.latest().interrupted_by {
        return fail(format!("the control loop is interrupted by {number}"));
    }
    let [own, other] = twin.chip.flash_operations_by_bank();
    if own > 0 {
        return fail("the bank that the program runs from is written".to_owned());
    }
    // An entry of the fault log has some double words, behind a page that is erased.
    let log = &twin.chip.memory.flash_bytes()[LOG..LOG + 8];
    if other < 2 || log.iter().all(|byte| *byte == 0xff) {
        return fail(format!(
            "the start is not logged: {other} operations of the flash"
        ));
    }
    // A round of 20 ms since the start.
    if !(9..=13).contains(&twin.chip.watchdog_feeds()) {
        return fail(format!(
            "the watchdog was fed {} times",
            twin.chip.watchdog_feeds()
        ));
    }
    if twin.chip.compares().1 || twin.chip.is_load_switch_on() {
        return fail("outputs or their stages' supply are on while heaters cool".to_owned());
    }
    examine_driven(twin)?;
    examine_break(twin)?;
    examine_watchdog(twin)
}

/// Whether a stage that stays at its supply is turned off by the comparators, and drives again once it is mended.
fn examine_break(twin: &mut Twin) -> Result<(), String> {
    let mut tool = Tool::new(twin.clone());
    let failed = |error: AskError| error.to_string();
    let ran = |failure: Failure| failure.what;
    tool.connect().map_err(failed)?;
    tool.twin.chip.board.move_to_own_bench();
    for is_mended in [false, true] {
        let driven = tool.ask::<SetDriveEndpoint>(&ALL_AT_ONE_VOLT);
        driven
            .map_err(failed)?
            .map_err(|refusal| format!("a drive is refused: {refusal:?}"))?;
        if is_mended {
            return Ok(());
        }
        let controls = tool.twin.chip.board.controls().clone();
        controls.inject(Some(PlantFault::StuckStage(2, 5000)));
        // A tick and the conversions of the next, the discharge of the stages' supply.
        tool.twin.run_for(2e-3).map_err(ran)?;
        // Two ticks, each of which turns the outputs off again.
        let end_s = tool.twin.seconds() + 2e-4;
        let mut are_enabled = false;
        let mut look = |twin: &Twin| {
            are_enabled |= twin.chip.compares().1;
            twin.seconds() >= end_s
        };
        tool.twin.run_until(|twin| look(twin)).map_err(ran)?;
        let heated_v = tool.twin.chip.board.heated_v()[2];
        if heated_v > 0.1 || are_enabled {
            return Err(format!("a stuck stage stays at {heated_v:.1} V"));
        }
        let status = tool.ask::<StatusEndpoint>(&()).map_err(failed)?;
        let state = status
            .map_err(|refusal| format!("{refusal:?}"))?
            .telemetry
            .states[2];
        let over_voltage = ChannelState::Tripped(Fault::OutputOverVoltage.code());
        if state != over_voltage {
            return Err(format!("a stuck stage is told as {state:?}"));
        }
        controls.inject(None);
        let cleared = tool.ask::<ClearEndpoint>(&()).map_err(failed)?;
        cleared.map_err(|refusal| format!("{refusal:?}"))?;
    }
    Ok(())
}

/// Whether a channel that is driven by itself is the one whose current is sensed, in time.
fn examine_driven(twin: &mut Twin) -> Result<(), String> {
    let mut tool = Tool::new(twin.clone());
    let failed = |error: AskError| error.to_string();
    tool.connect().map_err(failed)?;
    for channel in 0..4 {
        let mut drive_v = [0.0; 4];
        drive_v[channel] = 1.0;
        let drives = Drives {
            drive_v,
            lease_ms: LEASE_FOREVER_MS,
        };
        let driven = tool.ask::<SetDriveEndpoint>(&drives).map_err(failed)?;
        driven.map_err(|refusal| format!("a drive is refused: {refusal:?}"))?;
        tool.twin.run_for(0.01).map_err(|failure| failure.what)?;
        let currents = tool.twin.chip.trace.last().currents;
        // 2.2 mA at least are 12 000 steps, and the pedestal less than 800.
        let is_right = |(i, code): (usize, &u16)| (*code > 5000) == (i == channel);
        if !currents.iter().enumerate().all(is_right) {
            return Err(format!(
                "channel {channel} is driven, and currents read {currents:?}"
            ));
        }
    }
    let status = tool.ask::<StatusEndpoint>(&()).map_err(failed)?;
    let health = status.map_err(|refusal| format!("{refusal:?}"))?.health;
    match (health.missed_ticks, health.late_ticks) {
        (0, 0) => Ok(()),
        (missed, late) => Err(format!("{missed} ticks missed, {late} late")),
    }
}

/// Whether a program that hangs is reset in half a second.
fn examine_watchdog(twin: &mut Twin) -> Result<(), String> {
    twin.hang();
    twin.run_for(0.52).map_err(|failure| failure.what)?;
    match twin.resets().contains(&Reset::Watchdog) {
        true => Ok(()),
        false => Err("no watchdog resets a program that hangs".to_owned()),
    }
}

/// A board with the bench mirror, when power comes, whose driver makes a mistake.
fn twin(elf: &[u8], mistake: Option<Mistake>) -> Twin {
    let image = Image::from_elf(elf).expect("an image for this chip");
    let mirror = Connected::Mirror(Box::new(MirrorConfig::bench()));
    let board = Board::new(&mirror).expect("a mirror");
    let mut twin = Twin::new(image, board).expect("vectors");
    if let Some(mistake) = mistake {
        twin.chip.make(mistake);
    }
    twin
}

#[test]
fn mistakes_of_drivers_are_caught() {
    let elf = fs::read(flashed_image()).expect("an image: `cargo xtask build stm32g474`");
    assert_eq!(examine(&mut twin(&elf, None)), Ok(()), "without a mistake");
    let next = AtomicUsize::new(0);
    let workers = thread::available_parallelism().map_or(1, usize::from);
    let mut found: Vec<(usize, Result<(), String>)> = thread::scope(|scope| {
        let work = || {
            let mut found = Vec::new();
            while let index = next.fetch_add(1, Ordering::Relaxed)
                && let Some((_, address, bits, value)) = MISTAKES.get(index).copied()
            {
                let mistake = Mistake {
                    address,
                    bits,
                    value: (bits != NEVER).then_some(value),
                };
                found.push((index, examine(&mut twin(&elf, Some(mistake)))));
            }
            found
        };
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        let results = threads
            .into_iter()
            .map(|thread| thread.join().expect("it ends"));
        results.flatten().collect()
    });
    found.sort_by_key(|(index, _)| *index);
    let mut missed = Vec::new();
    for (index, result) in &found {
        let what = MISTAKES[*index].0;
        let explained = NOT_CAUGHT.iter().find(|(name, _)| *name == what);
        match (result, explained) {
            (Err(how), _) => println!("| {what} | {how} |"),
            (Ok(()), Some((_, why))) => println!("| {what} | not by a start: {why} |"),
            (Ok(()), None) => missed.push(what),
        }
    }
    let caught = found.iter().filter(|(_, result)| result.is_err()).count();
    println!("{caught} of {} caught", MISTAKES.len());
    assert!(missed.is_empty(), "not caught: {missed:#?}");
    // At least 95 %, those that are explained included.
    assert!(caught * 20 >= MISTAKES.len() * 19);
}
