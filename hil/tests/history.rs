//! What a board remembers of its starts and trips, as `status --history` shows it.

use std::path::{Path, PathBuf};

use emulated_board::PlantFault;
use hil::{Bench, RawLink};
use mirror_protocol::{ClearEndpoint, FaultLogEndpoint, LogPage, LogQuery, PROTOCOL_VERSION};
use serde_json::{Value, json};
use virtual_mirror::MirrorConfig;

fn board(flash: &Path) -> Bench {
    Bench::with_flash(MirrorConfig::bench(), Some(flash))
}

fn history(bench: &Bench) -> Value {
    bench.json(&["status", "--history"])["history"].clone()
}

/// Those entries of a history that tell a start, or a trip; the newest first.
fn of_kind<'a>(history: &'a Value, kind: &str) -> Vec<&'a Value> {
    let entries = history["entries"].as_array().expect("entries");
    entries
        .iter()
        .filter(|entry| !entry[kind].is_null())
        .collect()
}

#[test]
fn a_trip_is_there_after_the_power_was_cut_and_the_boot_has_the_next_number() {
    let directory = tempfile::tempdir().expect("a directory");
    let flash = directory.path().join("flash");
    let mut bench = board(&flash);
    let first = history(&bench);
    assert_eq!((&first["boot"], &first["trips"]), (&json!(1), &json!(0)));
    assert_eq!(first["storage"], "kept");
    assert_eq!(of_kind(&first, "start")[0]["start"]["cause"], "power");

    bench.json(&["set-drive", "2V", "--settle", "10ms", "--hold", "forever"]);
    let emulated = bench.emulated_board().expect("emulated");
    emulated.controls().inject(Some(PlantFault::OpenHeater(2)));
    bench.wait_for_status("tripped", |status| {
        status["states"][2] == "tripped: open-heater"
    });
    let tripped = history(&bench);
    assert_eq!(tripped["trips"], 1);
    let trips = of_kind(&tripped, "trip");
    let [entry] = &trips[..] else {
        panic!("{tripped}");
    };
    assert_eq!(entry["boot"], 1);
    let trip = &entry["trip"];
    assert_eq!(trip["faults"], json!([null, null, "open-heater", null]));
    assert_eq!(trip["times"], 1);
    // What was driven when it was found, quantised, and what flowed then.
    let number = |of: &Value| of.as_f64().expect("a number");
    assert!((number(&trip["drive_v"][0]) - 2.0).abs() < 1e-3, "{trip}");
    assert!(number(&trip["current_a"][0]) > 1e-3, "{trip}");
    assert!(number(&trip["current_a"][2]) < 1e-4, "{trip}");
    assert!((number(&trip["supply_v"]) - 5.0).abs() < 0.1, "{trip}");
    let up_s = bench.json(&["status"])["up_s"].clone();
    assert!(
        (0.26..number(&up_s)).contains(&number(&trip["up_s"])),
        "{trip}"
    );

    let text = bench.tool(&["status", "--history"]).out;
    assert!(
        text.contains("open-heater on channel 3; supply 5.0"),
        "{text}"
    );
    drop(bench);

    let again = history(&board(&flash));
    assert_eq!((&again["boot"], &again["trips"]), (&json!(2), &json!(0)));
    assert_eq!(of_kind(&again, "trip"), trips, "as before");
    let boots: Vec<&Value> = of_kind(&again, "start")
        .iter()
        .map(|start| &start["boot"])
        .collect();
    assert_eq!(boots, [2, 1]);
}

fn link(bench: &Bench) -> RawLink {
    let mut link = RawLink::connect(&PathBuf::from(bench.board())).expect("the board listens");
    link.greet(PROTOCOL_VERSION).unwrap().unwrap();
    link
}

fn page(link: &mut RawLink) -> LogPage {
    let query = LogQuery { most: u32::MAX };
    link.ask::<FaultLogEndpoint>(&query)
        .unwrap()
        .unwrap()
        .expect("greeted")
}

/// Trips of one kind, and entries that they make: the first eight, the 16th and the 32nd.
const TRIPS: u32 = 40;
const WRITTEN: usize = 10;

#[test]
fn a_board_that_trips_or_resets_in_a_loop_spares_its_flash() {
    let directory = tempfile::tempdir().expect("a directory");
    let flash = directory.path().join("flash");
    let mut bench = board(&flash);
    let emulated = bench.emulated_board().expect("emulated");
    emulated.controls().inject(Some(PlantFault::WeakSupply));
    let mut link = link(&bench);
    for trips in 1..=TRIPS {
        while page(&mut link).trips < trips {}
        link.ask::<ClearEndpoint>(&())
            .unwrap()
            .unwrap()
            .expect("it is cleared");
    }
    let emulated = bench.emulated_board().expect("emulated");
    emulated.controls().inject(None);
    drop(link);
    let looped = history(&bench);
    let times: Vec<&Value> = of_kind(&looped, "trip")
        .iter()
        .map(|trip| &trip["trip"]["times"])
        .collect();
    assert_eq!(times.len(), WRITTEN, "{looped}");
    assert_eq!(times, [32, 16, 8, 7, 6, 5, 4, 3, 2, 1]);

    // Ten resets after the first start: eleven in succession, of which eight have an entry.
    let emulated = bench.emulated_board().expect("emulated");
    let before_s = emulated.simulated_s();
    emulated.controls().inject(Some(PlantFault::ResetLoop));
    bench.wait_until_s(before_s + PlantFault::RESET_LOOP_S + 0.1);
    let reset = history(&bench);
    assert_eq!(reset["boot"], 11);
    assert_eq!(of_kind(&reset, "start").len(), 8, "{reset}");
    assert_eq!(of_kind(&reset, "start")[0]["start"]["cause"], "firmware");

    // A start after a power cut is always told.
    drop(bench);
    let again = history(&board(&flash));
    let newest = of_kind(&again, "start")[0];
    assert_eq!(
        (&newest["start"]["cause"], &newest["boot"]),
        (&json!("power"), &again["boot"])
    );
}

#[test]
fn a_worn_flash_is_told_and_the_board_does_what_it_is_told() {
    let mut bench = Bench::emulated(MirrorConfig::bench());
    let emulated = bench.emulated_board().expect("emulated");
    emulated.wear_out_flash().expect("a file");
    emulated.controls().inject(Some(PlantFault::WeakSupply));
    bench.wait_for_status("tripped", |status| {
        status["states"][0] == "tripped: supply-out-of-range"
    });
    let history = history(&bench);
    assert_eq!(
        (&history["storage"], &history["trips"]),
        (&json!("worn-out"), &json!(1))
    );
    assert_eq!(
        of_kind(&history, "start").len(),
        1,
        "what there was is there"
    );
    let emulated = bench.emulated_board().expect("emulated");
    emulated.controls().inject(None);
    bench.json(&["clear"]);
    bench.json(&["set-drive", "2V", "--settle", "10ms"]);
}

#[test]
fn a_stop_of_the_firmware_is_told_with_what_it_said() {
    let mut bench = Bench::emulated(MirrorConfig::bench());
    for (fault, name, cause, said) in [
        (
            PlantFault::Panic,
            "firmware-panic",
            "firmware",
            "panicked at src/board/mps2/",
        ),
        (PlantFault::HardFault, "hard-fault", "firmware", "at 0x"),
        (
            PlantFault::Hang,
            "watchdog-reset",
            "watchdog",
            "a part of the firmware had",
        ),
    ] {
        let emulated = bench.emulated_board().expect("emulated");
        emulated.controls().inject(Some(fault));
        bench.wait_for_status(name, |status| {
            status["states"][0] == format!("tripped: {name}")
        });
        let history = history(&bench);
        let start = &of_kind(&history, "start")[0]["start"];
        assert_eq!(
            (&start["fault"], &start["cause"]),
            (&json!(name), &json!(cause))
        );
        let told = start["said"].as_str().expect("text");
        assert!(told.starts_with(said), "{told}");
        let trip = &of_kind(&history, "trip")[0]["trip"];
        assert_eq!(trip["faults"], json!([name, name, name, name]));
        bench.json(&["clear"]);
    }
}
