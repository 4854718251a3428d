//! The way to the bootloader in the ROM, and back from it.

use mirror_protocol::{Drives, EnterBootloaderEndpoint, LEASE_FOREVER_MS, SetDriveEndpoint};
use silicon_twin::IN_BOOTLOADER;
use silicon_twin::chip::Reset;

use crate::common;

#[test]
fn a_board_that_drives_goes_to_the_rom_with_its_outputs_off() {
    let mut tool = common::greeted();
    let drives = Drives {
        drive_v: [2.0; 4],
        lease_ms: LEASE_FOREVER_MS,
    };
    let driven = tool.ask::<SetDriveEndpoint>(&drives).expect("an answer");
    driven.expect("it is driven");
    tool.twin.run_for(0.01).expect("it runs");
    assert!(tool.twin.chip.compares().1, "outputs are enabled");
    let answer = tool.ask::<EnterBootloaderEndpoint>(&());
    answer.expect("an answer").expect("it goes there");
    let end = tool.twin.run_for(0.5).expect_err("nothing of ours runs");
    assert_eq!(end.what, IN_BOOTLOADER);
    assert!(!tool.twin.chip.compares().1, "outputs are disabled");
    assert!(
        !tool.twin.chip.is_load_switch_on(),
        "and their stages have no supply"
    );
    assert_eq!(
        tool.twin.resets(),
        [Reset::Power, Reset::Software],
        "it goes there from a reset"
    );
    // The reset leaves the pins to the board's pull-downs; two poles at 2 kHz have forgotten 2 V by then.
    let drive_v = tool.twin.chip.board.drive_v();
    assert!(drive_v.iter().all(|v| *v < 0.01), "{drive_v:?}");
}

#[test]
fn the_rom_s_way_into_the_program_starts_it_without_a_reset() {
    let mut tool = common::greeted();
    tool.ask::<EnterBootloaderEndpoint>(&())
        .expect("an answer")
        .expect("it goes there");
    tool.twin.run_for(0.5).expect_err("nothing of ours runs");
    tool.twin
        .leave_bootloader()
        .unwrap_or_else(|failure| panic!("{failure}"));
    let resets = tool.twin.resets().len();
    let identity = tool.connect().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(identity.board.as_str(), "STM32G474RE driver board");
    assert_eq!(tool.twin.resets().len(), resets, "it has come up at once");
    let first = tool.twin.chip.trace.last();
    tool.twin.run_for(0.01).expect("it runs");
    let last = tool.twin.chip.trace.last();
    let cycles = last.cycle - first.cycle;
    assert_eq!(cycles % 17_000, 0, "ticks of 100 us");
    // One more begins in 10 ms where they begin with a tick.
    assert!((100..=101).contains(&(cycles / 17_000)), "{cycles} cycles");
}
