//! Power is cut at the operations of the flash, in the midst of each: a double word is left torn, whose error correction
//! raises the NMI when it is read, and a page half erased. The image starts, and has the newest calibration that is whole,
//! or every entry of the fault log that it had acknowledged.

use emulated_board::{Controls, PlantFault};
use mirror_protocol::{
    CalibrationEndpoint, CalibrationUse, CalibrationUseEndpoint, FaultLogEndpoint, Kept, LogQuery,
};
use rayon::prelude::*;
use silicon_twin::Twin;
use silicon_twin::chip::Reset;
use silicon_twin::tool::Tool;

use crate::common;

/// In the short form every so-many-th operation; a number that shares no factor with the double words of a page.
const SHORT_STEP: usize = 71;

/// Two calibrations, by the hash of their model.
const OLD: u64 = 0x01d;
const NEW: u64 = 0x2e3;

fn keep(tool: &mut Tool) {
    let used = tool.ask::<CalibrationUseEndpoint>(&CalibrationUse::ForGood);
    let used = used.expect("an answer").expect("it is put to use");
    assert_eq!(used.kept, Kept::Yes);
}

/// Lets `begin` happen, and cuts the power in the midst of the operation `number` of the flash; whether there was one.
fn cut(tool: &mut Tool, number: u64, begin: impl FnOnce(&mut Tool)) -> bool {
    begin(tool);
    let end_s = tool.twin.seconds() + 0.5;
    let is_under_way = |twin: &Twin| twin.chip.flash_operations() >= number;
    tool.twin
        .run_until(|twin| is_under_way(twin) || twin.seconds() > end_s)
        .unwrap_or_else(|failure| panic!("{failure}"));
    if !is_under_way(&tool.twin) {
        return false;
    }
    tool.twin.reset(Reset::Power).expect("vectors");
    true
}

/// The hash of the calibration that is kept, after a start.
fn kept(tool: &mut Tool) -> u64 {
    tool.connect().unwrap_or_else(|error| panic!("{error}"));
    let info = tool.ask::<CalibrationEndpoint>(&()).expect("an answer");
    let info = info.expect("greeted");
    assert_eq!(info.kept, Kept::Yes, "{info:?}");
    assert_eq!(tool.twin.resets().last(), Some(&Reset::Power));
    info.model_hash
}

/// Does `each` for every operation of `all`, or for some of them, on all processors; its results in order.
fn for_operations<T: Send>(
    all: std::ops::Range<u64>,
    each: impl Fn(u64) -> T + Send + Sync,
) -> Vec<T> {
    let step = if long_runs::are_asked_for() {
        1
    } else {
        SHORT_STEP
    };
    // The last one is where it is decided.
    let last = all.end - 1;
    let mut chosen: Vec<u64> = all.step_by(step).collect();
    if chosen.last() != Some(&last) {
        chosen.push(last);
    }
    chosen.into_par_iter().map(each).collect()
}

#[test]
fn a_power_cut_while_a_calibration_is_kept_leaves_the_old_one_or_the_new_one() {
    let mut before = common::greeted();
    common::upload(&mut before, OLD);
    keep(&mut before);
    common::upload(&mut before, NEW);
    let first = before.twin.chip.flash_operations() + 1;
    let mut whole = before.clone();
    keep(&mut whole);
    let operations = first..whole.twin.chip.flash_operations() + 1;
    let count = operations.end - operations.start;
    let found = for_operations(operations, |operation| {
        let mut tool = before.clone();
        let use_it = |tool: &mut Tool| {
            tool.send::<CalibrationUseEndpoint>(&CalibrationUse::ForGood);
        };
        assert!(cut(&mut tool, operation, use_it), "operation {operation}");
        let hash = kept(&mut tool);
        let met_torn = tool.twin.timing.nmi().count > 0;
        // The next one is kept too, wherever the torn words are.
        common::upload(&mut tool, NEW + 1);
        keep(&mut tool);
        tool.twin.reset(Reset::Power).expect("vectors");
        assert_eq!(kept(&mut tool), NEW + 1, "after operation {operation}");
        (hash, met_torn)
    });
    let old = found.iter().take_while(|(hash, _)| *hash == OLD).count();
    assert!(old > 0, "{found:x?}");
    assert!(
        found[old..].iter().all(|(hash, _)| *hash == NEW),
        "what was once the new one stays it: {found:x?}"
    );
    let torn = found.iter().filter(|(_, met_torn)| *met_torn).count();
    assert!(torn > 0, "no start met a torn double word");
    println!(
        "{} of {count} operations of the flash cut while a calibration was kept: {old} left the old one, {} the new one; at \
         {torn} the next start met a torn double word",
        found.len(),
        found.len() - old
    );
}

/// The numbers of the entries of the fault log.
fn entries(tool: &mut Tool) -> Vec<u32> {
    let mut numbers = Vec::new();
    let mut most = Some(u32::MAX);
    while let Some(query) = most.map(|most| LogQuery { most }) {
        let page = tool.ask::<FaultLogEndpoint>(&query).expect("an answer");
        let Some(entry) = page.expect("greeted").entry else {
            break;
        };
        numbers.push(entry.number);
        most = entry.number.checked_sub(1);
    }
    numbers
}

#[test]
fn a_power_cut_while_a_trip_is_logged_hides_no_entry_of_before() {
    let mut before = common::greeted();
    let known = entries(&mut before);
    assert!(!known.is_empty(), "its start has one");
    let trip = |tool: &mut Tool| {
        let controls = tool.twin.chip.board.controls();
        controls.inject(Some(PlantFault::WeakSupply));
    };
    let first = before.twin.chip.flash_operations() + 1;
    let mut whole = before.clone();
    whole.twin.chip.board.move_to(Controls::default());
    trip(&mut whole);
    whole.twin.run_for(0.1).expect("it runs");
    let operations = first..whole.twin.chip.flash_operations() + 1;
    assert!(operations.end > operations.start, "it is logged");
    let count = operations.end - operations.start;
    let cuts = for_operations(operations, |operation| {
        let mut tool = before.clone();
        tool.twin.chip.board.move_to(Controls::default());
        assert!(cut(&mut tool, operation, trip), "operation {operation}");
        tool.twin.chip.board.controls().inject(None);
        tool.connect().unwrap_or_else(|error| panic!("{error}"));
        let found = entries(&mut tool);
        assert!(
            known.iter().all(|number| found.contains(number)),
            "operation {operation}: {known:?} {found:?}"
        );
        let said = common::status(&mut tool).last_stop;
        assert_eq!(said.as_str(), "", "it did not stop");
    });
    println!(
        "{} of {count} operations of the flash cut while a trip was logged: no entry of before was lost",
        cuts.len()
    );
}
