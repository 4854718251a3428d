//! What a log gives back, whatever is cut, worn or lies there already.

use embedded_storage::nor_flash::NorFlash;
use fault_log::{Log, LogError, MAX_BYTES};
use proptest::prelude::*;
use simulated_flash::{HalfWords, PAGE_BYTES, SimulatedFlash};

const PAGES: usize = 2;
/// Entries of 128 bytes.
const SLOTS: usize = PAGES * PAGE_BYTES / 128;
/// Those of all pages but the one that is written.
const KEPT: usize = SLOTS - PAGE_BYTES / 128;

fn flash(words: HalfWords, seed: u64) -> SimulatedFlash {
    SimulatedFlash::new(PAGES, words, seed)
}

fn open(flash: SimulatedFlash) -> Log<SimulatedFlash> {
    Log::open(flash).expect("large enough")
}

/// All entries, the newest first.
fn entries(log: &mut Log<SimulatedFlash>) -> Vec<Vec<u8>> {
    let mut found = Vec::new();
    let mut most = Some(u32::MAX);
    while let Some(up_to) = most {
        let mut buffer = [0; MAX_BYTES];
        let Some((number, payload)) = log.newest_up_to(up_to, &mut buffer) else {
            break;
        };
        found.push(payload.to_owned());
        most = number.checked_sub(1);
    }
    found
}

/// A payload that says which one it is, of a length of its own.
fn payload(index: usize) -> Vec<u8> {
    let mut payload = (index as u32).to_le_bytes().to_vec();
    payload.resize(4 + index * 7 % (MAX_BYTES - 3), index as u8);
    payload
}

#[test]
fn as_many_as_all_pages_but_one_hold_are_there_the_newest_first() {
    let mut log = open(flash(HalfWords::Settle, 1));
    assert!(entries(&mut log).is_empty());
    for index in 0..5 * SLOTS {
        log.append(&payload(index)).expect("taken");
        let found = entries(&mut log);
        assert!(found.len() > KEPT.min(index), "{} of {index}", found.len());
        let newest = (0..=index).rev().take(found.len()).map(payload);
        assert_eq!(found, newest.collect::<Vec<_>>());
    }
    let flash = log.into_flash();
    assert_eq!(flash.erase_counts(), [5; PAGES], "pages wear alike");
    assert_eq!(
        open(flash).append(&[0; MAX_BYTES + 1]),
        Err(LogError::TooLong)
    );
    let small = SimulatedFlash::new(1, HalfWords::Settle, 1);
    assert!(Log::open(small).is_none());
}

/// Appends the entry `index` to what `flash` holds, whose power goes in the midst of an operation; whether it was
/// acknowledged, and the flash once the power is back.
fn append_cut(mut flash: SimulatedFlash, index: usize, operation: u64) -> (SimulatedFlash, bool) {
    flash.cut_power_after(operation);
    let mut log = open(flash);
    let acknowledged = log.append(&payload(index)).is_ok();
    let mut flash = log.into_flash();
    flash.power_up();
    (flash, acknowledged)
}

/// Operations that it takes to append the entry `index`.
fn operations(flash: &SimulatedFlash, index: usize) -> u64 {
    let mut log = open(flash.clone());
    log.append(&payload(index)).expect("taken");
    log.into_flash().operations() - flash.operations()
}

/// A start finds every entry that was acknowledged and has room, in order; of those that were cut it may find any.
fn assert_whole(flash: &SimulatedFlash, acknowledged: &[usize], cut: &[usize]) {
    let found = entries(&mut open(flash.clone()));
    let (cut_ones, whole): (Vec<_>, Vec<_>) = found
        .into_iter()
        .partition(|entry| cut.iter().any(|&index| *entry == payload(index)));
    assert!(cut_ones.len() <= cut.len());
    let newest = acknowledged.iter().rev().take(whole.len());
    assert_eq!(whole, newest.map(|&i| payload(i)).collect::<Vec<_>>());
    let torn = cut.len();
    assert!(
        whole.len() + torn >= KEPT.min(acknowledged.len()),
        "{whole:?}"
    );
}

/// The power is cut at every operation of every append, then at every one of the next, and then it goes on.
#[test]
fn a_power_cut_at_any_operation_tears_no_entry_but_the_one_that_is_written() {
    let mut cuts = 0;
    for words in [HalfWords::Settle, HalfWords::Flicker] {
        let mut sound = flash(words, 7);
        let mut acknowledged = Vec::new();
        for index in 0..2 * SLOTS + 3 {
            for operation in 0..operations(&sound, index) {
                let first = sound.reseeded(operation);
                let (first, is_taken) = append_cut(first, index, operation);
                assert!(!is_taken, "{index} at {operation}");
                assert_whole(&first, &acknowledged, &[index]);
                cuts += 1;
                for operation in 0..operations(&first, index + 1) {
                    let (second, is_taken) = append_cut(first.clone(), index + 1, operation);
                    assert!(!is_taken, "{index} + 1 at {operation}");
                    let mut log = open(second);
                    log.append(&payload(index + 2)).expect("taken");
                    let now = [&acknowledged[..], &[index + 2]].concat();
                    assert_whole(&log.into_flash(), &now, &[index, index + 1]);
                    cuts += 1;
                }
            }
            let mut log = open(sound);
            log.append(&payload(index)).expect("taken");
            sound = log.into_flash();
            acknowledged.push(index);
        }
    }
    println!("{cuts} power cuts, no entry lost that was acknowledged");
    assert!(cuts > 10_000, "{cuts}");
}

#[test]
fn a_board_whose_every_start_is_cut_goes_on_logging() {
    let mut flash = flash(HalfWords::Flicker, 3);
    for index in 0..5 * SLOTS {
        let operation = index as u64 % operations(&flash, index);
        flash = append_cut(flash, index, operation).0;
    }
    let mut log = open(flash);
    log.append(b"at last").expect("taken");
    assert_eq!(entries(&mut log)[0], b"at last");
}

#[test]
fn a_worn_flash_is_told_and_keeps_what_it_has() {
    for (worn_after, kept_at_least) in [(0, 0), (20, 1), (700, KEPT)] {
        let mut flash = flash(HalfWords::Settle, 5);
        flash.wear_out_after(worn_after);
        let mut log = open(flash);
        let taken = (0..).take_while(|&index| log.append(&payload(index)).is_ok());
        let taken = taken.count();
        assert_eq!(log.append(b"no more"), Err(LogError::WornOut));
        let found = entries(&mut log);
        assert!(found.len() >= kept_at_least, "{}", found.len());
        let newest = (0..taken).rev().take(found.len()).map(payload);
        assert_eq!(found, newest.collect::<Vec<_>>());
    }
}

proptest! {
    #[test]
    fn whatever_lies_in_the_flash_it_opens_and_takes_entries(
        bytes in proptest::collection::vec(any::<u8>(), PAGES * PAGE_BYTES),
        with_marks: bool,
        payloads in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..=MAX_BYTES), 1..40),
    ) {
        let mut bytes = bytes;
        if with_marks {
            bytes.chunks_exact_mut(128).for_each(|slot| slot[..4].copy_from_slice(b"LOG1"));
        }
        let mut flash = flash(HalfWords::Settle, 1);
        flash.write(0, &bytes).expect("erased");
        let mut log = open(flash);
        prop_assert!(entries(&mut log).is_empty(), "garbage is no entry");
        for payload in &payloads {
            prop_assert!(log.append(payload).is_ok());
        }
        let mut log = open(log.into_flash());
        let found = entries(&mut log);
        prop_assert!(found.len() >= KEPT.min(payloads.len()));
        let newest = payloads.into_iter().rev().take(found.len());
        prop_assert_eq!(found, newest.collect::<Vec<_>>());
    }

    #[test]
    fn a_bit_that_falls_over_hides_its_own_entry_only(bit in 0..8 * PAGES * PAGE_BYTES) {
        let mut log = open(flash(HalfWords::Settle, 1));
        for index in 0..SLOTS {
            log.append(&payload(index)).expect("taken");
        }
        let mut flash = log.into_flash();
        flash.flip(bit);
        let hit = bit / 8 / 128;
        let found = entries(&mut open(flash));
        let others: Vec<_> = (0..SLOTS).rev().filter(|&index| index != hit).map(payload).collect();
        let found: Vec<_> = found.into_iter().filter(|entry| *entry != payload(hit)).collect();
        prop_assert_eq!(found, others);
    }
}
