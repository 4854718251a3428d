//! A control loop that takes too long, as a longer calculation would make it: it is told, and keeps nothing from the conversions' end.

use emulated_board::Controls;
use mirror_protocol::Health;
use silicon_twin::timing::{CONTROL_LOOP, Latest};
use silicon_twin::tool::Tool;

use crate::common::{self, CYCLES_PER_US};

/// What masks interrupts keeps the conversions' end waiting, and nothing else does (`timing`, in us).
const LATENCY_US: u64 = 5;
/// The drives are for the update that comes a tick after that of the tick (us).
const NEXT_UPDATE_US: u64 = 100;
/// A loop that takes longer than two ticks has missed one.
const TWO_TICKS_US: u64 = 200;

fn step(tool: &mut Tool) {
    tool.twin
        .step()
        .unwrap_or_else(|failure| panic!("{failure}"));
}

fn is_in_loop(tool: &Tool) -> bool {
    tool.twin.cpu.exception() == CONTROL_LOOP
}

/// Lets one run of the control loop wait `cycles` at each of its instructions that masks no interrupt, for a calculation masks none;
/// how long it takes then, in microseconds.
fn slow_down(tool: &mut Tool, cycles: u64) -> u64 {
    while is_in_loop(tool) {
        step(tool);
    }
    while !is_in_loop(tool) {
        step(tool);
    }
    let ticks = tool.twin.timing.control_loop().count;
    let begun = tool.twin.chip.clock.cycles;
    while tool.twin.timing.control_loop().count == ticks {
        if is_in_loop(tool) && !tool.twin.cpu.masks_interrupts() {
            tool.twin.chip.clock.cycles += cycles;
        }
        step(tool);
    }
    (tool.twin.chip.clock.cycles - begun) / CYCLES_PER_US
}

#[test]
fn a_drive_that_comes_too_late_is_told_as_late_however_late_it_is() {
    let mut driven = common::greeted();
    common::drive(&mut driven, 2.5);
    driven.twin.run_for(0.01).expect("it runs");
    let before = common::status(&mut driven).health;
    assert_eq!((before.late_ticks, before.missed_ticks), (0, 0));
    for cycles in 0.. {
        let mut tool = driven.clone();
        tool.twin.chip.board.move_to(Controls::default());
        tool.twin.timing.count_anew();
        let took_us = slow_down(&mut tool, cycles);
        tool.twin.run_for(0.01).expect("it runs");
        let Latest {
            written, latency, ..
        } = tool.twin.timing.latest();
        let Health {
            late_ticks,
            missed_ticks,
            ..
        } = common::status(&mut tool).health;
        let is_late = written / CYCLES_PER_US >= NEXT_UPDATE_US;
        assert_eq!(late_ticks > 0, is_late, "{took_us} us");
        // The loop begins as late as what masks interrupts lets it, and counts from there.
        if took_us.abs_diff(TWO_TICKS_US) > LATENCY_US {
            assert_eq!(missed_ticks > 0, took_us > TWO_TICKS_US, "{took_us} us");
        }
        let latency_us = latency / CYCLES_PER_US;
        assert!(latency_us < LATENCY_US, "{latency_us} of {took_us} us");
        if took_us > TWO_TICKS_US + LATENCY_US {
            break;
        }
    }
}
