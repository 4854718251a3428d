//! The comparators' line is low for a moment, as a short peak of a stage makes it, whenever in a tick that is: the outputs
//! stay off, and it is told.

use emulated_board::Controls;
use mirror_protocol::ChannelState;
use protection::Fault;
use silicon_twin::tool::Tool;

use crate::common::{self, CYCLES_PER_US};

const TICK_CYCLES: u64 = 100 * CYCLES_PER_US;
/// Longer than the 1.5 us that the timer's filter takes for a glitch of its own, shorter than anything of the firmware.
const PEAK_CYCLES: u64 = 2 * CYCLES_PER_US;
/// From one instant that is tried to the next: shorter than the control loop takes from its beginning to its drives.
const STEP_US: u64 = 4;

/// Lets `cycles` pass, instruction by instruction, in which the outputs are on, or are off.
#[track_caller]
fn pass(tool: &mut Tool, cycles: u64, are_on: bool) {
    let end = tool.twin.chip.clock.cycles + cycles;
    while tool.twin.chip.clock.cycles < end {
        tool.twin
            .step()
            .unwrap_or_else(|failure| panic!("{failure}"));
        assert_eq!(tool.twin.chip.compares().1, are_on);
    }
}

#[test]
fn a_peak_of_over_voltage_is_told_and_turns_off_whenever_in_a_tick_it_comes() {
    let mut driven = common::greeted();
    common::drive(&mut driven, 2.5);
    driven.twin.run_for(0.01).expect("it runs");
    let ticks = driven.twin.chip.trace.ticks();
    let begins = |twin: &silicon_twin::Twin| twin.chip.trace.ticks() > ticks;
    driven.twin.run_until(begins).expect("it runs");
    for after_us in (0..100).step_by(STEP_US as usize) {
        let mut tool = driven.clone();
        tool.twin.chip.board.move_to(Controls::default());
        pass(&mut tool, after_us * CYCLES_PER_US, true);
        tool.twin.chip.pull_comparators_line(true);
        pass(&mut tool, PEAK_CYCLES, false);
        tool.twin.chip.pull_comparators_line(false);
        pass(&mut tool, 3 * TICK_CYCLES, false);
        let states = common::status(&mut tool).telemetry.states;
        let over_voltage = ChannelState::Tripped(Fault::OutputOverVoltage.code());
        assert_eq!(states, [over_voltage; 4], "{after_us} us after the update");
    }
}
