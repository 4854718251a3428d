//! The power is cut at every flash operation of an update, and at every operation of what follows.
//!
//! `cargo test -p calibration-store -- --nocapture` prints the figures.

mod campaign;

use calibration_store::{Loaded, Store};
use embassy_futures::block_on;
use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};
use simulated_flash::{FlashError, HalfWords, PAGE_BYTES, SimulatedFlash};

use crate::campaign::{Campaign, Keeper, Tally};

const SLOT_BYTES: usize = PAGE_BYTES;
const SLOTS: usize = 4;

type SimulatedStore = Store<SimulatedFlash, SLOT_BYTES>;

/// The store of this crate.
struct Ring;

impl Keeper for Ring {
    fn store(flash: &mut SimulatedFlash, payload: &[u8]) -> bool {
        with_store(flash, |store| store.store(payload).is_ok())
    }

    fn load(flash: &mut SimulatedFlash) -> Option<Vec<u8>> {
        let mut buffer = [0; SLOT_BYTES];
        with_store(flash, |store| match store.load(&mut buffer) {
            Ok(Loaded::Stored(payload)) => Some(payload.to_owned()),
            _ => None,
        })
    }
}

/// Runs `act` on a store that starts anew in `flash`.
fn with_store<T>(flash: &mut SimulatedFlash, act: impl FnOnce(&mut SimulatedStore) -> T) -> T {
    let mut store = SimulatedStore::new(flash.clone()).expect("large enough");
    let result = act(&mut store);
    *flash = store.into_flash();
    result
}

/// One slot, written over in place: what must not be done.
struct InPlace;

impl Keeper for InPlace {
    fn store(flash: &mut SimulatedFlash, payload: &[u8]) -> bool {
        let mut bytes = (payload.len() as u32).to_le_bytes().to_vec();
        bytes.extend(payload);
        bytes.resize(bytes.len().next_multiple_of(8), 0xff);
        flash.erase(0, PAGE_BYTES as u32).is_ok() && flash.write(0, &bytes).is_ok()
    }

    fn load(flash: &mut SimulatedFlash) -> Option<Vec<u8>> {
        let mut bytes = [0; PAGE_BYTES];
        flash.read(0, &mut bytes).ok()?;
        let length = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        Some(bytes.get(4..4 + length as usize)?.to_owned())
    }
}

type NoCache = Cache<Uncached, Uncached, Uncached, u8>;

/// The map of the crate sequential-storage, with one key.
struct Sequential;

/// The flash as sequential-storage asks for it.
struct Awaited<'a>(&'a mut SimulatedFlash);

impl embedded_storage::nor_flash::ErrorType for Awaited<'_> {
    type Error = FlashError;
}

impl embedded_storage_async::nor_flash::ReadNorFlash for Awaited<'_> {
    const READ_SIZE: usize = <SimulatedFlash as ReadNorFlash>::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        self.0.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl embedded_storage_async::nor_flash::NorFlash for Awaited<'_> {
    const WRITE_SIZE: usize = <SimulatedFlash as NorFlash>::WRITE_SIZE;
    const ERASE_SIZE: usize = <SimulatedFlash as NorFlash>::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        self.0.erase(from, to)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.0.write(offset, bytes)
    }
}

impl Sequential {
    const KEY: u8 = 1;

    fn map(flash: &mut SimulatedFlash) -> MapStorage<u8, Awaited<'_>, NoCache> {
        let range = 0..flash.capacity() as u32;
        MapStorage::new(Awaited(flash), MapConfig::new(range), Cache::new_uncached())
    }
}

impl Keeper for Sequential {
    fn store(flash: &mut SimulatedFlash, payload: &[u8]) -> bool {
        let mut buffer = [0; PAGE_BYTES];
        block_on(Self::map(flash).store_item(&mut buffer, &Self::KEY, &payload)).is_ok()
    }

    fn load(flash: &mut SimulatedFlash) -> Option<Vec<u8>> {
        let mut buffer = [0; PAGE_BYTES];
        let item = block_on(Self::map(flash).fetch_item::<&[u8]>(&mut buffer, &Self::KEY));
        item.ok()?.map(<[u8]>::to_owned)
    }
}

/// Updates of which every operation is cut.
fn updates() -> usize {
    if long_runs::are_asked_for() { 10 } else { 2 }
}

fn campaign(words: HalfWords) -> Campaign {
    Campaign {
        pages: SLOTS * SLOT_BYTES / PAGE_BYTES,
        payload_bytes: 100..700,
        updates: updates(),
        draws: 2,
        twice: true,
        words,
        seed: 0xca1,
    }
}

#[test]
fn every_cut_leaves_the_old_or_the_new_payload_whole() {
    for words in [HalfWords::Settle, HalfWords::Flicker] {
        let tally = campaign(words).run::<Ring>();
        println!("this store, half-written words {words:?}: {tally}");
        // An update has more than 500 operations, and twice: each is cut by itself and after another cut.
        assert!(tally.cuts > 1000 * updates() as u64, "{tally}");
        let nothing_lost = Tally {
            cuts: tally.cuts,
            ..Tally::default()
        };
        assert_eq!(tally, nothing_lost, "{words:?}");
    }
}

#[test]
fn the_campaign_finds_what_loses_payloads() {
    let tally = campaign(HalfWords::Settle).run::<InPlace>();
    assert!(tally.lost > tally.cuts / 2, "{tally}");
}

/// Why this crate is there. Should this ever fail, sequential-storage may do instead.
#[test]
fn sequential_storage_turns_back_in_silence_when_the_newest_record_rots() {
    let mut sound = SimulatedFlash::new(SLOTS, HalfWords::Settle, 1);
    assert!(Sequential::store(&mut sound, &[1; 300]));
    let begin = used(&mut sound);
    assert!(Sequential::store(&mut sound, &[2; 300]));
    let newest = begin..used(&mut sound);
    let turned_back = (8 * newest.start..8 * newest.end)
        .filter(|&bit| {
            let mut flash = sound.clone();
            flash.flip(bit);
            Sequential::load(&mut flash).as_deref() == Some(&[1; 300])
        })
        .count();
    println!(
        "sequential-storage 8.0: {turned_back} of {} flips in the newest of two records load the older",
        8 * newest.len()
    );
    assert!(turned_back > 0);
}

#[test]
#[ignore = "long"]
fn sequential_storage_loses_nothing_in_power_cuts_either() {
    for words in [HalfWords::Settle, HalfWords::Flicker] {
        let once = Campaign {
            twice: false,
            ..campaign(words)
        };
        let tally = once.run::<Sequential>();
        println!("sequential-storage 8.0, half-written words {words:?}: {tally}");
        assert_eq!((tally.lost, tally.vanished), (0, 0), "{tally}");
    }
}

/// Where the first page's last written byte ends.
fn used(flash: &mut SimulatedFlash) -> usize {
    let mut page = [0; PAGE_BYTES];
    flash.read(0, &mut page).expect("powered");
    page.iter()
        .rposition(|byte| *byte != 0xff)
        .map_or(0, |last| last + 1)
}
