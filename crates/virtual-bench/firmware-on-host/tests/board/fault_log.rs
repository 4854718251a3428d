//! The fault log through the whole firmware: what a board says of its starts and trips after its power was cut, on a flash
//! that is sound, worn, or full of garbage.

use crate::{erased, with_a_bad_calibration};
use embedded_storage::nor_flash::NorFlash;
use fault_log::Log;
use firmware_on_host::{connect, enumerate, with_board_on, with_client};
use mirror_firmware::flash::LOG_BYTES;
use mirror_protocol::{
    CalibrationEndpoint, ClearEndpoint, FaultLogEndpoint, Kept, LogEntry, LogEvent, LogPage,
    LogQuery, LogStorage, Refusal, ResetCause, WireError,
};
use postcard_rpc::host_client::HostClient;
use protection::Fault;
use simulated_flash::{PAGE_BYTES, SharedFlash};

/// Entries of 128 bytes.
const SLOTS: usize = LOG_BYTES / 128;
const IN_A_PAGE: usize = PAGE_BYTES / 128;

async fn page(client: &HostClient<WireError>, most: u32) -> Result<LogPage, Refusal> {
    let query = LogQuery { most };
    let reply = client.send_resp::<FaultLogEndpoint>(&query).await;
    reply.expect("an answer")
}

/// The log, the newest entry first, of a board that is told nothing else.
async fn log(client: &HostClient<WireError>) -> (LogPage, Vec<LogEntry>) {
    let first = page(client, u32::MAX).await.expect("greeted");
    let mut entries: Vec<LogEntry> = first.entry.clone().into_iter().collect();
    while let Some(most) = entries.last().and_then(|last| last.number.checked_sub(1)) {
        match page(client, most).await.expect("greeted").entry {
            Some(entry) => entries.push(entry),
            None => break,
        }
    }
    (first, entries)
}

fn started(flash: &SharedFlash) -> (LogPage, Vec<LogEntry>) {
    with_client(flash, async |client| log(&client).await)
}

/// The boots whose starts are logged.
fn boots(entries: &[LogEntry]) -> Vec<u32> {
    let is_start = |entry: &&LogEntry| matches!(LogEvent::of(entry), Some(LogEvent::Start(_)));
    entries
        .iter()
        .filter(is_start)
        .map(|entry| entry.boot)
        .collect()
}

#[test]
fn every_start_has_a_number_and_a_cause() {
    let flash = erased();
    for boot in 1..=3 {
        let (page, entries) = started(&flash);
        assert_eq!((page.boot, page.trips), (boot, 0));
        assert_eq!(page.storage, LogStorage::Kept);
        assert_eq!(boots(&entries), (1..=boot).rev().collect::<Vec<_>>());
        let Some(LogEvent::Start(start)) = LogEvent::of(&entries[0]) else {
            panic!("{entries:?}");
        };
        assert_eq!(
            (start.cause, start.stop, start.skipped),
            (ResetCause::Power, None, 0)
        );
    }
}

#[test]
fn a_trip_is_there_after_the_next_start_with_what_the_board_drove() {
    let flash = with_a_bad_calibration();
    let bad = Some(Fault::CalibrationBad.code());
    for boot in 1..=2 {
        let (page, entries) = started(&flash);
        assert_eq!(page.trips, 1);
        let trips: Vec<_> = entries
            .iter()
            .filter_map(|entry| match LogEvent::of(entry) {
                Some(LogEvent::Trip(trip)) => Some((entry.boot, trip)),
                _ => None,
            })
            .collect();
        assert_eq!(trips.len(), boot);
        for (trip, boot) in trips.iter().zip((1..=boot as u32).rev()) {
            assert_eq!(trip.0, boot);
            assert_eq!((trip.1.faults, trip.1.times), ([bad; 4], 1));
            assert_eq!(trip.1.drive_v, [0.0; 4]);
            // A step of the converter is 0.1007 mV.
            assert!((trip.1.supply_v - 5.0).abs() < 1.1e-4, "{trip:?}");
        }
    }
}

#[test]
fn it_is_told_only_to_who_has_greeted() {
    with_board_on(&erased(), async |host| {
        let device = enumerate(&host).await.expect("it answers");
        let client = connect(&host, &device);
        assert_eq!(page(&client, u32::MAX).await, Err(Refusal::NoHello));
    });
}

#[test]
fn after_a_power_cut_at_any_operation_of_a_start_all_that_was_logged_before_is_there() {
    let flash = erased();
    // Up to the last entry of a page, so that the next start erases one, with entries in it.
    for _ in 0..SLOTS {
        started(&flash);
    }
    for _ in 0..2 {
        let before = flash.lock().clone();
        started(&flash);
        let operations = flash.lock().operations() - before.operations();
        assert!(operations > 2, "{operations}");
        let (page, entries) = started(&SharedFlash::new(before.clone()));
        let number = page.entry.expect("a start").number as usize;
        let erases = number.is_multiple_of(IN_A_PAGE);
        let known = boots(&entries);
        for operation in 0..operations {
            let flash = SharedFlash::new(before.reseeded(operation));
            flash.lock().cut_power_after(operation);
            let (cut, _) = started(&flash);
            assert_eq!(
                cut.storage,
                LogStorage::WornOut,
                "it says that nothing is kept"
            );
            flash.lock().power_up();
            let (page, entries) = started(&flash);
            assert_eq!(page.storage, LogStorage::Kept);
            let found = boots(&entries);
            // The start that was cut has an entry or not; one page is erased for it at most.
            let lost = if erases { IN_A_PAGE } else { 0 };
            assert!(found.len() + lost >= known.len(), "{operation}: {found:?}");
            let newest = known[0] - 1;
            let expected = (1..=newest).rev();
            let old = found.iter().copied().filter(|&boot| boot <= newest);
            assert!(
                old.zip(expected).all(|(found, expected)| found == expected),
                "{operation}: {found:?}"
            );
        }
    }
}

#[test]
fn a_worn_flash_is_told_and_the_board_works_without() {
    let flash = erased();
    started(&flash);
    flash.lock().wear_out_after(0);
    let (page, entries) = started(&flash);
    assert_eq!((page.storage, page.boot), (LogStorage::WornOut, 2));
    assert_eq!(boots(&entries), [1], "what there was is there");
    with_client(&flash, async |client| {
        let reply = client.send_resp::<CalibrationEndpoint>(&()).await;
        assert_eq!(
            reply.expect("an answer").expect("greeted").kept,
            Kept::Factory
        );
        let cleared = client.send_resp::<ClearEndpoint>(&()).await;
        cleared
            .expect("an answer")
            .expect("it does what it is told");
    });
}

#[test]
fn garbage_in_the_flash_is_no_log_and_is_written_over() {
    let flash = erased();
    flash.lock().write(0, &[0x5a; LOG_BYTES]).expect("erased");
    for boot in 1..=3 {
        let (page, entries) = started(&flash);
        assert_eq!((page.boot, page.storage), (boot, LogStorage::Kept));
        assert_eq!(entries.len(), boot as usize);
    }
}

#[test]
fn an_entry_of_another_format_is_told_as_such_and_boots_are_counted_on() {
    let flash = erased();
    // As firmware of a later version writes: format 200, boot 41, and what follows.
    let mut log = Log::open(flash.clone()).expect("large enough");
    log.append(&[200, 41, 0, 0, 0, 1, 2, 3]).expect("taken");
    let (page, entries) = started(&flash);
    assert_eq!(page.boot, 42);
    assert_eq!((entries[1].boot, LogEvent::of(&entries[1])), (41, None));
}
