//! A board that another tool has: it is read through that tool, and whose it is, is told without waiting; who waits for it
//! does not drive after a stop; a recording says what came in between; and what is interrupted says what it leaves.

use std::io::{BufRead, BufReader};
use std::process::Child;
use std::time::{Duration, Instant};

use emulated_board::{PlantFault, Speed};
use hil::{Bench, Said, interrupt, signal};
use measurement::Row;
use serde_json::Value;
use virtual_mirror::MirrorConfig;

/// What a tool says at once that waits for another.
const WAITS: &str = "waiting for the board";

/// A board whose time is the same after so long stands: it takes ticks of 0.1 ms several times as fast as the wall's clock.
const STANDS: Duration = Duration::from_millis(200);

/// A bench whose board a tool has that drives it, and how that tool is told.
fn in_use() -> (Bench, Child, String) {
    let bench = Bench::emulated(MirrorConfig::bench());
    let first = bench.start_tool(&["set-z", "100um", "--settle", "1h"]);
    bench.wait_until_driven(1);
    let owner = format!(
        "`host-tool set-z 100um --settle 1h` (process {}), since 2",
        first.id()
    );
    (bench, first, owner)
}

fn end(mut tool: Child) {
    tool.kill().expect("it dies");
    tool.wait().expect("it is gone");
}

/// What a tool said that did not wait. How long it took, which depends on the machine, is printed: 0.4 s on an idle one.
fn at_once(bench: &Bench, words: &[&str]) -> Said {
    let start = Instant::now();
    let said = bench.tool(words);
    println!("{words:?}: {:.2} s", start.elapsed().as_secs_f64());
    assert!(!said.err.contains(WAITS), "{words:?}: {said:?}");
    said
}

#[test]
fn who_only_looks_reads_a_board_in_use_and_is_told_whose_it_is_and_since_when() {
    let (bench, first, owner) = in_use();
    for (words, value) in [
        (&["status"][..], "channels   all driving"),
        (
            &["--board", "emulated", "status", "--history"],
            "channels   all driving",
        ),
        (&["list"], "firmware"),
        (&["doctor"], "firmware"),
    ] {
        let said = at_once(&bench, words);
        // Nobody else can use it now.
        let is_ready = words != ["doctor"];
        assert_eq!(said.code, i32::from(!is_ready), "{words:?}: {said:?}");
        for told in [&owner, value] {
            assert!(said.out.contains(told), "{words:?}: {}", said.out);
        }
    }
    for words in [&["range"][..], &["room"]] {
        assert_eq!(at_once(&bench, words).code, 0, "{words:?}");
    }
    let status: Value =
        serde_json::from_str(&at_once(&bench, &["status", "--json"]).out).expect("JSON");
    assert_eq!(status["owner"]["process"], first.id());
    assert_eq!(status["is_in_use"], true);
    assert!(
        status["drive_v"][0].as_f64().expect("volts") > 1.0,
        "{status}"
    );
    let list = bench.json(&["list"]);
    let listed = &list["boards"][0];
    assert_eq!(listed["owner"]["process"], first.id());
    assert_eq!(listed["identity"], status["identity"]);

    // Killed, it leaves the socket on which it answered.
    end(first);
    let alone = bench.tool(&["status"]);
    assert_eq!(alone.code, 0, "{}", alone.err);
    assert!(!alone.out.contains("host-tool set-z"), "{}", alone.out);
}

#[test]
fn who_has_a_board_and_hangs_is_named() {
    let (bench, first, _) = in_use();
    let owner = format!("(process {}), since 2", first.id());
    signal(&first, "STOP");
    for words in [&["status"][..], &["list"], &["doctor"], &["range"]] {
        let said = at_once(&bench, words);
        assert_eq!(
            said.code,
            i32::from(words != ["list"]),
            "{words:?}: {said:?}"
        );
        let told = said.out.clone() + &said.sentence();
        assert!(told.contains(&owner), "{words:?}: {said:?}");
    }
    let status = at_once(&bench, &["status", "--json"]);
    let status: Value = serde_json::from_str(&status.out).expect("JSON");
    assert_eq!(status["owner"]["process"], first.id());
    let name = status["board"]["name"].as_str().expect("a name");
    assert!(name.ends_with("emulated.sock"), "{status}");
    signal(&first, "CONT");
    bench.wait_for_status("read again", |status| status["is_in_use"] == true);
    end(first);
}

/// Starts a tool that waits for the board; it has said so when this returns.
fn start_waiting(bench: &Bench, words: &[&str]) -> (Child, String) {
    let mut tool = bench.start_tool(words);
    let mut told = String::new();
    let mut stderr = BufReader::new(tool.stderr.take().expect("it is piped"));
    stderr.read_line(&mut told).expect("text");
    tool.stderr = Some(stderr.into_inner());
    (tool, told)
}

#[test]
fn who_waits_for_a_board_gets_it_and_says_whom_it_waits_for() {
    let (bench, first, owner) = in_use();
    let words = ["set-z", "50um", "--settle", "1ms"];
    let (second, told) = start_waiting(&bench, &words);
    assert!(told.starts_with(WAITS), "{told}");
    assert!(told.contains(&format!("it is in use by {owner}")), "{told}");
    end(first);
    assert_eq!(Said::from(second).code, 0);
}

#[test]
fn who_waits_for_a_board_does_not_drive_it_once_it_was_stopped() {
    let (bench, first, _) = in_use();
    let (second, _) = start_waiting(&bench, &["set-z", "50um", "--settle", "1ms"]);
    bench.json(&["off"]);
    let said = Said::from(second);
    assert_eq!(said.code, 1);
    let sentence = said.sentence();
    assert!(
        sentence.contains("was turned off by `host-tool off` while this waited"),
        "{sentence}"
    );
    end(first);
    // The board is off at once, its outputs when their filters have let go.
    bench.wait("it is driven on", |bench| {
        bench.controls().observed().came_to_zero
    });
    assert!(bench.is_off());
    // What is asked afterwards is done.
    assert_eq!(bench.tool(&["set-z", "50um", "--settle", "1ms"]).code, 0);
}

/// Records a board that drives, while `happen` happens to it or to the tool.
fn record_while(happen: impl FnOnce(&mut Bench, &Child)) -> (Bench, Said) {
    let mut bench = Bench::emulated(MirrorConfig::bench());
    bench.json(&["set-drive", "2V", "--settle", "10ms", "--hold", "forever"]);
    let words = ["record", "-o", "r.csv", "--duration", "10h", "--json"];
    let recording = bench.start_tool(&words);
    let file = bench.directory().join("r.csv");
    // Half a second of it is in the file.
    bench.wait("it does not record", |_| {
        std::fs::metadata(&file).is_ok_and(|file| file.len() > 20_000)
    });
    happen(&mut bench, &recording);
    (bench, Said::from(recording))
}

#[test]
fn a_recording_ends_with_the_fault_that_tripped_the_board_and_its_file_is_whole() {
    let trip = |bench: &mut Bench, _: &Child| {
        bench.controls().inject(Some(PlantFault::OpenHeater(1)));
    };
    let (bench, said) = record_while(trip);
    assert_eq!(said.code, 1);
    let sentence = said.sentence();
    assert!(
        sentence.contains("channel 2 has turned the board off: open-heater"),
        "{sentence}"
    );
    let file = bench.measured("r.csv");
    let recorded: Value = serde_json::from_str(&said.out).expect("JSON");
    assert_eq!(recorded["samples"], file.rows.len());
    let drives = |row: usize| file.rows[row].voltage_v;
    assert!(drives(0)[0] > 1.9, "driven at first");
    let partial = file.keys.get("partial").unwrap_or_default();
    assert!(partial.contains("open-heater"), "{partial}");
    let text = std::fs::read_to_string(bench.directory().join("r.csv")).expect("a file");
    let last = format!("# rows={}\n", file.rows.len());
    assert!(text.ends_with(&last), "it has its end");
    // The board sends on to nobody.
    assert_eq!(bench.tool(&["status"]).code, 0);
}

#[test]
fn a_recording_whose_file_was_removed_ends_and_says_so() {
    let remove = |bench: &mut Bench, _: &Child| {
        std::fs::remove_file(bench.directory().join("r.csv")).expect("it is there");
    };
    let (bench, said) = record_while(remove);
    assert_eq!(said.code, 1, "{said:?}");
    assert!(said.sentence().contains("r.csv is gone"), "{}", said.err);
    assert!(said.out.contains("\"code\":\"gone\""), "{}", said.out);
    assert_eq!(bench.tool(&["status"]).code, 0);
}

#[test]
fn a_recording_that_others_look_through_loses_nothing() {
    let look = |bench: &mut Bench, tool: &Child| {
        let bench = &*bench;
        let look = || {
            let status = bench.json(&["status"]);
            assert_eq!(status["owner"]["process"], tool.id(), "{status}");
        };
        // Two at once, several times.
        std::thread::scope(|looks| {
            for _ in 0..2 {
                looks.spawn(|| (0..3).for_each(|_| look()));
            }
        });
        interrupt(tool);
    };
    let (bench, said) = record_while(look);
    assert_eq!(said.code, 130, "{}", said.err);
    assert_whole(&bench);
}

/// Of a tool that gets no processor for a while, an emulated board waits: its time stands rather than that a sample is lost.
#[test]
fn a_recording_of_a_tool_that_stands_still_for_a_while_loses_nothing() {
    let stand_still = |bench: &mut Bench, tool: &Child| {
        for _ in 0..3 {
            signal(tool, "STOP");
            wait_until_it_stands(bench);
            signal(tool, "CONT");
            let now_s = bench.simulated_s();
            bench.wait_until_s(now_s + 0.5);
        }
        // A stop waits for no tool.
        signal(tool, "STOP");
        wait_until_it_stands(bench);
        bench.json(&["off"]);
        signal(tool, "CONT");
        interrupt(tool);
    };
    let (bench, said) = record_while(stand_still);
    assert_eq!(said.code, 130, "{}", said.err);
    assert_whole(&bench);
}

/// Waits until the board's time stands, since nobody takes its samples.
fn wait_until_it_stands(bench: &Bench) {
    let mut before_s = f64::NEG_INFINITY;
    bench.wait("its time does not stand", |bench| {
        std::thread::sleep(STANDS);
        let now_s = bench.simulated_s();
        std::mem::replace(&mut before_s, now_s) == now_s
    });
}

/// No sample of the recording is missing.
fn assert_whole(bench: &Bench) {
    let rows = bench.measured("r.csv").rows;
    let is_next = |pair: &[Row]| (pair[1].t_s - pair[0].t_s - 1e-3).abs() < 2e-6;
    // Times are written to a microsecond.
    let gap = rows.windows(2).find(|pair| !is_next(pair));
    let gap = gap.map(|pair| [pair[0].t_s, pair[1].t_s]);
    assert_eq!(gap, None, "of {} samples", rows.len());
}

#[test]
fn a_recording_says_that_the_board_was_stopped() {
    let stop = |bench: &mut Bench, tool: &Child| {
        bench.json(&["off"]);
        // A second of what it reads then, and half a second that it may hold back.
        let now_s = bench.simulated_s();
        bench.wait_until_s(now_s + 1.5);
        interrupt(tool);
    };
    let (bench, said) = record_while(stop);
    assert_eq!(said.code, 130, "{}", said.err);
    let recorded: Value = serde_json::from_str(&said.out).expect("JSON");
    assert_eq!(recorded["stopped"], true);
    let file = bench.measured("r.csv");
    let driven = |row: &Row| row.voltage_v != [0.0; 4];
    assert!(driven(&file.rows[0]));
    assert!(!driven(file.rows.last().expect("rows")));
}

/// Interrupts a tool once it drives, and returns what it said.
fn interrupted(bench: &Bench, words: &[&str]) -> Said {
    // What was observed of earlier drives is forgotten.
    bench.controls().inject(None);
    let tool = bench.start_tool(words);
    // A second of the board's: the tool has its answer by then, and hears Ctrl-C.
    bench.wait_until_driven(10_000);
    interrupt(&tool);
    let said = Said::from(tool);
    assert_eq!(said.code, 130, "{}", said.err);
    said
}

#[test]
fn a_move_that_is_interrupted_says_that_the_mirror_is_held_and_a_scan_turns_it_off() {
    let bench = Bench::emulated(MirrorConfig::bench());
    let said = interrupted(
        &bench,
        &["set-z", "60um", "--settle", "1h", "--hold", "600s"],
    );
    let sentence = said.sentence();
    for word in [
        "driven on: held for 4201 s at most, then ramped to zero",
        "host-tool off",
    ] {
        assert!(sentence.contains(word), "{sentence}");
    }
    let driven = bench.json(&["status"]);
    assert_eq!(driven["states"][0], "driving", "{driven}");
    // It is healthy: there is nothing to clear, and it is driven on.
    bench.json(&["clear"]);
    let driven = bench.json(&["status"]);
    assert_eq!(driven["states"][0], "driving", "{driven}");
    assert!(
        driven["drive_v"][0].as_f64().expect("volts") > 0.5,
        "{driven}"
    );

    bench.json(&["off"]);
    bench.wait("it is driven on", |bench| {
        bench.controls().observed().came_to_zero
    });
    let scan = [
        "scan",
        "sine",
        "--offset",
        "60um",
        "--amplitude",
        "20um",
        "--frequency",
        "5Hz",
        "--cycles",
        "100000",
    ];
    interrupted(&bench, &scan);
    bench.wait("it is driven on", |bench| {
        bench.controls().observed().came_to_zero
    });
    assert!(bench.is_off());

    // A service manager ends it.
    bench.controls().inject(None);
    let tool = bench.start_tool(&scan);
    bench.wait_until_driven(10_000);
    signal(&tool, "TERM");
    let said = Said::from(tool);
    assert_eq!(said.code, 130, "{}", said.err);
    assert!(said.err.contains("channels are off"), "{}", said.err);
    assert!(bench.is_off());
}

#[test]
fn a_calibration_of_the_sense_that_is_interrupted_leaves_the_one_of_before() {
    // Driving takes 0.5 s of the board's time, and here of the wall's.
    let bench = Bench::changed(|emulation| emulation.speed = Speed::Times(1.0));
    let tool = bench.start_tool(&["calibrate-sense", "--resistor", "499ohm"]);
    bench.wait_until_driven(1);
    interrupt(&tool);
    let said = Said::from(tool);
    assert_eq!(said.code, 130, "{}", said.err);
    assert!(said.sentence().contains("channels are off"), "{}", said.err);
    bench.wait("it is driven on", |bench| {
        bench.controls().observed().came_to_zero
    });
    let again = bench.json(&["calibrate-sense"]);
    assert_eq!(
        again["before"]["zero_a"],
        serde_json::json!([0.0, 0.0, 0.0, 0.0])
    );
}

#[test]
fn a_calibration_that_is_interrupted_before_it_is_loaded_leaves_the_one_of_before() {
    // A board of which nobody took the zero has it taken first, which here takes 0.8 s of the wall's clock.
    let bench = Bench::changed(|emulation| emulation.speed = Speed::Times(1.0));
    let model = mirror_model::Model::from(mirror_model::Preset::Reconciled);
    let other = calibration::tabulate(&model).expect("it has an inverse");
    let other = calibration::to_toml(&other.calibration);
    std::fs::write(bench.directory().join("other.toml"), other).expect("written");
    bench.json(&["set-drive", "1V", "--settle", "1ms", "--hold", "forever"]);
    bench.wait_until_driven(1);
    let tool = bench.start_tool(&["load-calibration", "other.toml"]);
    bench.wait("its channels are not turned off for that", |bench| {
        bench.controls().observed().came_to_zero
    });
    interrupt(&tool);
    let said = Said::from(tool);
    assert_eq!(said.code, 130, "{}", said.err);
    assert!(said.sentence().contains("channels are off"), "{}", said.err);
    let loaded = bench.json(&["load-calibration", "other.toml"]);
    assert_eq!(loaded["before"], "as the factory left it");
}
