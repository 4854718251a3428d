//! Power cuts at every operation of an update, and again at every operation of what comes after.

use std::fmt;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use simulated_flash::{HalfWords, SimulatedFlash};

/// Something that keeps bytes in a flash.
pub(crate) trait Keeper {
    /// Stores `payload`; whether it says that it did.
    fn store(flash: &mut SimulatedFlash, payload: &[u8]) -> bool;

    /// What a start finds; `None` for nothing.
    fn load(flash: &mut SimulatedFlash) -> Option<Vec<u8>>;
}

/// What is tried.
#[derive(Clone)]
pub(crate) struct Campaign {
    pub(crate) pages: usize,
    pub(crate) payload_bytes: std::ops::Range<usize>,
    pub(crate) updates: usize,
    /// Draws of what half-written words read as, for each cut.
    pub(crate) draws: u64,
    /// Cut the following load and update too.
    pub(crate) twice: bool,
    pub(crate) words: HalfWords,
    pub(crate) seed: u64,
}

/// What came of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    /// Power cuts.
    pub(crate) cuts: u64,
    /// Starts that found neither the old nor the new payload.
    pub(crate) lost: u64,
    /// Updates after a cut, themselves not cut, that were refused.
    pub(crate) refused: u64,
    /// Such updates that were acknowledged, and that the next start did not find.
    pub(crate) vanished: u64,
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            cuts,
            lost,
            refused,
            vanished,
        } = self;
        write!(
            f,
            "{cuts} power cuts, {lost} starts with neither old nor new, {refused} later updates \
             refused, {vanished} acknowledged and vanished"
        )
    }
}

impl Campaign {
    /// Runs it on a flash that has seen some updates already.
    pub(crate) fn run<K: Keeper>(&self) -> Tally {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let mut tally = Tally::default();
        let mut flash = SimulatedFlash::new(self.pages, self.words, self.seed);
        let mut old = None;
        for _ in 0..self.updates {
            let new = self.payload(&mut rng);
            let newer = self.payload(&mut rng);
            self.cut_everywhere::<K>(&flash, &old, &new, &newer, &mut tally);
            assert!(K::store(&mut flash, &new), "refused without any cut");
            old = Some(new);
        }
        tally
    }

    fn payload(&self, rng: &mut ChaCha8Rng) -> Vec<u8> {
        let length = rng.random_range(self.payload_bytes.clone());
        (0..length).map(|_| rng.random()).collect()
    }

    fn cut_everywhere<K: Keeper>(
        &self,
        flash: &SimulatedFlash,
        old: &Option<Vec<u8>>,
        new: &[u8],
        newer: &[u8],
        tally: &mut Tally,
    ) {
        for draw in 0..self.draws {
            for operation in 0..operations_of(flash, |flash| _ = K::store(flash, new)) {
                let mut flash = flash.reseeded(draw ^ operation << 8);
                flash.cut_power_after(operation);
                K::store(&mut flash, new);
                tally.cuts += 1;
                flash.power_up();

                let allowed = [old.clone(), Some(new.to_owned())];
                let mut started = flash.clone();
                let found = K::load(&mut started);
                tally.lost += u64::from(!allowed.contains(&found));
                let acknowledged = K::store(&mut started, newer);
                started.power_up();
                let is_there = K::load(&mut started).as_deref() == Some(newer);
                tally.refused += u64::from(!acknowledged);
                tally.vanished += u64::from(acknowledged && !is_there);
                if self.twice {
                    cut_again::<K>(&flash, &allowed, newer, tally);
                }
            }
        }
    }
}

/// Cuts the start after a cut, and the update after that, at every operation of either.
fn cut_again<K: Keeper>(
    flash: &SimulatedFlash,
    allowed: &[Option<Vec<u8>>],
    newer: &[u8],
    tally: &mut Tally,
) {
    let restart = |flash: &mut SimulatedFlash| {
        K::load(flash);
        K::store(flash, newer);
    };
    for operation in 0..operations_of(flash, restart) {
        let mut flash = flash.reseeded(operation);
        flash.cut_power_after(operation);
        restart(&mut flash);
        tally.cuts += 1;
        flash.power_up();
        let found = K::load(&mut flash);
        let is_whole = allowed.contains(&found) || found.as_deref() == Some(newer);
        tally.lost += u64::from(!is_whole);
    }
}

/// Operations that `act` takes when nothing cuts it.
fn operations_of(flash: &SimulatedFlash, act: impl Fn(&mut SimulatedFlash)) -> u64 {
    let mut copy = flash.clone();
    act(&mut copy);
    copy.operations() - flash.operations()
}
