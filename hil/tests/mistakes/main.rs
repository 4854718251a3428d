//! What the silicon twin catches: mistakes that a driver could make, one at a time in what the flashed image writes into a
//! register, and what of the board's behaviour shows it.

mod examine;
mod table;

use std::fs;

use emulated_board::Connected;
use rayon::prelude::*;
use silicon_twin::board::Board;
use silicon_twin::chip::Mistake;
use silicon_twin::{Image, Twin, flashed_image};
use virtual_mirror::MirrorConfig;

use examine::examine;
use table::{Mistaken, mistakes};

/// Every so-many-th mistake is tried where not all of them are: those of one part of the chip lie side by side.
const SHORT_STEP: usize = 5;

/// A board with the bench mirror, when power comes, whose driver makes a mistake.
fn twin(elf: &[u8], mistake: Option<Mistake>) -> Twin {
    let image = Image::from_elf(elf).expect("an image for this chip");
    let mirror = Connected::Mirror(Box::new(MirrorConfig::bench()));
    let board = Board::new(&mirror).expect("a mirror");
    let mut twin = Twin::new(image, board).expect("vectors");
    if let Some(mistake) = mistake {
        twin.chip.make(mistake);
    }
    twin
}

fn elf() -> Vec<u8> {
    fs::read(flashed_image()).expect("an image: `cargo xtask build stm32g474`")
}

#[test]
fn a_start_of_the_flashed_image_looks_sound() {
    assert_eq!(examine(&mut twin(&elf(), None)), Ok(()));
}

#[test]
fn mistakes_of_drivers_are_caught() {
    let elf = elf();
    let all = mistakes();
    let step = if long_runs::are_asked_for() {
        1
    } else {
        SHORT_STEP
    };
    let tried: Vec<Mistaken> = all.iter().copied().step_by(step).collect();
    let found: Vec<Result<(), String>> = tried
        .par_iter()
        .map(|mistaken| examine(&mut twin(&elf, Some(mistaken.mistake))))
        .collect();
    let mut missed = Vec::new();
    for (
        Mistaken {
            what, missed_as, ..
        },
        result,
    ) in tried.iter().zip(&found)
    {
        match (result, missed_as) {
            (Err(how), _) => println!("| {what} | {how} |"),
            (Ok(()), Some(why)) => println!("| {what} | not by a start: {why} |"),
            (Ok(()), None) => missed.push(what),
        }
    }
    let caught = found.iter().filter(|result| result.is_err()).count();
    println!(
        "{caught} of {} tried are caught, of {} in all",
        tried.len(),
        all.len()
    );
    assert!(missed.is_empty(), "not caught: {missed:#?}");
}

#[test]
fn few_mistakes_are_none_that_a_start_shows() {
    let all = mistakes();
    let missed = all.iter().filter(|mistaken| mistaken.missed_as.is_some());
    // 95 % are to be caught.
    assert!(missed.count() * 20 <= all.len());
}
