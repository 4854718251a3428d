//! What happens again and again must not wear out the flash.

/// The first so many of a kind are all written.
const ALL_UP_TO: u32 = 8;

/// Whether the `times`-th of a kind is written: the first eight are, and then every one whose count is a power of two.
/// So a million repetitions make 24 entries.
pub fn is_worth_writing(times: u32) -> bool {
    times <= ALL_UP_TO || times.is_power_of_two()
}

/// Counts what happens, kind by kind. Of more than `N` kinds the rest are counted as one, so that what is written
/// stays bounded whatever happens: less than 37 entries a kind for all that 32 bits count.
#[derive(Clone, Debug)]
pub struct Repeats<K, const N: usize> {
    kinds: [Option<(K, u32)>; N],
    others: u32,
}

impl<K: Copy + PartialEq, const N: usize> Repeats<K, N> {
    /// Nothing has happened yet.
    pub const fn new() -> Self {
        Self {
            kinds: [None; N],
            others: 0,
        }
    }

    /// Something of this kind happened; how often so far.
    pub fn count(&mut self, kind: K) -> u32 {
        let is_its = |place: &&mut Option<(K, u32)>| place.is_none_or(|(of, _)| of == kind);
        let times = match self.kinds.iter_mut().find(is_its) {
            Some(place) => &mut place.get_or_insert((kind, 0)).1,
            None => &mut self.others,
        };
        *times = times.saturating_add(1);
        *times
    }
}

impl<K: Copy + PartialEq, const N: usize> Default for Repeats<K, N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_repetitions_make_24_entries_and_all_that_can_be_counted_36() {
        let written = |most: u32| (1..=most).filter(|&times| is_worth_writing(times)).count();
        assert_eq!(written(1_000_000), 8 + 16);
        // Powers of two from 16 on, up to 2^31.
        let beyond = (4..32).filter(|&bit| is_worth_writing(1 << bit)).count();
        assert_eq!(8 + beyond, 36);
        assert!(!is_worth_writing(u32::MAX), "a count that stands is silent");
    }

    #[test]
    fn kinds_are_counted_apart_and_those_without_a_place_together() {
        let mut repeats = Repeats::<char, 2>::new();
        let counts: [u32; 8] = ['a', 'b', 'a', 'c', 'd', 'b', 'c', 'a'].map(|k| repeats.count(k));
        assert_eq!(counts, [1, 1, 2, 1, 2, 2, 3, 3]);
    }
}
