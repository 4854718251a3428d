//! What a store gives back, how it wears its flash, and what it does when a page is worn out.

use calibration_store::{Loaded, Store, StoreError};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use proptest::prelude::*;
use simulated_flash::{FlashError, HalfWords, PAGE_BYTES, PAGE_ENDURANCE, SimulatedFlash};

const SLOTS: usize = 4;
const MAX_BYTES: usize = Store::<SimulatedFlash, PAGE_BYTES>::MAX_BYTES;

fn flash() -> SimulatedFlash {
    SimulatedFlash::new(SLOTS, HalfWords::Settle, 5)
}

fn store() -> Store<SimulatedFlash, PAGE_BYTES> {
    Store::new(flash()).expect("large enough")
}

proptest! {
    #[test]
    fn payloads_come_back(
        payloads in proptest::collection::vec(
            proptest::collection::vec(any::<u8>(), 0..=MAX_BYTES), 1..12),
    ) {
        let mut store = store();
        for payload in payloads {
            prop_assert_eq!(store.store(&payload), Ok(()));
            let mut buffer = [0; MAX_BYTES];
            prop_assert_eq!(store.load(&mut buffer), Ok(Loaded::Stored(&payload)));
        }
    }

    #[test]
    fn any_flash_contents_load_without_panic(
        contents in proptest::collection::vec(any::<u8>(), SLOTS * PAGE_BYTES),
        with_magic: bool,
    ) {
        let mut contents = contents;
        if with_magic {
            contents[..4].copy_from_slice(b"CAL1");
        }
        let mut flash = flash();
        flash.write(0, &contents).expect("erased");
        let mut store = Store::<_, PAGE_BYTES>::new(flash).expect("large enough");
        let mut buffer = [0; MAX_BYTES];
        prop_assert_eq!(store.load(&mut buffer), Ok(Loaded::Damaged));
        prop_assert_eq!(store.store(b"new"), Ok(()));
        prop_assert_eq!(store.load(&mut buffer), Ok(Loaded::Stored(b"new")));
    }
}

#[test]
fn an_erased_flash_is_empty_and_a_small_one_is_no_store() {
    assert_eq!(store().load(&mut []), Ok(Loaded::Empty));
    let small = SimulatedFlash::new(SLOTS - 2, HalfWords::Settle, 5);
    assert!(Store::<_, PAGE_BYTES>::new(small).is_none());
}

#[test]
fn what_does_not_fit_is_refused_and_nothing_is_touched() {
    let mut store = store();
    store.store(b"old").expect("it fits");
    assert_eq!(store.store(&[0; MAX_BYTES + 1]), Err(StoreError::TooLong));
    assert_eq!(store.load(&mut [0; 2]), Err(StoreError::TooLong));
    assert_eq!(store.load(&mut [0; 3]), Ok(Loaded::Stored(b"old")));
}

#[test]
fn updates_wear_all_slots_alike() {
    const UPDATES: u32 = 10_000;
    let mut store = store();
    for update in 0..UPDATES {
        store.store(&update.to_le_bytes()).expect("taken");
    }
    let flash = store.into_flash();
    let counts = flash.erase_counts();
    let most = counts.iter().max().expect("slots");
    println!(
        "{UPDATES} updates: {counts:?} erasures a page; {PAGE_ENDURANCE} are promised, which is {} \
         updates",
        u64::from(UPDATES) * u64::from(PAGE_ENDURANCE) / u64::from(*most)
    );
    assert_eq!(counts, [UPDATES / SLOTS as u32; SLOTS]);
}

#[test]
fn rot_in_the_newest_record_never_turns_back_in_silence() {
    let mut store = store();
    store.store(&[1; 300]).expect("it fits");
    store.store(&[2; 300]).expect("it fits");
    let sound = store.into_flash();
    // The slot of the newest record: seal, header and payload.
    let newest = 8 * PAGE_BYTES..8 * (PAGE_BYTES + 32 + 300);
    let (mut outdated, mut whole) = (0, 0);
    for bit in newest.clone() {
        let mut flash = sound.clone();
        flash.flip(bit);
        let mut store = Store::<_, PAGE_BYTES>::new(flash).expect("large enough");
        match store.load(&mut [0; 300]).expect("readable") {
            Loaded::Outdated(payload) => {
                assert_eq!(payload, [1; 300]);
                outdated += 1;
            }
            Loaded::Stored(payload) => {
                assert_eq!(payload, [2; 300], "bit {bit} turned back");
                whole += 1;
            }
            other => panic!("bit {bit}: {other:?}"),
        }
        store.store(&[3; 300]).expect("it fits");
        assert_eq!(store.load(&mut [0; 300]), Ok(Loaded::Stored(&[3; 300])));
    }
    println!("one bit of the newest of two records: {outdated} flips told, {whole} harmless");
    // The seal's own 128 bits.
    assert_eq!((outdated, whole), (newest.len() - 128, 128));
}

#[test]
fn rot_in_an_older_record_is_no_matter() {
    let mut store = store();
    store.store(b"old").expect("it fits");
    store.store(b"new").expect("it fits");
    let mut flash = store.into_flash();
    flash.flip(8 * 32);
    let mut store = Store::<_, PAGE_BYTES>::new(flash).expect("large enough");
    assert_eq!(store.load(&mut [0; 3]), Ok(Loaded::Stored(b"new")));
}

/// A flash in which the page at `worn` keeps a bit stuck at 0.
struct Worn {
    flash: SimulatedFlash,
    worn: Vec<u32>,
}

impl ErrorType for Worn {
    type Error = FlashError;
}

impl ReadNorFlash for Worn {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        self.flash.read(offset, bytes)?;
        if self.worn.contains(&(offset / PAGE_BYTES as u32)) {
            bytes.iter_mut().for_each(|byte| *byte &= 0xfe);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl NorFlash for Worn {
    const WRITE_SIZE: usize = SimulatedFlash::WRITE_SIZE;
    const ERASE_SIZE: usize = SimulatedFlash::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        self.flash.erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.flash.write(offset, bytes)
    }
}

#[test]
fn worn_slots_are_passed_over_and_the_last_good_record_is_never_given_up() {
    let worn = |worn: &[u32]| Worn {
        flash: flash(),
        worn: worn.to_vec(),
    };
    let mut store = Store::<_, PAGE_BYTES>::new(worn(&[1, 2])).expect("large enough");
    let mut buffer = [0; 16];
    for payload in [b"one", b"two", b"six"] {
        assert_eq!(store.store(payload), Ok(()));
        assert_eq!(store.load(&mut buffer), Ok(Loaded::Stored(payload)));
    }
    let mut store = Store::<_, PAGE_BYTES>::new(worn(&[1, 2, 3])).expect("large enough");
    assert_eq!(store.store(b"one"), Ok(()));
    assert_eq!(store.store(b"two"), Err(StoreError::WornOut));
    assert_eq!(store.load(&mut buffer), Ok(Loaded::Stored(b"one")));
}
