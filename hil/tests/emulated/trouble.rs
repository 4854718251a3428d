//! A machine that is busy, a plant that stumbles, a board that hangs.

use std::thread;
use std::time::Duration;

use emulated_board::{EmulatedBoard, PlantFault};

use crate::bench;

/// Longer than any time-out that a board could have by the wall's clock.
const STARVED: Duration = Duration::from_secs(6);

/// Has a board that drives go through `trouble`, and expects it to drive on as if nothing had been.
fn goes_on_through(trouble: impl FnOnce(&EmulatedBoard)) {
    let mut bench = bench();
    bench.json(&["set-drive", "2V", "--settle", "10ms", "--hold", "forever"]);
    let before = bench.json(&["status"]);
    let board = bench.emulated_board().expect("emulated");
    trouble(board);
    let later_s = board.simulated_s() + 0.2;
    bench.wait_until_s(later_s);
    let after = bench.json(&["status"]);
    assert_eq!(
        after["states"],
        serde_json::json!(vec!["driving"; 4]),
        "{after}"
    );
    assert_eq!(after["drive_v"], before["drive_v"], "{after}");
    assert_eq!(after["missed_ticks"], 0, "{after}");
    let up_s = |status: &serde_json::Value| status["up_s"].as_f64().expect("a number");
    assert!(up_s(&after) > up_s(&before), "it was not reset: {after}");
}

#[test]
fn a_fault_whose_cause_is_there_still_is_not_cleared_and_that_is_told() {
    let bench = bench();
    bench.controls().inject(Some(PlantFault::OpenHeater(1)));
    let moved = bench.tool(&["set-drive", "1V", "--settle", "1h"]);
    assert!(moved.sentence().contains("open-heater"), "{}", moved.err);
    for words in [&["clear"][..], &["clear", "--json"]] {
        let said = bench.tool(words);
        assert_eq!(said.code, 1, "{said:?}");
        assert!(said.out.contains("tripped: open-heater"), "{}", said.out);
        assert!(
            said.sentence().contains(
                "clearing has not helped: channel 2 has turned the board off again, open-heater"
            ),
            "{}",
            said.err
        );
    }
    bench.controls().inject(None);
    assert_eq!(bench.tool(&["clear"]).code, 0);
}

#[test]
fn a_board_without_a_processor_for_a_while_goes_on() {
    goes_on_through(|board| {
        board.pause().expect("it runs");
        thread::sleep(STARVED);
        board.resume().expect("it is there");
    });
}

#[test]
fn a_board_whose_plant_is_kept_from_answering_goes_on() {
    goes_on_through(|board| board.controls().inject(Some(PlantFault::Stall)));
}

#[test]
fn an_answer_that_nobody_asked_for_is_passed_over() {
    goes_on_through(|board| board.controls().inject(Some(PlantFault::StaleAnswer)));
}

/// Four times as long as the emulated board's watchdog waits from one look to the next (`src/board/mps2/watchdog.rs`).
const SEVERAL_LOOKS: Duration = Duration::from_secs(1);

#[test]
fn a_board_that_hangs_is_reset_and_can_be_cleared() {
    let mut bench = bench();
    bench.json(&["set-drive", "2V", "--settle", "10ms"]);
    let board = bench.emulated_board().expect("emulated");
    // A machine without a processor to spare must not wear the watchdog out.
    board.pause().expect("it runs");
    thread::sleep(SEVERAL_LOOKS);
    board.resume().expect("it is there");
    let before_s = board.simulated_s();
    board.controls().inject(Some(PlantFault::Hang));
    // It has started anew, and checked its heaters.
    bench.wait_until_s(before_s + 0.5);
    let status = bench.json(&["status"]);
    assert_eq!(status["drive_v"], serde_json::json!([0.0, 0.0, 0.0, 0.0]));
    assert!(status.to_string().contains("watchdog-reset"), "{status}");
    bench.json(&["clear"]);
    bench.json(&["set-drive", "2V", "--settle", "10ms"]);
    let status = bench.json(&["status"]);
    assert_eq!(status["missed_ticks"], 0, "{status}");
}
