//! A flash that takes nothing more.

use mirror_protocol::{CalibrationEndpoint, CalibrationUse, CalibrationUseEndpoint, Kept};
use silicon_twin::chip::Reset;

use crate::common;

#[test]
fn a_worn_flash_keeps_nothing_and_nothing_else_is_lost() {
    let mut tool = common::greeted();
    tool.twin.chip.wear_out_flash();
    common::upload(&mut tool, 1);
    tool.send::<CalibrationUseEndpoint>(&CalibrationUse::ForGood);
    // All eight slots are tried, of two pages and some 300 double words each.
    tool.twin
        .run_for(0.7)
        .unwrap_or_else(|failure| panic!("{failure}"));
    assert_eq!(tool.twin.resets(), [Reset::Power], "no watchdog bites");
    let info = tool.ask::<CalibrationEndpoint>(&()).expect("an answer");
    assert_eq!(info.expect("greeted").kept, Kept::No);
}
