//! What of a board's behaviour shows that its driver makes a mistake.

use emulated_board::{Controls, PlantFault};
use mirror_protocol::{
    ChannelState, ClearEndpoint, Drives, Kept, LEASE_FOREVER_MS, Sense, SetDriveEndpoint,
    SetSenseEndpoint, StatusEndpoint,
};
use protection::Fault;
use silicon_twin::chip::Reset;
use silicon_twin::tool::{AskError, Tool};
use silicon_twin::{Failure, Twin};

/// Where the fault log begins in the flash (docs, storage).
const LOG: usize = 464 * 1024;

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
pub(super) fn examine(twin: &mut Twin) -> Result<(), String> {
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
    examine_flash(twin)?;
    examine_watchdog(twin)
}

/// Whether a stage that stays at its supply is turned off by the comparators, and drives again once it is mended.
fn examine_break(twin: &mut Twin) -> Result<(), String> {
    let mut tool = Tool::new(twin.clone());
    let failed = |error: AskError| error.to_string();
    let ran = |failure: Failure| failure.what;
    tool.connect().map_err(failed)?;
    tool.twin.chip.board.move_to(Controls::default());
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

/// Whether what is kept in flash is erased, written and found to be whole.
fn examine_flash(twin: &Twin) -> Result<(), String> {
    let mut tool = Tool::new(twin.clone());
    let failed = |error: AskError| error.to_string();
    tool.connect().map_err(failed)?;
    let as_designed = Sense {
        zero_a: [0.0; 4],
        gain: [1.0; 4],
    };
    let kept = tool
        .ask::<SetSenseEndpoint>(&as_designed)
        .map_err(failed)?
        .map_err(|refusal| format!("{refusal:?}"))?
        .kept;
    match kept {
        Kept::Yes => Ok(()),
        _ => Err(format!("what is to be kept is kept: {kept:?}")),
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
