//! Input that is nearly right.

use rand::Rng;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

/// What has broken readers before.
const TOKENS: [&str; 24] = [
    "nan",
    "inf",
    "-inf",
    "1e400",
    "-1e400",
    "1e-400",
    "-0",
    "0",
    "-1",
    "1e308",
    "4294967296",
    "18446744073709551616",
    "0x",
    "",
    ",",
    ",,",
    "\n",
    "=",
    "#",
    "[",
    "\"",
    "\u{feff}",
    "µ",
    "\0",
];

/// Longest input that is tried.
const MAX_BYTES: usize = 8192;

/// An input made from `seeds`, one or two of them, by a few mutations.
pub(crate) fn mutated(seeds: &[Vec<u8>], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut input = seeds.choose(rng).cloned().unwrap_or_default();
    for _ in 0..rng.random_range(0..6) {
        mutate(&mut input, seeds, rng);
    }
    input.truncate(MAX_BYTES);
    input
}

fn mutate(input: &mut Vec<u8>, seeds: &[Vec<u8>], rng: &mut ChaCha8Rng) {
    let at = rng.random_range(0..=input.len());
    let end = rng.random_range(at..=input.len().min(at + 64));
    match rng.random_range(0..9) {
        0 => drop(input.drain(at..end)),
        1 => {
            let piece = input[at..end].to_vec();
            insert(input, at, &piece);
        }
        2 => insert(input, at, &[rng.random()]),
        3 => {
            let token = TOKENS.choose(rng).copied().unwrap_or_default();
            insert(input, at, token.as_bytes());
        }
        4 => input.truncate(at),
        5 => {
            if let Some(other) = seeds.choose(rng) {
                input.truncate(at);
                let from = rng.random_range(0..=other.len());
                input.extend(&other[from..]);
            }
        }
        6 => replace_number(input, at, rng),
        7 => {
            for byte in &mut input[at..end] {
                *byte = rng.random();
            }
        }
        _ => {
            if let Some(byte) = input.get_mut(at) {
                *byte ^= 1 << rng.random_range(0..8);
            }
        }
    }
}

fn insert(input: &mut Vec<u8>, at: usize, piece: &[u8]) {
    input.splice(at..at, piece.iter().copied());
}

/// Puts a token in the place of the first number from `at` on.
fn replace_number(input: &mut Vec<u8>, at: usize, rng: &mut ChaCha8Rng) {
    let is_number = |byte: &u8| byte.is_ascii_digit() || b"+-.eE".contains(byte);
    let Some(start) = input[at..].iter().position(u8::is_ascii_digit) else {
        return;
    };
    let start = at + start;
    let length = input[start..]
        .iter()
        .take_while(|byte| is_number(byte))
        .count();
    let token = TOKENS.choose(rng).copied().unwrap_or_default();
    input.splice(start..start + length, token.bytes());
}
