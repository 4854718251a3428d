//! The same work on many items, on all processors.
//!
//! Rayon does it. Its iterators are compiled anew for every closure that they are given, which was a third of what the compiler did
//! for `diagnosis`; here it is compiled once, and what is left for each closure is a loop.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

/// What `work` makes of each item, in the order of the items. Work may call this again.
///
/// # Panics
/// As `work` does.
pub fn map<T: Send, R: Send>(
    items: impl IntoIterator<Item = T>,
    work: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    let items = items.into_iter().map(|item| Slot {
        item: Some(item),
        result: None,
    });
    let slots: Vec<Mutex<Slot<T, R>>> = items.map(Mutex::new).collect();
    on_all_processors(slots.len(), &|at| {
        let mut slot = slots[at].lock().unwrap_or_else(PoisonError::into_inner);
        slot.result = slot.item.take().map(&work);
    });
    let slots = slots.into_iter().map(Mutex::into_inner);
    slots
        .filter_map(|slot| slot.unwrap_or_else(PoisonError::into_inner).result)
        .collect()
}

/// What `work` makes of those items of which it makes anything, in their order.
///
/// # Panics
/// As `work` does.
pub fn filter_map<T: Send, R: Send>(
    items: impl IntoIterator<Item = T>,
    work: impl Fn(T) -> Option<R> + Sync,
) -> Vec<R> {
    map(items, work).into_iter().flatten().collect()
}

/// An item until its turn comes, and what was made of it from then on.
struct Slot<T, R> {
    item: Option<T>,
    result: Option<R>,
}

/// Not generic, which is all that it is for.
fn on_all_processors(count: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(work);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_stand_in_the_order_of_their_items() {
        let squares = map(0..1000_u32, |n| n * n);
        assert!(squares.into_iter().eq((0..1000).map(|n| n * n)));
        assert!(map(0..0, |n: u32| n).is_empty());
        let odd = filter_map(0..6, |n| (n % 2 == 1).then_some(10 * n));
        assert_eq!(odd, [10, 30, 50]);
    }

    #[test]
    fn items_may_be_changed_and_work_may_be_shared_out_again() {
        let mut rows = vec![vec![1, 2], vec![3], vec![]];
        let sums = map(&mut rows, |row| {
            row.push(10);
            map(row.iter(), |&n| n + 1).into_iter().sum::<i32>()
        });
        assert_eq!(sums, [16, 15, 11]);
        assert_eq!(rows, [vec![1, 2, 10], vec![3, 10], vec![10]]);
    }

    #[test]
    #[should_panic(expected = "item 7")]
    fn work_that_panics_ends_all() {
        map(0..20, |n| assert!(n != 7, "item {n}"));
    }
}
