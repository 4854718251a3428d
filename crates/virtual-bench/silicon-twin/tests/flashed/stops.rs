//! What a start tells of the stop before it, out of the chip's own flags: in the status, and in the fault log.

use mirror_protocol::{
    ChannelState, FaultLogEndpoint, LogEvent, LogQuery, ResetCause, StartEvent, Status,
    StatusEndpoint,
};
use protection::Fault;
use silicon_twin::chip::{Mistake, Reset};
use silicon_twin::tool::Tool;

use crate::common;

/// Greets a board that has started anew.
fn started_anew(tool: &mut Tool) -> (Status, StartEvent) {
    tool.connect().unwrap_or_else(|error| panic!("{error}"));
    let status = tool.ask::<StatusEndpoint>(&()).expect("an answer");
    let mut most = u32::MAX;
    let start = loop {
        let page = tool.ask::<FaultLogEndpoint>(&LogQuery { most });
        let entry = page.expect("an answer").expect("a page").entry;
        let entry = entry.expect("the start has an entry");
        match LogEvent::of(&entry) {
            Some(LogEvent::Start(start)) => break start,
            _ => most = entry.number - 1,
        }
    };
    (status.expect("status"), start)
}

/// Both tell of this stop, with this in what the firmware said.
#[track_caller]
fn tell(tool: &mut Tool, cause: ResetCause, fault: Fault, said: &str) {
    let (status, start) = started_anew(tool);
    let code = fault.code();
    assert_eq!((start.cause, start.stop), (cause, Some(code)));
    assert!(start.said.contains(said), "{start:?}");
    assert!(status.last_stop.contains(said), "{}", status.last_stop);
    assert_eq!(status.telemetry.states, [ChannelState::Tripped(code); 4]);
    assert_eq!(status.telemetry.drive_v, [0.0; 4]);
}

#[test]
fn a_watchdog_s_reset_is_told_as_one() {
    let mut tool = common::greeted();
    tool.twin.hang();
    let reset = tool.twin.run_until(|twin| twin.resets().len() > 1);
    reset.unwrap_or_else(|failure| panic!("{failure}"));
    assert_eq!(tool.twin.resets(), [Reset::Power, Reset::Watchdog]);
    tell(&mut tool, ResetCause::Watchdog, Fault::WatchdogReset, "");
}

/// ADC1's interrupts, and the one at the end of its injected sequence (RM0440, ADC_IER: JEOSIE).
const ADC1_IER: u32 = 0x5000_0004;
const SEQUENCE_ENDS: u32 = 1 << 6;

#[test]
fn a_control_loop_that_does_not_run_is_no_reason_to_feed_the_watchdog() {
    let mut twin = common::twin();
    // The loop never runs, and all the rest does.
    twin.chip.make(Mistake {
        address: ADC1_IER,
        bits: SEQUENCE_ENDS,
        value: Some(0),
    });
    // Half a second of a watchdog that is not fed, and not twice.
    twin.run_for(0.8)
        .unwrap_or_else(|failure| panic!("{failure}"));
    assert_eq!(twin.resets(), [Reset::Power, Reset::Watchdog]);
}

#[test]
fn a_fault_of_the_processor_is_told_with_its_place() {
    let mut tool = common::greeted();
    // Where nothing is.
    tool.twin.derail(0x6000_0000);
    let reset = tool.twin.run_until(|twin| twin.resets().len() > 1);
    reset.unwrap_or_else(|failure| panic!("{failure}"));
    tell(
        &mut tool,
        ResetCause::Firmware,
        Fault::HardFault,
        "at 0x60000000",
    );
}

#[test]
fn the_first_start_is_told_as_that_of_the_power() {
    let mut tool = common::greeted();
    let (status, start) = started_anew(&mut tool);
    assert_eq!((start.cause, start.stop), (ResetCause::Power, None));
    assert_eq!(status.last_stop.as_str(), "");
}
